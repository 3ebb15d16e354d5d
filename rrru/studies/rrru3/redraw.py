"""Robustness of the paper's numbers to other draws of non-repeatability and noise: the same robot measured, calibrated
and driven again.
"""

from dataclasses import replace

import numpy as np
import pandas as pd

from rrru.calibration.calibrate import calibrate
from rrru.calibration.mean_distance import least_mean_distance
from rrru.campaign import measurements as rows
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.simulation.driven import non_repeatability
from rrru.simulation.tracker import measure
from rrru.studies.rrru3 import study_numbers as numbers
from rrru.studies.rrru3.paper import ERRORS_MM

# the middle 90 % of the draws
_QUANTILES = (0.05, 0.95)


def redraws(campaign, patterns, method, count, use_near_singularity=True):
    """Rows of `redraws` of a virtual campaign over `count` draws.

    patterns: trajectories of the line and of the spiral calibration; method: "genetic" is replaced by its optimum, the
    least mean distance. Empty where the numbers do not apply.
    """
    columns = ["draw", "item", "kind", "value", "met"]
    if count == 0 or not {run.trajectory for run in campaign.plan.runs} >= numbers.TRAJECTORIES:
        return pd.DataFrame(columns=columns)
    measurements, _ = campaign.run()
    usable = rows.usable(measurements, use_near_singularity)
    chosen = [usable & rows.on_trajectories(measurements, names) for names in patterns]
    motion = campaign.robot.motion(campaign.plan, campaign.robot.mechanism.inverse)
    result = []
    for draw in range(count):
        found, orders = _draw(campaign, measurements, motion, chosen, method, draw)
        for item, value in found.items():
            met = bool(numbers.matched(item, value, ERRORS_MM[item]))
            result.append((draw, item, "number", float(value), met))
        result += [(draw, f"order_{name}", "order", float(value), bool(value > 0.0)) for name, value in orders.items()]
    return pd.DataFrame(result, columns=columns)


def redraw_counts(found):
    """Rows of `redraw_counts` of those of `redraws`."""
    result = []
    for (item, kind), part in found.groupby(["item", "kind"], sort=False):
        result.append({"item": item, "kind": kind, "targets": 1, "met": part["met"].sum(), **_middle(part["value"])})
    parts = {"numbers": found["kind"] == "number", "orders": found["kind"] == "order", "all": found["met"].notna()}
    for item, chosen in parts.items():
        met = found[chosen].groupby("draw")["met"].agg(["sum", "all", "size"])
        if len(met):
            whole = {"targets": met["size"].iloc[0], "met": met["all"].sum()}
            result.append({"item": item, "kind": "count", **whole, **_middle(met["sum"])})
    frame = pd.DataFrame(result, columns=["item", "kind", "targets", "met", "median", "low", "high"])
    return frame.assign(draws=found["draw"].nunique())


def _middle(values):
    """Median and middle 90 % of values."""
    low, high = np.quantile(values, _QUANTILES)
    return {"median": float(np.median(values)), "low": float(low), "high": float(high)}


def _attained(campaign, motion, deviations):
    """Positions (n, 3) that the robot attains with commands corrected by deviations, without random errors.

    motion: of the nominal commands, whose loads are the same.
    """
    path, index = campaign.plan.path()
    drive = campaign.robot.mechanism.inverse(path, deviations)
    return campaign.robot.positions(replace(motion, drive=drive[index], path_drive=drive), campaign.plan.targets())[0]


def _measured(campaign, attained, generator):
    """Measured positions (n, 3) of attained ones, drawn in the order in which a virtual robot draws."""
    moved = attained + campaign.robot.non_repeatability_mm * non_repeatability(generator, len(attained))
    return measure(moved, campaign.noise_mm, generator)


def _draw(campaign, measurements, motion, chosen, method, number):
    """Numbers and margins of orders of one draw; chosen: rows (n,) of the line and of the spiral calibration."""
    mechanism, target = campaign.robot.mechanism, rows.command(measurements)
    theta, trajectory = rows.actuators(measurements, mechanism), measurements["trajectory"]
    attained = campaign.robot.positions(motion, campaign.plan.targets())[0]
    measured = _measured(campaign, attained, campaign.generator("redraw", number, "measure"))
    fits, after = [], []
    for calibrated in chosen:
        residuals = TargetPositions(mechanism, theta[calibrated], measured[calibrated], target[calibrated])
        fit = calibrate(residuals)
        if method != "least_squares":
            fit = least_mean_distance(residuals, fit.deviations)
        # the same draw for both calibrations
        generator = campaign.generator("redraw", number, "closed_loop")
        after.append(_measured(campaign, _attained(campaign, motion, fit.deviations), generator) - target)
        fits.append(fit)
    names = [mechanism.parameters.names.index(name) for name in numbers.LINKS]
    errors = measured - target, *after
    orders = numbers.group_orders(trajectory, *errors) | numbers.spike_orders(trajectory, *errors[:2])
    orders |= numbers.link_order(*(fit.deviations[names] for fit in fits))
    return numbers.study_numbers(trajectory, *errors) | {"lines_objective": fits[0].mean_mm}, orders
