"""Tables of the linear-delta printers: fitted to their owners' readings, beside what their firmware saved."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
printer                str    its id in the file

## printers | tables/printers.parquet | printer
One row per printer: fitted answer, saved answer (of its firmware), residuals, and whether readings and saved
answer belong together. Rms values are over readings.
--
printer
source                 str    where its readings are from; empty where the file does not say
evidence               str    first printer that it shares readings with, itself where there is none before: one piece
    of evidence
heights                int    probed heights
distances              int    distances by calipers
numbers                int    calibrated numbers: 6 from heights, 9 with distances; 0 where it cannot be fitted
freedom                int    readings less numbers
rank                   int    combinations of numbers that the readings see
condition              float? of the scaled Jacobian
radius_fitted_mm       float? fitted radius; the other numbers are in printer_parameters
radius_saved_mm        float? radius as saved
largest_difference     float? largest difference between the saved and the fitted numbers, in mm or degrees
largest_difference_in  str    the number that it is in
largest_over_stop      float? largest difference over how far the other program can stop from the best number
height_rms_fitted_mm   float? residual of the heights under the fitted answer
height_rms_saved_mm    float? residual of the heights under the saved answer
distance_rms_fitted_mm float? residual of the distances under the fitted answer; null without distances
distance_rms_saved_mm  float? residual of the distances under the saved answer; null without distances
noise_mm               float? 1 sigma, from the residuals: of a distance, of a height where there are no distances
arm_standard_error_mm  float? largest standard error of an arm's length; null where arms are not calibrated
common_arm_standard_error_mm float? standard error of the arms' common length if heights alone had to give it: they
    hardly see the scale
dense_common_arm_standard_error_mm float? the same for 100 heights of the same noise, spread over the same disc
verdict                str    whether the saved answer is that of these readings; not calibrated: nobody says that it
    is; not fitted: the readings give no answer {reproduced, does not belong, not calibrated, not fitted}
reason                 str    why it does not belong, as far as the readings tell; empty where it does
suspect                str    reading that noise hardly explains, p below the limit in printer_causes; empty where there
    is none
suspect_p              float? probability of a reading as bad as the worst one among all of them by noise alone
cause                  str    cause of what the calibration leaves; none found; or not decidable, with those that it
    could be
effector_tilt          str    whether unequal rods of an arm tilt the platform, or what more to probe; empty where no
    probe beside the nozzle is stated
effector_tilt_p        float? probability that noise explains as much of the readings as unequal rods do
effector_tilt_power    float? probability that 0.1 mm between the rods of one arm would be found, of the arm that shows
    it worst
notes                  str    what to know about this row

## printer_parameters | tables/printer_parameters.parquet | printer parameter
Every number of every printer: as fitted, as saved, and how well the readings see it.
--
printer
parameter              str    radius, angle and endstop of a tower, or arm; the angle of tower c is fixed
unit                   str    of the numbers of this row {mm, deg}
fitted                 float? fitted; null where the readings do not calibrate it
saved                  float  as saved
difference             float? saved less fitted
stop                   float? how far from the best number the other program can stop
standard_error         float? with the noise from the residuals
half_width_95          float? half the 95 % interval, Student's t with the printer's freedom
calibrated             bool   false for the arms where only heights were measured
agrees                 bool   whether the saved number is that of the readings, but for the firmware's rounding; true
    for what is not calibrated
without_suspect        float? fitted to all readings but the suspicious one; null where none is

## printer_readings | tables/printer_readings.parquet | printer kind number
Every reading of every printer, under both answers and against the fit of all others.
--
printer
kind                   str    what was measured {height, distance}
number                 int    number of the reading among its kind, from 1
value_mm               float  the reading
residual_fitted_mm     float  reading less the fitted model's
residual_saved_mm      float  reading less the saved model's
left_out_mm            float  reading less what the fit of all others foretells
studentised            float? that over its standard error, under the firmware's ratio of noises; null where the
    others leave no freedom
p                      float? probability of so large a value anywhere among the readings by noise alone (Bonferroni),
    the mean over ratios of the noises of a height and a distance from 0.125 to 2 as likely as the others make them
flagged                bool   true for a bad reading

## printer_causes | tables/printer_causes.parquet | printer cause
Possible causes of what the calibration of a printer leaves, if its noise is normal and a height's 0.25 to 1 times a
distance's. A bad reading that is found is left out before the others are tested.
--
printer
cause                  str    one bad reading; an error of the calipers; a measured object of another shape in x and
    y; arms of unknown length; steps of another length per tower; towers that lean, each by two angles
freedom_used           int    numbers that it adds, as far as the calibration does not absorb them
explained_share        float? share of the sum of squares left that it explains, under the firmware's ratio of noises;
    null where nothing tells
p                      float? probability that noise explains as much, the largest over the noises' ratios, of a bad
    reading the mean; null without freedom
limit                  float  p has to be below it: the level over the causes and over the pieces of evidence
estimate               float? its number; null for causes with several
standard_error         float? of the number
unit                   str    of the number; empty for causes with several
detectable_mm          float? rms over the readings, of what the calibration does not absorb of it, that has p below
    the limit 9 times of 10 (noise in the firmware's ratio); of a bad reading its own error. Passing is not yet found:
    see verdict. Null where another cause always imitates it, and where nothing is decidable
imitated_by            str    other causes that hold what it explains, joined by a comma; empty where none
verdict                str    whether it is at work: found where p is below the limit, also without any single
    reading, and nothing imitates it {found, not found, not decidable, not decidable (rests on one reading)}
""")
