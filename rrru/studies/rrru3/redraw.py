"""Robustness of the paper's numbers to other draws of non-repeatability and noise: the same robot measured, calibrated
and driven again.
"""

from dataclasses import dataclass, replace

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
from rrru.studies.rrru3.twin_objective import draw_misfit

# the middle 90 % of the draws
QUANTILES = (0.05, 0.95)
_KINDS = ("none", "line", "spiral")
PLACE = ["run", "trajectory", "point"]


@dataclass(frozen=True)
class Draw:
    """One draw: its number, the paper's numbers in mm and margins of its orders by name, and error vectors.

    errors_mm: (n, 3) at all points before calibration and after the line and the spiral calibration.
    """

    number: int
    found: dict
    orders: dict
    errors_mm: tuple


def draws(campaign, patterns, method, chosen, use_near_singularity=True):
    """The Draws of chosen numbers of a virtual campaign.

    patterns: trajectories of the line and of the spiral calibration; method: "genetic" is replaced by its optimum, the
    least mean distance. None where the numbers do not apply.
    """
    if not len(chosen) or not {run.trajectory for run in campaign.plan.runs} >= numbers.TRAJECTORIES:
        return []
    measurements, _ = campaign.run()
    usable = rows.usable(measurements, use_near_singularity)
    calibrated = [usable & rows.on_trajectories(measurements, names) for names in patterns]
    motion = campaign.robot.motion(campaign.plan, campaign.robot.mechanism.inverse)
    return [_draw(campaign, measurements, motion, calibrated, method, number) for number in chosen]


def others(campaign, count):
    """Numbers of the first draws that the campaign does not measure itself."""
    return [number for number in range(count + 1) if number != campaign.draw][:count]


def redraws(drawn):
    """Rows of `redraws` of Draws."""
    result = []
    for draw in drawn:
        for item, value in draw.found.items():
            met = bool(numbers.matched(item, value, ERRORS_MM[item]))
            result.append((draw.number, item, "number", float(value), met))
        for name, value in draw.orders.items():
            result.append((draw.number, f"order_{name}", "order", float(value), bool(value > 0.0)))
    return pd.DataFrame(result, columns=["draw", "item", "kind", "value", "met"])


def draw_ranks(drawn):
    """Rows of `draw_ranks` of Draws, the one nearest to the printed numbers and orders first."""
    met = redraws(drawn).groupby(["draw", "kind"])["met"].sum().unstack()
    frame = pd.DataFrame(
        [(draw.number, draw_misfit(draw.found, draw.orders)) for draw in drawn], columns=["draw", "misfit"]
    ).sort_values(["misfit", "draw"], ignore_index=True)
    rank = np.arange(1, len(frame) + 1)
    return frame.assign(rank=rank, **{f"{kind}s_met": met.loc[frame["draw"], kind].to_numpy() for kind in met})


def redraw_errors(drawn, commands):
    """Rows of `redraw_errors`: middle 90 % of the errors of Draws at every point; commands: a plan's table."""
    columns = [*(f"error_{axis}_mm" for axis in "xyz"), "error_mm"]
    ends = [f"{column}_{end}" for end in ("low", "high") for column in columns]
    frames = [pd.DataFrame(columns=[*PLACE, "calibration", *ends])]
    for kind, *errors in zip(_KINDS, *(draw.errors_mm for draw in drawn), strict=True) if drawn else ():
        every = np.concatenate([errors, np.linalg.norm(errors, axis=-1, keepdims=True)], axis=-1)
        middle = np.concatenate(np.quantile(every, QUANTILES, axis=0), axis=-1)
        frames.append(commands[PLACE].assign(calibration=kind, **dict(zip(ends, middle.T, strict=True))))
    return pd.concat(frames[1:] or frames, ignore_index=True)


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
    low, high = np.quantile(values, QUANTILES)
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
    """One Draw; chosen: rows (n,) of the line and of the spiral calibration."""
    mechanism, target = campaign.robot.mechanism, rows.command(measurements)
    theta, trajectory = rows.actuators(measurements, mechanism), measurements["trajectory"]
    attained = campaign.robot.positions(motion, campaign.plan.targets())[0]
    measured = _measured(campaign, attained, campaign.drawn("measure", number))
    fits, after = [], []
    for calibrated in chosen:
        residuals = TargetPositions(mechanism, theta[calibrated], measured[calibrated], target[calibrated])
        fit = calibrate(residuals)
        if method != "least_squares":
            fit = least_mean_distance(residuals, fit.deviations)
        # the same draw for both calibrations
        generator = campaign.drawn("closed_loop", number)
        after.append(_measured(campaign, _attained(campaign, motion, fit.deviations), generator) - target)
        fits.append(fit)
    names = [mechanism.parameters.names.index(name) for name in numbers.LINKS]
    errors = measured - target, *after
    orders = numbers.group_orders(trajectory, *errors) | numbers.spike_orders(trajectory, *errors[:2])
    orders |= numbers.link_order(*(fit.deviations[names] for fit in fits))
    found = numbers.study_numbers(trajectory, *errors) | {"lines_objective": fits[0].mean_mm}
    return Draw(number, found, orders, errors)
