"""Tables of the real robots: causes of their gap, models step by step, and the data behind them."""

from dataclasses import replace

from rrru.diagnosis.schemas import TABLES as GAP
from rrru.store.schema import read_tables

_OWN = """
campaign               str    the series: its data set, the varying part of its file name, its variant

## real_verdicts | tables/real_verdicts.parquet | campaign
One row per measured series of a real robot: causes of its gap, and residuals on held-out rows. Rms values are of 3-D
distances; for machines with measured lengths they are of one length.
--
campaign
dataset                str    its set in the configuration
robot                  str    what was measured
source                 str    file
effects                str    names joined by + in the order of their share; none; unexplained where no effect model
    holds it; undiagnosed where there are too few rows, and the numbers of a diagnosis are null; refused where the file
    cannot be used: notes says why, and every other number is null
probability            float? of this whole verdict, 0 to 1
where                  str    where the effects act; empty where nothing acts or no site is known
confounded_with        str    effects confounded with the verdict in this series; empty where none
noise_rms_mm           float? estimated noise, instrument and non-repeatability
gap_rms_mm             float? error of the calibrated model, noise subtracted
gap_after_rms_mm       float? the same, predicted for the corrected model on rows that it was not fitted on
share_closed           float? fraction of the gap that the effects explain
share_closed_low       float? lower end, 95 %
share_closed_high      float? upper end, 95 %
predicted_share        float? fraction of the calibrated model's mean square residual that the named causes explain,
    predicted by cross-validation on the training rows; null where no rows are held out
held_out_share         float? the same on the rows held out
held_out_mean_mm       float? mean held-out residual with the named causes
held_out_rms_mm        float? the same, root mean square
held_out_max_mm        float? the same, largest
held_out_a_rms_mm      float? the same for plain least squares: frames
held_out_b_rms_mm      float? + geometry
held_out_c_rms_mm      float? + compliance, the last of its kinds
held_out_d_rms_mm      float? + two harmonics of every drive
held_out_e_rms_mm      float? + drift of the base with the rows
reference_a_rms_mm     float? published rms of the same model on the same rows; null where none is stated
reference_{bcde}_rms_mm float? see reference_a_rms_mm
noise_stated_mm        float? noise per axis that the instrument states
next_runs              str    what to measure next; empty where no measurement helps
points                 int    rows fitted, one target each
dropped_points         int    rows left out as outliers
notes                  str    what to know about this series

## real_steps | tables/real_steps.parquet | campaign number
Models step by step, each fitted to the training rows and evaluated on held-out rows. The last is that of the verdict.
--
campaign
number                 int    from 1 on
model                  str    letter of the model, or its effect models
adds                   str    what it adds to the model before
parameters             int    numbers fitted
identifiable           int    number of these that are identifiable from the rows
train_rms_mm           float  residual on the rows that it was fitted on
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
Residuals of every row, of the calibrated model (bare) and of the model of the verdict.
--
campaign
row                    int    number in the file
reading                str    target, or length
x_mm                   float? measured position, or position in the verdict's model
{yz}_mm                float? see x_mm
bare_x_mm              float? position in the calibrated model; null where it was measured
bare_{yz}_mm           float? see bare_x_mm
bare_residual_mm       float? distance to the calibrated model, of lengths the signed difference
residual_mm            float? distance to the verdict's model, of lengths the signed difference
used                   bool   whether it was used in the fit
stands_out             bool   whether it is named for a large residual

## real_spectrum | tables/real_spectrum.parquet | campaign joint order
Waves of every joint's angle fitted to the residuals, one at a time.
--
campaign
joint                  str    the drive
order                  int    waves per turn
resolution             float  smallest difference of orders that the joint's travel resolves
before_rad             float? amplitude in addition to the calibrated model; null where this absorbs the wave
after_rad              float? amplitude in addition to the model of the verdict; null where that absorbs the wave
found_rad              float  amplitude in the verdict's error function of this joint; 0 where it has none
found_phase_rad        float  its phase: found sin(order x angle + phase)
found_error_rad        float  standard error of its sine and cosine

## real_carried | tables/real_carried.parquet | campaign carried_from
Held-out residuals of the model of one series on another series of the same robot, with only the frames fitted again.
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
