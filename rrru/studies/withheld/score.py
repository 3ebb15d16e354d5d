"""Verdicts beside the truth that was withheld from the diagnosis: the only code that sees both."""

from dataclasses import asdict
from typing import NamedTuple

import numpy as np
import pandas as pd

from rrru.effects.library import HOLDS
from rrru.gap.make_case import make_case
from rrru.gap.state import State
from rrru.studies.withheld.draw import fresh
from rrru.studies.withheld.oracle import Limits, limits, with_truth
from rrru.studies.withheld.outside import EFFECTS
from rrru.studies.withheld.parts import is_enough, parts
from rrru.studies.withheld.robots import Robot, noise_free
from rrru.studies.withheld.states import state_of
from rrru.studies.withheld.verdicts import is_right, scores

_LIMITS = ["oracle_chi2", "oracle_freedom", "oracle_detects", "rival", "rival_chi2", "imitated_share"]
# checks of one or two causes under the stated noise, whose limits are computed
_LIMITED = ("label", "effect")


class Scored(NamedTuple):
    """Frames `withheld_scores`, `withheld_limits` and `withheld_parts`."""

    scores: pd.DataFrame
    limits: pd.DataFrame
    parts: pd.DataFrame


def score_chunk(answers, measurements, verdicts, states, budget, conditions, library=EFFECTS):
    """What is Scored of the robots of a chunk from the five frames about them.

    library: effects by name that the diagnosis knew.
    """
    told = answers.merge(verdicts, on=["robot", "kind"]).merge(states, on="robot")
    points, found = (dict(list(frame.groupby("robot"))) for frame in (measurements, budget))
    measured, listed = [], []
    for row in told.to_dict("records"):
        name = row["robot"]
        taken_out = row["truth"] if row["check"] == "effect" else ""
        own = parts(Robot.from_json(row["drawn"]), row["effects"], found[name], conditions.noise_rms_mm, taken_out)
        measured.append(_measured(row, points[name], conditions, library, taken_out) | {"right": _right(row, own)})
        listed.append(own.assign(check=row["check"], robot=name))
    told = told.assign(**pd.DataFrame(measured, index=told.index))
    limited = told.loc[told["check"].isin(_LIMITED), ["check", "robot", "weakest", *_LIMITS]]
    return Scored(scores(told), limited, pd.concat(listed, ignore_index=True))


def _right(row, listed):
    """Whether the verdict of a row is right; listed: the robot's rows of `withheld_parts`."""
    if row["check"] == "many":
        return is_enough(listed, row["strength"])
    return is_right(row["truth"], row["effects"], row["check"])


def _measured(row, points, conditions, library, taken_out):
    """What is computed from a robot itself: its limits and the share of its gap that is truly closed."""
    robot = Robot.from_json(row["drawn"])
    calibrated, state = state_of(row)
    limit = Limits()
    if row["check"] in _LIMITED:
        case = _case(points.reset_index(drop=True), conditions, with_truth(library, robot.acting))
        limit = limits(case, calibrated, robot.acting, _known(library, taken_out))
    return asdict(limit) | {"share_closed_true": true_share(robot, conditions, calibrated, state, library)}


def _known(library, taken_out):
    """Names of a library without an effect and those that hold it as a special case."""
    return [name for name in library if name != taken_out and taken_out not in HOLDS.get(name, ())]


def _case(measurements, conditions, library):
    """The case of measurements under what all robots share."""
    return make_case(measurements, conditions.mechanism, conditions.masses, conditions.noise_mm, library)


def true_share(robot, conditions, calibrated, state, library):
    """Share of the true gap that the corrected sim closes on runs never driven; NaN without gap or with a lost pose."""
    driven = noise_free(fresh(robot, conditions), conditions) if robot.causes else None
    if driven is None:
        return np.nan
    case = _case(driven, conditions, library)
    before, after = case.residual(State(calibrated, {})), case.residual(state)
    return float(1.0 - np.sqrt((after**2).sum() / (before**2).sum()))
