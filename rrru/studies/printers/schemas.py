"""Tables of the linear-delta printers: fits to their owners' readings, compared with the firmware's saved answers."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
printer                str    its id in the file

## printers | tables/printers.parquet | printer
One row per printer: fitted answer, saved answer (of its firmware), residuals, and whether readings and saved
answer belong together. Rms values are over readings.
--
printer
source                 str    where its readings are from; empty where the file does not say
evidence               str    first printer that it shares readings with, otherwise itself: one piece of evidence
heights                int    probed heights
distances              int    distances by calipers
numbers                int    calibrated numbers: 6 from heights, 9 with distances; 0 where it cannot be fitted
freedom                int    degrees of freedom: readings minus numbers
rank                   int    number of identifiable combinations of numbers
condition              float? of the scaled Jacobian
radius_fitted_mm       float? fitted radius; the other numbers are in printer_parameters
radius_saved_mm        float? radius as saved
largest_difference     float? largest difference between the saved and the fitted numbers, in mm or degrees
largest_difference_in  str    the number with this difference
largest_over_stop      float? largest difference over the largest possible stopping error of the other program
height_rms_fitted_mm   float? residual of the heights for the fitted answer
height_rms_saved_mm    float? residual of the heights for the saved answer
distance_rms_fitted_mm float? residual of the distances for the fitted answer; null without distances
distance_rms_saved_mm  float? residual of the distances for the saved answer; null without distances
noise_mm               float? 1 sigma, from the residuals: of a distance, of a height where there are no distances
arm_standard_error_mm  float? largest standard error of an arm's length; null where arms are not calibrated
common_arm_standard_error_mm float? standard error of the arms' common length from heights alone, which are
    hardly sensitive to the scale
dense_common_arm_standard_error_mm float? the same for 100 heights of the same noise, spread over the same disc
verdict                str    whether the saved answer is that of these readings; not calibrated: not stated; not
    fitted: the readings give no answer {reproduced, does not belong, not calibrated, not fitted}
reason                 str    why it does not belong, as far as the readings show; empty where it does
suspect                str    reading with p below the limit in printer_causes; empty where there is none
suspect_p              float? probability of a reading as bad as the worst one among all of them by noise alone
cause                  str    cause of the residuals of the calibration; none found; or not decidable, with the
    possible causes
effector_tilt          str    whether unequal rods of an arm tilt the platform, or what else to probe; empty where no
    probe offset from the nozzle is stated
effector_tilt_p        float? probability that noise explains as much of the readings as unequal rods
effector_tilt_power    float? probability that 0.1 mm between the rods of one arm would be found, for the least
    sensitive arm
notes                  str    what to know about this row

## printer_parameters | tables/printer_parameters.parquet | printer parameter
Every number of every printer: as fitted, as saved, and its uncertainty.
--
printer
parameter              str    radius, angle and endstop of a tower, or arm; the angle of tower c is fixed
unit                   str    of the numbers of this row {mm, deg}
fitted                 float? fitted; null where the readings do not calibrate it
saved                  float  as saved
difference             float? saved minus fitted
stop                   float? largest possible stopping error of the other program
standard_error         float? with the noise from the residuals
half_width_95          float? half the 95 % interval, Student's t with the printer's degrees of freedom
calibrated             bool   false for the arms where only heights were measured
agrees                 bool   whether the saved number is that of the readings, except the firmware's rounding; true
    where not calibrated
without_suspect        float? fitted to all readings except the suspicious one; null where none is

## printer_readings | tables/printer_readings.parquet | printer kind number
Every reading of every printer, with residuals of both answers and of the fit to all others.
--
printer
kind                   str    what was measured {height, distance}
number                 int    number of the reading among its kind, from 1
value_mm               float  the reading
residual_fitted_mm     float  reading minus the fitted model's
residual_saved_mm      float  reading minus the saved model's
left_out_mm            float  reading minus its prediction by the fit of all others
studentised            float? that over its standard error, for the firmware's ratio of noises; null without degrees
    of freedom
p                      float? probability of so large a value anywhere among the readings by noise alone (Bonferroni),
    the mean over noise ratios of a height to a distance from 0.125 to 2, weighted by their likelihood from the others
flagged                bool   true for a bad reading

## printer_causes | tables/printer_causes.parquet | printer cause
Possible causes of the residuals of a printer's calibration, for normal noise with a ratio of a height to a distance of
0.25 to 1. A bad reading that is found is removed before the others are tested.
--
printer
cause                  str    one bad reading; an error of the calipers; a measured object of another shape in x and
    y; arms of unknown length; steps of another length per tower; towers that lean, each by two angles
freedom_used           int    numbers that it adds and that the calibration does not absorb
explained_share        float? explained fraction of the residual sum of squares, for the firmware's ratio of noises;
    null without degrees of freedom
p                      float? probability that noise explains as much, the largest over the noise ratios, for a bad
    reading the mean; null without degrees of freedom
limit                  float  upper limit of p: the level over the causes and over the pieces of evidence
estimate               float? its number; null for causes with several
standard_error         float? of the number
unit                   str    of the number; empty for causes with several
detectable_mm          float? size with a power of 0.9 for p below the limit (noise in the firmware's ratio): rms over
    the readings of its part that the calibration does not absorb; of a bad reading its own error. Passing is not yet
    found: see verdict. Null where it is always confounded with another cause, and where nothing is decidable
confounded_with            str    other causes that are confounded with it, joined by a comma; empty where none
verdict                str    whether it acts: found where p is below the limit, also without any single reading,
    and no other cause is confounded with it {found, not found, not decidable, not decidable (rests on one reading)}
""")
