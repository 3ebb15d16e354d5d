"""Verdicts beside the truth that was withheld from the diagnosis: the only code that sees both."""

from dataclasses import asdict

import numpy as np
import pandas as pd

from rrru.gap.case import State
from rrru.gap.make_case import make_case
from rrru.studies.withheld.draw import fresh
from rrru.studies.withheld.oracle import limits, with_truth
from rrru.studies.withheld.outside import EFFECTS
from rrru.studies.withheld.robots import Robot, noise_free
from rrru.studies.withheld.states import state_of
from rrru.studies.withheld.verdicts import scores

_LIMITS = ["oracle_chi2", "oracle_freedom", "oracle_detects", "rival", "rival_chi2", "imitated_share"]


def score_chunk(answers, measurements, verdicts, states, conditions, library=EFFECTS):
    """Frames `withheld_scores` and `withheld_limits` of the robots of a chunk from the four frames about them.

    library: effects by name that the diagnosis knew.
    """
    told = answers.merge(verdicts, on=["robot", "kind"]).merge(states, on="robot")
    points = dict(list(measurements.groupby("robot")))
    measured = [_measured(row, points[row["robot"]], conditions, library) for row in told.to_dict("records")]
    told = told.assign(**pd.DataFrame(measured, index=told.index))
    return scores(told), told[["check", "robot", "weakest", *_LIMITS]]


def _measured(row, points, conditions, library):
    """What is computed from a robot itself: its limits and the share of its gap that is truly closed."""
    robot = Robot.from_json(row["drawn"])
    calibrated, state = state_of(row)
    case = _case(points.reset_index(drop=True), conditions, with_truth(library, robot.acting))
    names = [effect for effect in library if not (row["check"] == "effect" and effect == row["truth"])]
    share = true_share(robot, conditions, calibrated, state, library)
    return asdict(limits(case, calibrated, robot.acting, names)) | {"share_closed_true": share}


def _case(measurements, conditions, library):
    """The case of measurements under what all robots share."""
    return make_case(measurements, conditions.mechanism, conditions.masses, conditions.noise_mm, library)


def true_share(robot, conditions, calibrated, state, library):
    """Share of the true gap that the corrected sim closes on runs never driven; NaN without gap or with a lost pose."""
    driven = noise_free(fresh(robot, conditions), conditions) if robot.acting else None
    if driven is None:
        return np.nan
    case = _case(driven, conditions, library)
    before, after = case.residual(State(calibrated, {})), case.residual(state)
    return float(1.0 - np.sqrt((after**2).sum() / (before**2).sum()))
