"""Tables of the real robots: what causes their gap, model after model, and what that rests on."""

from dataclasses import replace

from rrru.diagnosis.schemas import TABLES as GAP
from rrru.store.schema import read_tables

_OWN = """
campaign               str    the series: its data set, what tells its file from the set's others, its variant

## real_verdicts | tables/real_verdicts.parquet | campaign
One row per measured series of a real robot: what causes its gap, and what is left on rows that no fit has seen. Rms
values are of 3-D distances, of machines of which lengths are known of one length.
--
campaign
dataset                str    its set in the configuration
robot                  str    what was measured
source                 str    file
effects                str    names joined by + in the order of their share; none; unexplained where no law holds it;
    undiagnosed where there are too few rows, and the numbers of a diagnosis are null; refused where the file cannot
    be used: notes says why, and every other number is null
probability            float? of this whole verdict, 0 to 1
where                  str    where the effects act; empty where nothing acts or no site is told
confusable_with        str    what the series cannot tell from the verdict; empty where nothing
noise_rms_mm           float? noise that is left, instrument and scatter
gap_rms_mm             float? what the calibrated model gets wrong, noise taken out
gap_after_rms_mm       float? the same, expected of the corrected model on rows that it was not fitted on
share_closed           float? share of the gap that the effects close
share_closed_low       float? lower end, 95 %
share_closed_high      float? upper end, 95 %
predicted_share        float? share of the mean square that the named causes take off the calibrated model's, foretold
    by folds of the training rows; null where no rows are held out
held_out_share         float? the same on the rows held out
held_out_mean_mm       float? what the named causes leave on the rows held out
held_out_rms_mm        float? the same, root mean square
held_out_max_mm        float? the same, largest
held_out_a_rms_mm      float? what plain least squares leave there: frames
held_out_b_rms_mm      float? + geometry
held_out_c_rms_mm      float? + compliance, the last of its kinds
held_out_d_rms_mm      float? + two harmonics of every drive
held_out_e_rms_mm      float? + drift of the base with the rows
reference_a_rms_mm     float? what others' fit of the same model leaves on the same rows; null where none is stated
reference_b_rms_mm     float? see reference_a_rms_mm
reference_c_rms_mm     float? see reference_a_rms_mm
reference_d_rms_mm     float? see reference_a_rms_mm
reference_e_rms_mm     float? see reference_a_rms_mm
noise_stated_mm        float? noise per axis that the instrument states
next_runs              str    what to measure next; empty where nothing helps
points                 int    rows fitted, a target each
dropped_points         int    rows left out as outliers
notes                  str    what to know about this series

## real_steps | tables/real_steps.parquet | campaign number
Model after model, each fitted to the training rows and judged on those held out. The last is that of the verdict.
--
campaign
number                 int    from 1 on
model                  str    letter of the model, or its laws
adds                   str    what it adds to the one before
parameters             int    numbers fitted
identifiable           int    of these, what the rows tell
train_rms_mm           float  what it leaves on the rows that it was fitted on
held_out_mean_mm       float? on the rows held out
held_out_rms_mm        float? the same, root mean square
held_out_max_mm        float? the same, largest

## real_parameters | tables/real_parameters.parquet | campaign effect parameter
Numbers of the verdict's model.
--
campaign
effect                 str    calibration, or the effect that the number belongs to
parameter              str    name
unit                   str    of the numbers of this row
value                  float  fitted
standard_error         float? null where it was not computed
nominal                float? null where it is zero or unknown
note                   str    what to know about this number

## real_points | tables/real_points.parquet | campaign row reading
What every row leaves, by the calibrated model (bare) and by that of the verdict.
--
campaign
row                    int    number in the file
reading                str    target, or length
x_mm                   float? where it was measured, or lies by the verdict's model
y_mm                   float? see x_mm
z_mm                   float? see x_mm
bare_x_mm              float? where it lies by the calibrated model; null where it was measured
bare_y_mm              float? see bare_x_mm
bare_z_mm              float? see bare_x_mm
bare_residual_mm       float? distance to the calibrated model, of lengths the signed difference
residual_mm            float? distance to the verdict's model, of lengths the signed difference
used                   bool   whether a fit has seen it
stands_out             bool   whether it is named as strange

## real_spectrum | tables/real_spectrum.parquet | campaign joint order
Waves of every joint's angle that fit what is left of the readings, one at a time.
--
campaign
joint                  str    the drive
order                  int    waves per turn
resolution             float  difference of the orders that the joint's travel tells apart
before_rad             float? amplitude beside the calibrated model; null where this takes the wave up
after_rad              float? amplitude beside the model of the verdict; null where that takes the wave up
found_rad              float  amplitude in the verdict's error function of this joint; 0 where it has none
found_phase_rad        float  its phase: found sin(order x angle + phase)
found_error_rad        float  standard error of its sine and cosine

## real_carried | tables/real_carried.parquet | campaign carried_from
What the model of one series leaves of another one of the same robot, with only the frames fitted anew, on rows held
out.
--
campaign
carried_from           str    the series that the model was fitted on
frames_rms_mm          float? nominal model
geometry_rms_mm        float? its calibrated geometry alone
causes_rms_mm          float? its model with all named causes

## real_seconds | timings/real_seconds.parquet | campaign step
How long it took.
--
campaign
step                   str    ingest, a model's letter, or gap
seconds                float  on this machine
"""
_BUDGET = next(table for table in GAP if table.name == "gap_budget")
TABLES = (
    *read_tables(_OWN),
    replace(_BUDGET, name="real_budget", path="tables/real_budget.parquet", description="The gap's budget by series."),
)
# those of one series, whatever the others of its set
SERIES_TABLES = tuple(table for table in TABLES if table.name != "real_carried")
