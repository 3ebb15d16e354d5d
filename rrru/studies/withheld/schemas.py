"""Tables of the check on withheld effects: verdicts first, the truth joined by the scoring alone.

Those below withheld/ pass between the rules, chunk by chunk of the robots.
"""

from dataclasses import replace

from rrru.campaign.schemas import TABLES as CAMPAIGN_TABLES
from rrru.store.schema import read_tables

_TABLES = read_tables("""
robot                  str    name of the robot or field campaign
kind                   str    paper (each trajectory once), full (reverse runs, speeds, payloads) or file {paper,
    full, file}
truth                  str    true effects joined by +; none; or outside:<name> for what the library does not hold
truth_leg              int    the one leg at fault, 1 to 3; 0 for all or none
strength               float  true gap rms over noise rms, without noise
weakest                float  the same of the weakest cause alone; 0 where nothing acts
oracle_detects         bool   a likelihood-ratio test that knows the true law detects it at 1 % false alarms
check                  str    label: the robots' effects are hidden; effect: the robot's effect is taken out of the
    library; field: recorded by another simulator {label, effect, field}

## withheld_answers | withheld/answers/{chunk}.parquet | robot
What was drawn for each robot: read by the virtual robot and by the scoring, never by the diagnosis.
--
robot kind truth truth_leg strength weakest
drawn                  str    all of the robot, as JSON: trajectories, seven deviations (rad, mm), causes

## withheld_states | withheld/states/{chunk}.parquet | robot
The sims of the diagnosis: calibrated without and corrected with effects.
--
robot
calibrated             str    the mechanism's deviations (rad, mm) of the calibration alone, as a JSON list
deviations             str    the mechanism's deviations of the corrected sim, as a JSON list
fitted_effects         str    effects of the corrected sim, as a JSON list of [name, shape, coordinates]
shapes                 str    shapes' parameters that were fitted further, as JSON by effect and name

## withheld_limits | tables/withheld_limits.parquet | check robot
What the data of each robot could tell somebody who knows the true law.
--
check                  str    as in withheld_scores
robot weakest
oracle_chi2            float  chi-square that the true law, its sizes fitted, takes off the calibration's
oracle_freedom         int    numbers fitted for that
oracle_detects
rival                  str    the wrong explanation nearest to the truth: as many effects as act, up to three where
    the library does not hold the truth; empty where nothing acts
rival_chi2             float? what it leaves of the noise-free gap; a few units cannot be told apart
imitated_share         float? share of the noise-free gap rms that it imitates, 0 to 1

## withheld_verdicts | tables/withheld_verdicts.parquet | check robot
What the diagnosis says about each withheld robot; made without knowing any answer.
--
check robot kind
effects                str    as in gap_verdicts
probability            float  of the whole verdict, 0 to 1
leg                    int    the one leg at fault, 1 to 3; 0 for all or none
gap_rms_mm             float  gap under the calibrated sim, 3-D
noise_rms_mm           float  measuring noise, 3-D
share_closed           float  share of the gap that the verdict's effects close on held-out runs
confusable_with        str    as in gap_verdicts
next_runs              str    as in gap_verdicts

## withheld_scores | tables/withheld_scores.parquet | check robot
Each verdict beside the truth.
--
check robot kind truth truth_leg strength
verdict                str    the diagnosis's effects
right                  bool   it names exactly the truth or, where the library lacks that, says unexplained
leg_right              float? 1 where the leg is right, 0 where not; null where there is none to name
probability            float  that the diagnosis gave its verdict, 0 to 1
oracle_detects
share_closed_true      float? share of the true gap that the corrected sim closes
share_closed           float? the same as the diagnosis predicts it; null where it predicts none

## withheld_summary | tables/withheld_summary.parquet | check group figure
The scores in figures, against what the tool is meant to reach.
--
check
group                  str    which robots are counted
figure                 str    what is counted
robots                 int    robots in the group
value                  float? the figure; null where the group is empty
low                    float? lower end of the 95 % Wilson interval; null where the figure is no share
high                   float? upper end
asked                  float? what the tool is meant to reach; null where nothing is asked

## withheld_confusion | tables/withheld_confusion.parquet | check truth verdict
How many robots of each truth got each verdict.
--
check
truth                  str    as in withheld_scores
verdict                str    as in withheld_scores
robots                 int    how many

## withheld_advice | tables/withheld_advice.parquet | robot round
Ambiguous robots whose cause is hidden: the verdict is below 0.9 beside rivals. The first advised run is driven on the
same robot with fresh noise, added and diagnosed, again until the verdict has 0.9 or nothing is advised; likewise, in
its place, a run drawn at random from those along trajectories, of as many points or as near to that as any.
--
robot truth
round                  int    times that runs were added, from 1 on
kind                   str    what is advised at first, as in gap_next_runs; nothing: the verdict stays as it is {run,
    poses, nothing}
verdict_before         str    verdict on the robot's own campaign
probability_before     float  of this verdict, 0 to 1
right_before           bool   whether it names exactly the truth, or unexplained where the library lacks that
gain_nats              float? of this round's advised run, as in gap_next_runs; null where there is none
advised_run            str    the advised run in words; empty where nothing is advised or the verdict is sure
verdict_advised        str    verdict with all advised runs so far
probability_advised    float  of this verdict, 0 to 1
right_advised          bool   as right_before
settled_advised        bool   the verdict then is right, and with a probability of 0.9 or more
random_run             str    the random run in words; empty where the verdict is sure
verdict_random         str    verdict with all random runs so far
probability_random     float  of this verdict, 0 to 1
right_random           bool   as right_before
settled_random         bool   as settled_advised

## withheld_advice_summary | tables/withheld_advice_summary.parquet | group round run
How many of the ambiguous robots are settled, as withheld_advice has it.
--
group                  str    which robots are counted
round                  int    as in withheld_advice
run                    str    which runs were added {advised, random}
robots                 int    robots in the group
settled                int    how many of them are settled
value                  float? share of them; null where the group is empty
low                    float? lower end of the 95 % Wilson interval
high                   float? upper end
""")
_ANSWERS = _TABLES[0]
_MEASURED = next(table for table in CAMPAIGN_TABLES if table.name == "measurements")
_MEASUREMENTS = replace(
    _MEASURED,
    name="withheld_measurements",
    path="withheld/measurements/{chunk}.parquet",
    description="One row per commanded point of each robot: all that the diagnosis is given.",
    columns=(*_ANSWERS.columns[:2], *_MEASURED.columns),
    key=("robot", "run", "point"),
)
TABLES = (_ANSWERS, _MEASUREMENTS, *_TABLES[1:])
