"""How much the reproduced numbers scatter: the same robot measured, calibrated and driven again with other draws of
non-repeatability and noise.
"""

import numpy as np

from rrru.campaign import measurements as rows
from rrru.fit.least_squares import least_squares
from rrru.fit.mean_distance import least_mean_distance
from rrru.fit.residuals import Residuals
from rrru.plant.tracker import measure
from rrru.plant.virtual_robot import non_repeatability
from rrru.studies.rrru3.study_numbers import TRAJECTORIES, study_numbers

# the middle 90 % of the draws
_QUANTILES = (0.05, 0.95)


def spread(campaign, patterns, method, count, use_near_singularity=True):
    """Item to (low, high): the middle 90 % of the numbers of paper.ERRORS over `count` other draws.

    campaign: the virtual one; patterns: trajectories of the line and of the spiral calibration; method: "genetic" is
    stood in for by its optimum, the least mean distance. Empty where the numbers do not apply.
    """
    if count == 0 or not {run.trajectory for run in campaign.plan.runs} >= TRAJECTORIES:
        return {}
    measurements, _ = campaign.run()
    usable = rows.usable(measurements, use_near_singularity)
    chosen = [usable & rows.on_trajectories(measurements, names) for names in patterns]
    attained = _attained(campaign, campaign.robot.mechanism.inverse)
    draws = [_numbers(campaign, measurements, attained, chosen, method, number) for number in range(count)]
    return {item: tuple(np.quantile([draw[item] for draw in draws], _QUANTILES).tolist()) for item in draws[0]}


def _attained(campaign, controller):
    """Positions (n, 3) that the robot attains under a controller, before anything random."""
    return campaign.robot.positions(campaign.robot.motion(campaign.plan, controller), campaign.plan.targets())[0]


def _measured(campaign, attained, generator):
    """Measured positions (n, 3) of attained ones, drawn in the order in which a virtual robot draws."""
    moved = attained + campaign.robot.non_repeatability_mm * non_repeatability(generator, len(attained))
    return measure(moved, campaign.noise_mm, generator)


def _numbers(campaign, measurements, attained, chosen, method, number):
    """The numbers of one draw; chosen: rows (n,) of the line and of the spiral calibration."""
    mechanism, target, theta = (
        campaign.robot.mechanism,
        rows.command(measurements),
        rows.actuators(measurements, campaign.robot.mechanism),
    )
    measured = _measured(campaign, attained, campaign.generator("redraw", number, "measure"))
    fits, after = [], []
    for calibrated in chosen:
        residuals = Residuals(mechanism, theta[calibrated], measured[calibrated], target[calibrated])
        fit = least_squares(residuals)
        if method != "least_squares":
            fit = least_mean_distance(residuals, fit.deviations)
        corrected = _attained(campaign, lambda x, deviations=fit.deviations: mechanism.inverse(x, deviations))
        # the same draw for both calibrations
        generator = campaign.generator("redraw", number, "closed_loop")
        after.append(_measured(campaign, corrected, generator) - target)
        fits.append(fit)
    return study_numbers(measurements["trajectory"], measured - target, *after) | {"lines_objective": fits[0].mean_mm}
