"""Verdicts compared with the truth that was withheld from the diagnosis. No other code sees both."""

from dataclasses import asdict, replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from rrru.diagnosis.make_problem import make_case
from rrru.diagnosis.state import State
from rrru.effects.library import HOLDS
from rrru.studies.blind_validation.causes import causes_of, empty_causes, groups_of
from rrru.studies.blind_validation.members import fresh_runs, robot_of
from rrru.studies.blind_validation.numbers import held
from rrru.studies.blind_validation.oracle import Limits, limits, of_displacement, with_truth
from rrru.studies.blind_validation.parts import is_enough, parts
from rrru.studies.blind_validation.states import state_of
from rrru.studies.blind_validation.verdicts import PLANTS, SEVERAL_CAUSES, is_right, scores

_LIMITS = ["oracle_chi2", "oracle_freedom", "oracle_detects", "rival", "rival_chi2", "confounded_share"]
# limits are computed for the checks with one or two causes and the stated noise
_LIMITED = ("label", "effect", *PLANTS)


class Scored(NamedTuple):
    """Frames `withheld_scores`, `withheld_limits`, `withheld_parts` and `withheld_causes`."""

    scores: pd.DataFrame
    limits: pd.DataFrame
    parts: pd.DataFrame
    causes: pd.DataFrame


def score_chunk(answers, measurements, verdicts, stated, states, budget, known):
    """The Scored tables of the robots of a chunk.

    answers, measurements, verdicts, stated, states, budget: frames of these robots; known: Known by the entry of the
    robot's file, with an empty name for our own 3-RRRU.
    """
    robots = answers.merge(verdicts, on=["robot", "kind"]).merge(states, on="robot")
    points, found, on_causes = (dict(list(frame.groupby("robot"))) for frame in (measurements, budget, stated))
    measured, listed, causes = [], [], []
    for row in robots.to_dict("records"):
        name, robot = row["robot"], robot_of(row["drawn"])
        about = known[robot.file]
        taken_out = row["truth"] if row["check"] == "effect" else ""
        parts_of_gap = parts(robot, row["effects"], found[name], about.conditions.noise_rms_mm, taken_out)
        statements = on_causes.get(name, empty_causes())
        right = _right(row, robot, parts_of_gap, groups_of(statements))
        measured.append(_measured(row, robot, points[name], about, taken_out) | {"right": right})
        listed.append(parts_of_gap.assign(check=row["check"], robot=name))
        if len(statements):
            causes.append(causes_of(statements, robot).assign(check=row["check"]))
    robots = robots.assign(**pd.DataFrame(measured, index=robots.index))
    limited = robots.loc[robots["check"].isin(_LIMITED), ["check", "robot", "weakest", *_LIMITS]]
    # measurements that allow no test of an effect have no statement
    stated_causes = pd.concat(causes or [empty_causes()], ignore_index=True)
    return Scored(scores(robots), limited, pd.concat(listed, ignore_index=True), stated_causes)


def _right(row, robot, listed, groups):
    """Whether the verdict of a row on a robot is correct.

    listed: the robot's rows of `withheld_parts`; groups: of causes that are confounded in the verdict.
    """
    if row["check"] in SEVERAL_CAUSES:
        return is_enough(listed, row["strength"], groups)
    effects = row["effects"]
    if robot.file:
        effects = "+".join(name for name in effects.split("+") if name not in robot.also_allowed) or effects
    return is_right(row["truth"], effects, row["check"])


def _measured(row, robot, points, about, taken_out):
    """Columns that need the robot itself: limits, true explained fraction of the gap, coverage of its numbers."""
    calibrated, state, effects = state_of(row, about.library)
    case = _case(points.reset_index(drop=True), about, about.library)
    closed = true_share(robot, about, case.mechanism, calibrated, (state, effects))
    numbers, hold = held(row["numbers"], robot.numbers(about.conditions))
    columns = {"file": robot.file, "cause": robot.cause, "share_closed_true": closed, "numbers": numbers, "held": hold}
    return columns | asdict(_limits(row, robot, points, about, calibrated, taken_out))


def _limits(row, robot, points, about, calibrated, taken_out):
    """The Limits of a robot."""
    if row["check"] not in _LIMITED:
        return Limits()
    if robot.file:
        return of_displacement(robot.oracle_chi2)
    case = _case(points.reset_index(drop=True), about, with_truth(about.library, robot.acting))
    return limits(case, calibrated, robot.acting, _rivals(about.library, taken_out))


def _rivals(library, taken_out):
    """Names of the effects that may be a wrong explanation.

    Not among them: the effect taken out, effects with it as a special case, and effects with many coefficients. The
    last are confounded with everything that depends on the actuator positions.
    """
    few = [name for name, effect in library.items() if not effect.coordinates.broad]
    return [name for name in few if name != taken_out and taken_out not in HOLDS.get(name, ())]


def _case(measurements, about, library, mechanism=None):
    """The Case of measurements under Known; the mechanism is by default the one that these measurements observe."""
    conditions = about.conditions
    mechanism = mechanism or conditions.seen(measurements)
    return make_case(measurements, mechanism, conditions.masses, conditions.noise_mm, library)


def true_share(robot, about, mechanism, calibrated, corrected):
    """Fraction of the true gap that the corrected model explains on new runs; NaN without gap or with a lost pose.

    mechanism: with the calibrated parameters; corrected: the State and its effects by name.
    """
    state, effects = corrected
    driven = fresh_runs(robot, about.conditions)
    if driven is None:
        return np.nan
    case = _case(driven, about, about.library, mechanism)
    case = replace(case, library=case.library | effects).standing(state)
    # an effect that depends on the direction of approach predicts nothing where that direction is unknown
    known = case.complete({name for name, _ in state.effects} & case.known.keys())
    before, after = case.residual(State(calibrated, {}))[known], case.residual(state)[known]
    return float(1.0 - (after**2).sum() / (before**2).sum())
