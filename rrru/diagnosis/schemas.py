"""Tables of the gap diagnosis: where the calibrated model errs, which effect causes it, how far the gap shrinks."""

from dataclasses import replace

from rrru.kinematics.robot import Robot
from rrru.store.schema import Column, Table, read_tables

TABLES = read_tables("""
campaign               str    name of the campaign in the configuration
noise_rms_mm           float  measuring noise, 3-D
points                 int    points counted
effect                 str    name

## gap_verdicts | tables/gap_verdicts.parquet | campaign
One row per campaign: which effects cause its gap, where it is worst, how far it shrinks and what to run next. Rms
values are of 3-D distances.
--
campaign
effects                str    names joined by + in the order of their share; none; unexplained where the library does
    not hold it
unnamed                str    names joined by + of possible effects that the corrected model has as well: left-out
    points are nearer with them, but they may be a part of the unexplained error; empty where there are none
probability            float  that exactly these effects act, or that these and something unexplained do, 0 to 1; 1
    where there is no answer. gap_attribute has that of each effect
leg                    int    the one leg or drive at fault, from 1 on; 0 for all or none
where                  str    where the effects act, in words: sites, several in a row by the first and the last, of a
    robot with driven bars the legs; of several legs those at which the effect is not zero by its 95 % interval; empty
    where nothing acts
confounded_with        str    what else may act, joined by a comma: effects, unexplained and none that are not in the
    verdict and have a probability above 0.05; empty where none
groups                 str    effects that are confounded in this campaign, of which one acts, the most probable first,
    which is in effects: joined by |, groups by a semicolon; empty where none
searches_apart         float  largest difference of a cause's probability between searches from different starts, 0 to 1
noise_rms_mm
gap_rms_mm             float  residual error of the calibrated model, noise subtracted
gap_after_rms_mm       float  the same, expected of the corrected model on held-out runs
share_closed           float  explained fraction of the mean square gap, 0 to 1; below 0 where the correction makes it
    worse, on held-out runs
share_closed_low       float  lower end, 95 %, 0 to 1; below 0 where the correction makes it worse, on held-out runs
share_closed_high      float  upper end, 95 %, 0 to 1; below 0 where the correction makes it worse, on held-out runs
worst_x_mm             float  where the gap is largest, x, robot frame
worst_y_mm             float  where the gap is largest, y, robot frame
worst_z_mm             float  where the gap is largest, z, robot frame
next_runs              str    runs that would separate the causes best; empty where none is needed, helps or can be
    computed
undecided              str    the two answers, joined by ' / ', between which it matters most to decide, where nothing
    that can be simulated would; empty elsewhere
noise_stated_mm        float? noise per axis as the configuration states it; null where it does not
noise_correlation      float  of the noise from point to point along a run, 0 to 1
noise_runs_mm          float  offsets of the runs, 1 sigma per axis
noise_from             str    given: by the configuration, as known; fitted: around what is stated, to what neither
    calibration nor effects can fit, and not below what is stated unless the data contradict that (p < 0.01); repeats:
    the same, as small as repeated points show it {given, repeats, fitted}
points                 int    points diagnosed
dropped_points         int    outliers that the diagnosis left out
notes                  str    what the data lack for a better answer; empty where nothing
not_in_model           str    what was found and the robot's corrected file cannot hold; empty where nothing, or where
    the robot has no file
no_answer              str    why no cause is named and no corrected file is written: parameters of the calibration at
    their bounds, or an rms of many times the noise; empty where the answer holds, else effects is unexplained
file_error_mm          float? rms distance of the corrected file's robot from the diagnosed one at the measured poses;
    null where no file was corrected
file_error_fresh_mm    float? the same at 200 fresh poses between the measured ones
file_expected_mm       float? error to expect of the corrected file's robot at poses and loads like those measured: of
    its larger distance from the diagnosed one and gap_after_rms_mm, squares added; where the file cannot hold an
    effect, not below what its own fit leaves at left-out stops
file_remainder         str    what the corrected file leaves beyond the diagnosis and what to use; empty where nothing
file_headline          str    that the corrected file is worse than the calibration, and why; empty where it is not

## gap_left_out | tables/gap_left_out.parquet | campaign reason
How many points the diagnosis did not use, by reason; a point has the first reason that fits. None where all are used.
--
campaign
reason                 str    why {not measured, stale reading, outlier in the file, held out for a test, not solved,
    out of reach, near a singularity, outlier to the diagnosis}
points                 int    points left out

## gap_budget | tables/gap_budget.parquet | campaign part
What the gap's mean square is made of. Shares add up to 1 without that of sampling, which is no error of the robot;
calibration is no part of what is measured on fitted points and is added to their gap.
--
campaign
part                   str    effect, or kind; of a covariance both effects
kind                   str    effect; scatter: what does not repeat, noise above the stated; runs: offsets between runs;
    unexplained: systematic and predicted by nothing; covariance: of two confounded effects; sampling: what was
    measured minus the other parts, by this draw of the noise; calibration: uncertainty of its parameters
    {effect, scatter, runs, unexplained, covariance, sampling, calibration}
rms_mm                 float  root of its mean square, negative where that is
share                  float  of the gap's mean square
share_low              float  lower end, 95 %, from the posterior; of a cause that is probable enough for a name, given
    that it acts
share_high             float  upper end, 95 %, from the posterior
probability            float? that the part is real; null where that is no question, or where no noise is stated

## gap_locate | tables/gap_locate.parquet | campaign factor level
Where the gap is largest: its variance by factor, split over the levels of each factor. The factor drive expresses each
residual as errors of all drives together. Drives that move the point alike share these: their rms_mm do not add up to
the gap, and the largest share does not name the drive at fault.
--
campaign
factor                 str    what the points are split by {trajectory, region, direction, drive, motion_direction,
    speed, payload, time}
level                  str    value of the factor; of the sense of motion: the drive, and whether its value is rising or
    falling
points
rms_mm                 float  residual at this level
share                  float  share of the gap's variance, 0 to 1
share_low              float  lower end, 95 %
share_high             float  upper end, 95 %
share_of_noise         float  share that noise alone would give this level
noise_could            bool   true where noise alone could give this share
drive_rms_rad          float? the residual as equivalent error of the drive angle; null for every factor but drive
drive_rms_mm           float? the same of a slider's position, for robots with sliders
x_mm                   float? centre of the region, x, robot frame; null for other factors
y_mm                   float? centre of the region, y, robot frame; null for other factors
z_mm                   float? centre of the region, z, robot frame; null for other factors

## gap_identifiability | tables/gap_identifiability.parquet | campaign effect
Detectability and confounding of each effect in this campaign, whatever was measured.
--
campaign effect
testable               bool   false where the campaign lacks what the effect needs
visible_share          float? share of the effect's displacement that the calibration cannot absorb
detectable_mm          float? gap rms, 3-D, above which this effect alone is found 9 times of 10 at 1 % false alarms
confounded_with            str    the other effect that it is most confounded with; empty where none
confounded_share         float? largest share of its visible gap that one other effect can reproduce
note                   str    why it cannot be tested or separated; empty where it can

## gap_attribute | tables/gap_attribute.parquet | campaign effect
Posterior probability of each effect as a cause of the gap, none and unexplained included. An effect that was not tested
has none: these data say nothing about it.
--
campaign
effect                 str    name in the library or of the user's, none or unexplained
probability            float? that it is at work, 0 to 1; several may be at once; null where it was not tested
decision               str    named: from a probability of 0.7 on; group: one of several confounded ones, of which
    one acts as probably; possible: above 0.05; excluded; not tested: the reason is in note {named, group, possible,
    excluded, not tested}
group_probability      float? that one of its group is at work; null where it is in none
legs                   str    on each leg its own value, one value on all (same), the one leg, or some legs with a
    value each ("2 and 5"); empty where legs make no difference
log_evidence           float? of the best hypothesis with this effect over none, natural logarithm
heldout_gain           float? log predictive score gained at left-out points by adding it to the calibration
heldout_gain_low       float? lower end, 95 %, from the folds; null where there is one
heldout_gain_high      float? upper end, 95 %
note                   str    why the effect was not tested; empty where there is nothing to say

## gap_remainder | tables/gap_remainder.parquet | campaign follows
What the unexplained part of a gap looks like: how well a function of one variable predicts it. None where nothing is
unexplained.
--
campaign
follows                str    the variable: the value of a drive, also as an error of another one, the place, the time,
    also as a zero offset of a drive or as a shift of a target on the platform, the payload, the speed, the sense of
    motion of the drives
explained              float  share of its mean square that such a function predicts at left-out points, 0 to 1
scale                  float? distance over which the function changes; null for steps
unit                   str    of the variable
rms_mm                 float  rms distance of what the function makes

## gap_sets | tables/gap_sets.parquet | campaign rank
The sets of effects that carry the probability, best first.
--
campaign
rank                   int    1: most probable
effects                str    names joined by +, or none
legs                   str    legs of each effect in the same order, joined by +
unexplained            bool   true where something outside the library acts besides
probability            float  0 to 1
log_evidence           float  over none, natural logarithm

## gap_shrink | tables/gap_shrink.parquet | campaign step trajectory kind
How far the gap shrinks as the effects are added one after another.
--
campaign
step                   int    0: calibration alone
added                  str    effect added at this step; empty at 0
effects                str    all effects so far, joined by +, or none
trajectory             str    trajectory, * for all
kind                   str    held_out: at points that the fit has not used; resimulated: fitted on all runs, through
    the full spatial closure; given_model, corrected_model: the robot's file as it came, and as it is written back, on
    all runs {held_out, resimulated, given_model, corrected_model}
points
rms_mm                 float  measured minus model
max_mm                 float  largest distance
noise_rms_mm
gap_rms_mm             float  rms with the noise taken out, 0 at least; at the last held-out step the error to expect
    from the fitted numbers' uncertainty, mixed with that by the probability that something is unexplained
share_closed           float? explained fraction of the mean square gap, 0 to 1; below 0 where the correction makes it
    worse; null at step 0 and where there is no gap
share_closed_low       float? lower end, 95 %, 0 to 1; below 0 where the correction makes it worse; null at step 0 and
    where there is no gap
share_closed_high      float? upper end, 95 %, 0 to 1; below 0 where the correction makes it worse; null at step 0 and
    where there is no gap

## gap_parameters | tables/gap_parameters.parquet | campaign effect parameter
The corrected simulator: parameters of the effects in the verdict, the errors (effect: calibration) fitted with them,
and, where one of them is compliant, the errors of payload and tilt (effect: weight).
--
campaign effect
parameter              str    name of the parameter
place                  str    the drive or leg of a parameter that each of several has, in words; empty for others
unit                   str    unit of the value
value                  float  fitted value
standard_error         float? 1 sigma, correlated among them, with the error that an unexplained part causes; null at
    a bound and for what was not fitted
low_95                 float? lower end of the 95 % interval; null for what was not fitted
high_95                float? upper end of the 95 % interval, unequal distances from the value where a bound or a prior
    of two widths makes them so; null for what was not fitted
at_bound               bool   true where the fit ended at a bound

## gap_drive_functions | tables/gap_drive_functions.parquet | campaign effect drive drive_value
Errors of the drives over their own values, over the measured range, of effects in the verdict that depend on these
alone. Minus their mean: a constant is the drive's zero, which the calibration has.
--
campaign
effect
drive                  int    number of the drive, from 1 on
name                   str    name of the drive
unit                   str    of the drive's value and of its error {rad, mm}
drive_value            float  value of the drive
error                  float  what the drive is off by there
low_95                 float  lower end of the 95 % interval
high_95                float  upper end of the 95 % interval
worst                  bool   true where the error of this drive is largest

## gap_next_runs | tables/gap_next_runs.parquet | campaign rank
Runs that would separate effects which are confounded in this campaign. Those that resolve most of the doubt between all
probable answers are first.
--
campaign
rank                   int    1: resolves most
run                    str    the run in words
kind                   str    run: once more along a trajectory; poses: those of gap_next_poses, where no such run would
    decide {run, poses}
trajectory             str    trajectory to drive, or poses
reverse                bool   true where it is driven backwards
speed_mm_s             float? speed; null where any will do
payload_kg             float? payload; null where any will do
points                 int    points of the run
separates              str    the two answers between which it decides best, joined by ' / '
now_nats               float  expected log evidence between them in the present campaign
gain_nats              float  expected log evidence that the run adds

## gap_next_poses | tables/gap_next_poses.parquet | campaign pose
Poses that would separate effects where no further run along a trajectory of the campaign would decide. Each
is the middle of a straight pass from rest to rest, five points of which are read, both ends included. They lie in the
box about the measured points, within the drives' ranges and clear of singularities; whether anything else is in the way
there has not been checked.
--
campaign
pose                   int    1: most informative; each further one adds most to those before it
from_{xyz}_mm          float  where the pass begins, robot frame
to_{xyz}_mm            float  where it ends
command_r{xyz}_rad     float? orientation of the platform, rotation vector; null where the drives cannot choose it
speed_mm_s             float? speed in the middle, to which the robot speeds up evenly; null where any will do
payload_kg             float  payload

## corrected_drives | campaigns/{campaign}/corrected_drives.parquet | point approach
Which drive values bring the robot, as diagnosed, to where it is commanded: on a grid over the measured region, of
campaigns whose robot is an MJCF or a URDF. Each drive has a column of its nominal value and one of the corrected.
--
point                  int    number of the grid's point
approach               int    1: all drives come from smaller values, -1: from larger ones, 0: both alike
command_{xyz}_mm       float  where the tool shall stand, robot frame
command_r{xyz}_rad     float  the platform's orientation there, that of the nearest measured point, rotation vector
payload_kg             float  the campaign's largest
time_s                 float  since the campaign's start: its end, as warm the robot is
temperature_c          float? of the campaign's last point, in degrees Celsius; null where the file has none

## gap_points | campaigns/{campaign}/gap_points.parquet | run point
The gap at every commanded point, before and after the effects are added to the model.
--
run                    int    as in measurements
trajectory             str    as in measurements
point                  int    as in measurements
command_{xyz}_mm       float  commanded position, robot frame
before_{xyz}_mm        float? measured minus calibrated model; null where nothing was measured
after_{xyz}_mm         float? measured minus corrected model, on held-out runs; null where it was not predicted
drive_error1_rad       float? before, as equivalent error of drive angle 1; null near singularities
drive_error2_rad       float? before, as equivalent error of drive angle 2; null near singularities
drive_error3_rad       float? before, as equivalent error of drive angle 3; null near singularities
drive_error1_mm        float? the same of slider 1, for robots with sliders
drive_error2_mm        float? the same of slider 2, for robots with sliders
drive_error3_mm        float? the same of slider 3, for robots with sliders
used                   bool   false where the diagnosis left the point out
""")


def tables_of(robot: Robot) -> tuple[Table, ...]:
    """The tables of the diagnosis, with the columns of the robot's own drives."""
    more = range(4, len(robot.parts.drives) + 1)
    text = "before, as equivalent error of drive {}; null for drives of another unit and near singularities"
    errors = [Column(f"drive_error{k}_{u}", "float64", text.format(k), True) for u in ("rad", "mm") for k in more]
    drives = [drive.column for drive in robot.parts.drives]
    values = [Column(name, "float64", f"nominal value {name}") for name in drives]
    values += [Column(f"corrected_{name}", "float64", f"corrected value {name}") for name in drives]
    added = {"gap_points": errors, "corrected_drives": values}
    return tuple(
        replace(table, columns=(*table.columns[:-1], *added.get(table.name, ()), table.columns[-1])) for table in TABLES
    )
