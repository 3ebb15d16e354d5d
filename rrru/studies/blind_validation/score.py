"""Verdicts beside the truth that was withheld from the diagnosis: the only code that sees both."""

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

_LIMITS = ["oracle_chi2", "oracle_freedom", "oracle_detects", "rival", "rival_chi2", "imitated_share"]
# checks of one or two causes under the stated noise, whose limits are computed
_LIMITED = ("label", "effect", *PLANTS)


class Scored(NamedTuple):
    """Frames `withheld_scores`, `withheld_limits`, `withheld_parts` and `withheld_causes`."""

    scores: pd.DataFrame
    limits: pd.DataFrame
    parts: pd.DataFrame
    causes: pd.DataFrame


def score_chunk(answers, measurements, verdicts, stated, states, budget, known):
    """What is Scored of the robots of a chunk from the six frames about them.

    known: what is Known of their robots by the entry of their files, with an empty name of our own.
    """
    told = answers.merge(verdicts, on=["robot", "kind"]).merge(states, on="robot")
    points, found, on_causes = (dict(list(frame.groupby("robot"))) for frame in (measurements, budget, stated))
    measured, listed, causes = [], [], []
    for row in told.to_dict("records"):
        name, robot = row["robot"], robot_of(row["drawn"])
        about = known[robot.file]
        taken_out = row["truth"] if row["check"] == "effect" else ""
        own = parts(robot, row["effects"], found[name], about.conditions.noise_rms_mm, taken_out)
        on_own = on_causes.get(name, empty_causes())
        right = _right(row, robot, own, groups_of(on_own))
        measured.append(_measured(row, robot, points[name], about, taken_out) | {"right": right})
        listed.append(own.assign(check=row["check"], robot=name))
        if len(on_own):
            causes.append(causes_of(on_own, robot).assign(check=row["check"]))
    told = told.assign(**pd.DataFrame(measured, index=told.index))
    limited = told.loc[told["check"].isin(_LIMITED), ["check", "robot", "weakest", *_LIMITS]]
    # where readings allow no effect to be tested nothing is stated
    stated_causes = pd.concat(causes or [empty_causes()], ignore_index=True)
    return Scored(scores(told), limited, pd.concat(listed, ignore_index=True), stated_causes)


def _right(row, robot, listed, groups):
    """Whether the verdict of a row on a robot is right.

    listed: the robot's rows of `withheld_parts`; groups: of causes that the verdict cannot tell apart.
    """
    if row["check"] in SEVERAL_CAUSES:
        return is_enough(listed, row["strength"], groups)
    effects = row["effects"]
    if robot.file:
        effects = "+".join(name for name in effects.split("+") if name not in robot.beside) or effects
    return is_right(row["truth"], effects, row["check"])


def _measured(row, robot, points, about, taken_out):
    """What is computed from a robot itself: limits, the share of its gap that is truly closed, numbers that hold."""
    calibrated, state, laws = state_of(row, about.library)
    case = _case(points.reset_index(drop=True), about, about.library)
    closed = true_share(robot, about, case.mechanism, calibrated, (state, laws))
    numbers, hold = held(row["numbers"], robot.numbers(about.conditions))
    told = {"file": robot.file, "cause": robot.cause, "share_closed_true": closed, "numbers": numbers, "held": hold}
    return told | asdict(_limits(row, robot, points, about, calibrated, taken_out))


def _limits(row, robot, points, about, calibrated, taken_out):
    """The Limits of a robot."""
    if row["check"] not in _LIMITED:
        return Limits()
    if robot.file:
        return of_displacement(robot.oracle_chi2)
    case = _case(points.reset_index(drop=True), about, with_truth(about.library, robot.acting))
    return limits(case, calibrated, robot.acting, _known(about.library, taken_out))


def _known(library, taken_out):
    """Names of a library without an effect, those that hold it as a special case, and laws of many coefficients.

    The last imitate whatever depends on the drives' values.
    """
    few = [name for name, effect in library.items() if not effect.coordinates.broad]
    return [name for name in few if name != taken_out and taken_out not in HOLDS.get(name, ())]


def _case(measurements, about, library, mechanism=None):
    """The case of measurements under what is Known, with the numbers that these tell by default."""
    conditions = about.conditions
    mechanism = mechanism or conditions.seen(measurements)
    return make_case(measurements, mechanism, conditions.masses, conditions.noise_mm, library)


def true_share(robot, about, mechanism, calibrated, corrected):
    """Share of the true gap that the corrected sim closes on runs never driven; NaN without gap or with a lost pose.

    mechanism: with the numbers that were calibrated; corrected: the State and its effects by name.
    """
    state, laws = corrected
    driven = fresh_runs(robot, about.conditions)
    if driven is None:
        return np.nan
    case = _case(driven, about, about.library, mechanism)
    case = replace(case, library=case.library | laws).standing(state)
    # an effect of the drives' sense of arrival says nothing where that is unknown
    known = case.complete({name for name, _ in state.effects} & case.known.keys())
    before, after = case.residual(State(calibrated, {}))[known], case.residual(state)[known]
    return float(1.0 - np.sqrt((after**2).sum() / (before**2).sum()))
