"""Whether an advised run settles an ambiguous verdict, compared with random runs: driven, added and diagnosed.

A verdict is settled where it is right, and sure of each single decision: of each cause, or group of causes, that it
names, and of each that it does not. The probability of all of them together would never be high: few points never tell
that no further small cause acts at all.

The advice uses measurements alone. The robot that made them also drives the advised run. Lengths mm, times s.
"""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from rrru.campaign.plan import Plan
from rrru.diagnosis.design.advise import candidates
from rrru.diagnosis.diagnose import Diagnosis, diagnose
from rrru.pipeline.advised import advised_runs
from rrru.seeds import stream
from rrru.studies.blind_validation.noise import NoiseModel, with_noise
from rrru.studies.blind_validation.summary import wilson
from rrru.studies.blind_validation.verdicts import NONE, UNEXPLAINED, is_outside

# a correct answer of decisions this probable is settled; number of rounds in which the advice is followed
SURE, ROUNDS = 0.9, 3
ARMS = ("advised", "random")
# columns of withheld_verdicts that `ambiguous` reads
UNSURE = ["check", "robot", "probability", "confounded_with", "next_runs"]
_GROUPS = {
    "all": "",
    "a run is advised": "kind == 'run'",
    "poses are advised": "kind == 'poses'",
    "nothing is advised": "kind == 'nothing'",
}


@dataclass(frozen=True)
class Arm:
    """A robot's measurements including added runs, the added runs of its plan, and the diagnosis of all."""

    measurements: pd.DataFrame
    runs: tuple
    found: Diagnosis

    @property
    def advised(self):
        """The first row of `gap_next_runs` as a mapping, None where the verdict is settled or nothing is advised."""
        table = self.found.tables["gap_next_runs"]
        return table.iloc[0].to_dict() if len(table) and not self.is_sure else None

    @property
    def is_sure(self):
        """Whether each decision of the verdict is probable enough."""
        return least_sure_probability(self.found) >= SURE


def answer(found):
    """Probability by part of the verdict of a Diagnosis: a frozenset of a cause's name, or those of a group.

    "unexplained" is a cause, and so is "none" where the verdict has no other.
    """
    decided, posterior = found.decided, found.inference.posterior
    groups = {frozenset(group.names): group.probability for group in decided.groups}
    single = [name for name in decided.effects if not decided.group_of(name)]
    parts = groups | {frozenset([name]): posterior.marginal(name) for name in single}
    if decided.unexplained:
        parts[frozenset([UNEXPLAINED])] = posterior.probability_unexplained
    return parts or {frozenset([NONE]): decided.probability}


def least_sure_probability(found):
    """Probability of the least sure decision of a Diagnosis on a single cause, or on a group, of 0 to 1."""
    parts, posterior = answer(found), found.inference.posterior
    others = {name: posterior.marginal(name) for name in found.inference.problem.effects}
    others |= {UNEXPLAINED: posterior.probability_unexplained}
    said = frozenset().union(*parts)
    return float(min(*parts.values(), *(1.0 - p for name, p in others.items() if name not in said), 1.0))


def names_the_truth(truth, parts):
    """Whether each of some parts, as of `answer`, holds one true cause, and each true cause is in one of them.

    Of a cause from outside "unexplained" is enough.
    """
    if is_outside(truth):
        return frozenset([UNEXPLAINED]) in parts
    causes = set(truth.split("+"))
    return all(len(part & causes) == 1 for part in parts) and causes <= frozenset().union(*parts)


def ambiguous(verdicts):
    """Names of robots of the check label, in order, with an uncertain verdict and rival causes.

    verdicts: rows of `withheld_verdicts`. An advised run shows that there are rivals, even if none is probable enough
    to be named.
    """
    rivals = (verdicts["next_runs"] != "") | (verdicts["confounded_with"] != "")
    which = (verdicts["check"] == "label") & (verdicts["probability"] < SURE) & rivals
    return verdicts.loc[which, "robot"].tolist()


def follow(robot, measurements, conditions, known, library):
    """Rows of `withheld_advice` of one Robot, by round; none where its verdict is sure.

    measurements: its table; known: its MeasuredRobot; library: GapSettings of the diagnosis.
    """
    before = Arm(measurements, (), diagnose(measurements, known, library, details=False))
    if before.is_sure:
        return []
    arms, points, result = dict.fromkeys(ARMS, before), 0, []
    first = before.advised
    before_columns = {
        "robot": robot.name,
        "truth": robot.truth,
        "kind": first["kind"] if first else "nothing",
        **_verdict_columns("before", before.found, robot),
    }
    for number in range(1, ROUNDS + 1):
        generator = stream(conditions.seed, "withheld", "advice", robot.name, str(number))
        advised = arms["advised"].advised
        points = advised["points"] if advised else points
        chosen = {"advised": [advised] if advised else [], "random": random_runs(arms["random"], points, generator)}
        row = before_columns | {"round": number, "gain_nats": advised["gain_nats"] if advised else np.nan}
        for name, some in chosen.items():
            if some:
                driven = arms[name]
                for run in some:
                    driven = drive(robot, driven, run, conditions, generator)
                arms[name] = replace(driven, found=diagnose(driven.measurements, known, library, details=False))
            words = ", ".join(run["run"] for run in some)
            row |= {f"{name}_run": words, **_verdict_columns(name, arms[name].found, robot)}
            row[f"settled_{name}"] = row[f"right_{name}"] and arms[name].is_sure
        result.append(row)
    return result


def _verdict_columns(when, found, robot):
    """Verdict, probability of its least sure decision and whether it is correct, as columns with the suffix `when`."""
    return {
        f"verdict_{when}": found.verdict["effects"],
        f"probability_{when}": least_sure_probability(found),
        f"right_{when}": names_the_truth(robot.truth, answer(found)),
    }


def random_runs(arm, points, generator):
    """Random candidate runs of the advice that have together at least so many points, and one at least.

    Empty where the verdict of the Arm is settled.
    """
    chosen, choice = [], [] if arm.is_sure else candidates(arm.measurements)[0]
    while choice and sum(run["points"] for run in chosen) < max(points, 1):
        chosen.append(choice[generator.integers(len(choice))])
    return chosen


def drive(robot, arm, run, conditions, generator):
    """The Arm with an added run from a row of `gap_next_runs`, with the diagnosis of before."""
    campaign = robot.campaign(conditions)
    done, poses = (*campaign.plan.runs, *arm.runs), arm.found.tables["gap_next_poses"]
    new = advised_runs(run, poses, robot.trajectories, conditions.motion)
    plan = Plan((*done, *new), campaign.plan.dwell_s)
    table, _ = replace(campaign, plan=plan, noise_mm=0.0).run()
    extra = table[table["run"] > len(done)].reset_index(drop=True)
    numbered = extra.assign(run=extra["run"] - len(done))
    noisy = with_noise(numbered, NoiseModel(**robot.noise), conditions.noise_mm, generator).assign(run=extra["run"])
    return Arm(pd.concat([arm.measurements, noisy], ignore_index=True), (*arm.runs, *new), arm.found)


def advice_summary(followed):
    """Frame `withheld_advice_summary` from `withheld_advice`."""
    result = []
    for number in range(1, ROUNDS + 1):
        in_round = followed[followed["round"] == number]
        for group, which in _GROUPS.items():
            robots = in_round.query(which) if which else in_round
            for arm in ARMS:
                settled, count = int(robots[f"settled_{arm}"].sum()), len(robots)
                low, high = wilson(settled, count)
                value = settled / count if count else np.nan
                row = {"group": group, "round": number, "run": arm, "robots": count, "settled": settled}
                result.append(row | {"value": value, "low": low, "high": high})
    return pd.DataFrame(result)
