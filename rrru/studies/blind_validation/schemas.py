"""Tables of the check on withheld effects. Verdicts come first; only the scoring joins the truth.

Tables below withheld/ pass between the rules, one file per chunk of robots.
"""

from dataclasses import replace

from rrru.campaign.schemas import TABLES as CAMPAIGN_TABLES
from rrru.campaign.schemas import measurement_table
from rrru.store.schema import read_tables

_TABLES = read_tables("""
robot                  str    name of the robot or field campaign
kind                   str    paper (each trajectory once), full (reverse runs, speeds, payloads) or file {paper,
    full, file}
truth                  str    true effects joined by +; none; or outside:<name> for a cause outside the library
file                   str    entry in robots of a robot that is read from a file; empty for the 3-RRRU of our own
cause                  str    acting causes, as the plant names them, see rrru/studies/blind_validation/causes.py; for
    the 3-RRRU of our own the truth
truth_leg              int    the one leg at fault, from 1 on; 0 for all or none
strength               float  true gap rms over noise rms, without noise
weakest                float  the same of the weakest cause alone; 0 where nothing acts
oracle_detects         bool   a likelihood-ratio test with the true effect model detects it at 1 % false alarms; for
    label, effect, mujoco and own, false in the other checks
check                  str    label: the robots' effects are hidden; effect: the robot's effect is taken out of the
    library; noise: the noise is not as stated; many: three to six effects, axis errors and scatter; background: axis
    errors in every robot; as_robots_are: axis errors, scatter, noise not as stated and one to six effects; mujoco:
    robots of files simulated by MuJoCo; own: the same with our own effect models;
    field: recorded by another simulator {label, effect, noise, many, background, as_robots_are, mujoco, own, field}
decision               str    named: as a cause; group: it or others that these data confound with it; possible;
    excluded {named, group, possible, excluded}
group                  str    members of its group, separated by |, the most probable first; empty for none

## withheld_answers | withheld/answers/{chunk}.parquet | robot
The drawn truth of each robot: read by the virtual robot and by the scoring, never by the diagnosis.
--
robot kind truth truth_leg strength weakest
drawn                  str    all of the robot, as JSON: trajectories, deviations (rad, mm), causes

## withheld_states | withheld/states/{chunk}.parquet | robot
The models of the diagnosis: calibrated without effects and corrected with effects.
--
robot
calibrated             str    the mechanism's deviations (rad, mm) of the calibration alone, as a JSON list
deviations             str    the mechanism's deviations of the corrected model, as a JSON list
fitted_effects         str    effects of the corrected model, as a JSON list of [name, shape, coordinates, waves]
shapes                 str    shape parameters that were also fitted, as JSON by effect and name
numbers                str    numbers of the effects, as a JSON list of [effect, parameter, value, standard error]

## withheld_budget | withheld/budget/{chunk}.parquet | robot part
The budget of each robot's gap by the diagnosis.
--
robot
part                   str    as in gap_budget
kind                   str    as in gap_budget
rms_mm                 float  root of its mean square, negative where that is
share                  float  of the gap's mean square
share_low              float  lower end, 95 %, from the posterior
share_high             float  upper end, 95 %, from the posterior
probability            float? that the part is real; null where that is not estimated

## withheld_stated | withheld/stated/{chunk}.parquet | robot effect
Statements of the diagnosis on each tested effect, made without the truth.
--
robot
effect                 str    effect of the library
probability            float  posterior probability that it acts, 0 to 1
decision group

## withheld_limits | tables/withheld_limits.parquet | check robot
Upper limit of what the data of each robot can show when the true effect model is known; for the checks label, effect,
mujoco and own. The last two use the true displacement by the cause.
--
check                  str    as in withheld_scores
robot weakest
oracle_chi2            float  reduction of the chi-square of the calibration by the true effect model, its sizes fitted
oracle_freedom         int    number of parameters fitted for that
oracle_detects
rival                  str    the wrong explanation nearest to the truth: as many effects as act, up to three where
    the library does not hold the truth; empty where nothing acts
rival_chi2             float? residual of the noise-free gap with it; a few units are not distinguishable
confounded_share         float? fraction of the noise-free gap rms that is confounded with it, 0 to 1

## withheld_verdicts | tables/withheld_verdicts.parquet | check robot
Verdict of the diagnosis on each withheld robot, made without the truth.
--
check robot kind
effects                str    as in gap_verdicts
probability            float  of the whole verdict, 0 to 1
leg                    int    the one leg at fault, from 1 on; 0 for all or none
gap_rms_mm             float  gap of the calibrated model, 3-D
noise_rms_mm           float  measurement noise, 3-D
share_closed           float  fraction of the gap that the verdict's effects explain on held-out runs
confounded_with        str    as in gap_verdicts
next_runs              str    as in gap_verdicts

## withheld_scores | tables/withheld_scores.parquet | check robot
Each verdict compared with the truth.
--
check robot kind file cause truth truth_leg strength
verdict                str    the diagnosis's effects
right                  bool   it names exactly the truth or, where the library lacks that, says unexplained;
    background: joint_axis_error may be named; many and as_robots_are: it names all causes of 30 % of the gap, alone or
    in a group, no cause that does not act, no group without an acting member, and unexplained for a cause from
    outside of twice the noise
leg_right              float? 1 where the leg is right, 0 where not; null where there is none to name
probability            float  that the diagnosis gave its verdict, 0 to 1
oracle_detects
share_closed_true      float? fraction of the true gap that the corrected model explains
share_closed           float? the same as the diagnosis predicts it; null where it predicts none
numbers                int    true parameters of the cause (backlash, compliance, clearance, strain, lag) that it
    estimates with a standard error
held                   int    how many of them its 95 % intervals hold

## withheld_parts | tables/withheld_parts.parquet | check robot part
Each part of each robot's gap: its true size and the size that the diagnosis finds.
--
check robot
part                   str    effect, cause from outside, or kind
kind                   str    effect; background: errors of all axes; outside: the library does not hold it; scatter:
    non-repeatability beyond the stated noise; runs: offsets per run; unexplained: all from outside, root of
    the sum of squares {effect, background, outside, scatter, runs, unexplained}
strength               float  true rms over that of the stated noise; 0 for what is not there
true_rms_mm            float  gap that it leaves alone, after its own calibration; 0 for what is not there
found_rms_mm           float? as in gap_budget, 0 where that does not list it; null for a cause from outside
found_low_mm           float? lower end of its 95 % interval; as found_rms_mm where it is not listed
found_high_mm          float? upper end
probability            float? as in gap_budget, 0 where that does not list it; null for a cause from outside
named                  bool   the verdict names it; outside: says unexplained; scatter, runs: more probable than not

## withheld_causes | tables/withheld_causes.parquet | check robot effect
Statements of the diagnosis on each tested effect, compared with the truth.
--
check
robot
effect                 str    effect of the library
probability            float  posterior probability that it acts, 0 to 1
decision group
acts                   bool   it acts; the axis errors of the robot count as acting
strength               float  true rms of the gap that it makes alone over that of the stated noise; 0 where it does not
    act

## withheld_beliefs | timings/withheld/{chunk}.parquet | robot method
Answers of each method on robots whose cause is hidden, made without the truth.
--
robot
method                 str    diagnosis; bic: Bayes' information criterion; lasso; spike_and_slab;
    gaussian_process: names nothing {diagnosis, bic, lasso, spike_and_slab, gaussian_process}
effects                str    its answer, as in gap_verdicts; empty where it names nothing
probabilities          str    probability by set of effects, as JSON; all that is unexplained is one set; empty where it
    names nothing
share_closed           float? fraction of the gap that it predicts on held-out runs; null where that is not computed
seconds                float  computing time on this machine

## withheld_methods | timings/withheld_methods.parquet | method
Comparison of methods on the same robots, campaigns and stated noise. It is stored with the timings because only its
seconds differ from run to run.
--
method                 str    as in withheld_beliefs {diagnosis, bic, lasso, spike_and_slab, gaussian_process}
robots                 int    robots, all of the check label
right                  float? share of robots whose answer is correct, see withheld_scores; null where nothing is named
right_low              float? lower end of its 95 % Wilson interval
right_high             float? upper end
probability_true       float? mean probability of the true set, unexplained where the library does not hold it
brier                  float? mean Brier score over all sets, 0 (best) to 2
log_score              float? mean natural logarithm of the probability of the true set, 0.001 at least
share_closed           float? mean explained fraction of the gap on held-out runs, robots with a gap of 1.5 times the
    noise or more; null where that is not computed
seconds                float  mean computing time per robot on this machine
note                   str    what the method is

## withheld_summary | tables/withheld_summary.parquet | check group figure
Summary statistics of the scores, compared with the required values.
--
check
group                  str    which robots are counted
figure                 str    what is counted
robots                 int    how many are counted: robots in the group, parts of their gaps, numbers of their causes,
    statements on causes, or names
value                  float? the figure; null where the group is empty
low                    float? lower end of the 95 % Wilson interval; null where the figure is no share
high                   float? upper end
asked                  float? required value; null where nothing is required

## withheld_confusion | tables/withheld_confusion.parquet | check truth verdict
How many robots of each truth got each verdict.
--
check
truth                  str    as in withheld_scores
verdict                str    as in withheld_scores
robots                 int    how many

## withheld_advice | tables/withheld_advice.parquet | robot round
Ambiguous robots whose cause is hidden: the verdict has rivals, and a decision of it is below 0.9, be it that a cause or
one of a group acts or that another does not. The same robot drives the first advised run with fresh noise; the run is
added and diagnosed. This repeats until each decision has 0.9 or nothing is advised. For comparison the same is done
with random runs along trajectories of at least as many points.
--
robot truth
round                  int    times that runs were added, from 1 on
kind                   str    what is advised at first, as in gap_next_runs; nothing: the verdict stays as it is {run,
    poses, nothing}
verdict_before         str    verdict on the robot's own campaign
probability_before     float  of its least sure decision on a single cause or a group, 0 to 1
right_before           bool   whether each cause or group holds one true cause, and all true ones are among them; or
    unexplained where the library lacks the truth
gain_nats              float? of this round's advised run, as in gap_next_runs; null where there is none
advised_run            str    the advised run in words; empty where nothing is advised or the verdict is settled
verdict_advised        str    verdict with all advised runs so far
probability_advised    float  as probability_before
right_advised          bool   as right_before
settled_advised        bool   the verdict then is right, and each of its decisions has 0.9 or more
random_run             str    the random runs in words; empty where the verdict is settled
verdict_random         str    verdict with all random runs so far
probability_random     float  as probability_before
right_random           bool   as right_before
settled_random         bool   as settled_advised

## withheld_advice_summary | tables/withheld_advice_summary.parquet | group round run
How many of the ambiguous robots are settled, from withheld_advice.
--
group                  str    which robots are counted
round                  int    as in withheld_advice
run                    str    which runs were added {advised, random}
robots                 int    robots in the group
settled                int    how many of them are settled
value                  float? share of them; null where the group is empty
low                    float? lower end of the 95 % Wilson interval
high                   float? upper end

## withheld_statements | withheld/statements/{chunk}.parquet | check robot statement
Statements of pages of own robots, and answers to files with and without gross mistakes, each compared with the truth.
--
robot
check                  str    pages: all sentences and numbers of a page; mistakes: a file with one gross mistake;
    right_files: a file without {pages, mistakes, right_files}
truth                  str    the truth in words: cause or mistake, plant, file, what is read
statement              int    number of the statement about this robot, from 0 on
kind                   str    kind of sentence, number or mistake, see rrru/studies/blind_validation/sentences
text                   str    as on the page or in the message
result                 str    undecided: the truth neither contradicts nor confirms it {true,
    false, undecided}

## sentences | tables/sentences.parquet | kind
How many sentences and numbers on pages of own robots are true, kind by kind. A sentence that nothing can judge is of
the kind unknown.
--
kind                   str    as in withheld_statements
true                   int    how many are true
false                  int    how many are false
undecided              int    how many are neither
example_true           str    the first that is true, behind the robot's name; empty for none
example_false          str    the first that is false
example_undecided      str    the first that is neither
""")
_ANSWERS = _TABLES[0]


def _measurements(measured):
    """The table of measurements of several robots out of that of one."""
    return replace(
        measured,
        name="withheld_measurements",
        path="withheld/measurements/{chunk}.parquet",
        description="One row per commanded point of each robot: the complete input of the diagnosis.",
        columns=(*_ANSWERS.columns[:2], *measured.columns),
        key=("robot", "run", "point"),
    )


TABLES = (_ANSWERS, _measurements(next(t for t in CAMPAIGN_TABLES if t.name == "measurements")), *_TABLES[1:])


def tables_of(robot, names):
    """All tables; that of the measurements has a robot's own columns and those of `names`."""
    return (_ANSWERS, _measurements(measurement_table(robot, names)), *_TABLES[1:])
