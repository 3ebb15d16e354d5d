"""How much the reproduced numbers scatter: the same robot measured, calibrated and driven again with other draws of
wobble and noise.
"""

import numpy as np

from rrru.campaign import measurements as rows
from rrru.fit.campaign_fit import select
from rrru.fit.least_squares import least_squares
from rrru.fit.mean_distance import least_mean_distance
from rrru.studies.rrru3.study_numbers import TRAJECTORIES, study_numbers

# the middle 90 % of the draws
_QUANTILES = (0.05, 0.95)


def spread(virtual, calibration, reproduce, count):
    """Item to (low, high): the middle 90 % of the numbers of paper_a.ERRORS over `count` other draws; empty where they
    do not apply.

    virtual: the campaign, with `robot`, `plan`, `noise_mm` and `generator(*labels)`; calibration, reproduce: sections
    of the configuration. Method "genetic" is stood in for by its optimum, the least mean distance.
    """
    if count == 0 or not {run.trajectory for run in virtual.plan.runs} >= TRAJECTORIES:
        return {}
    draws = [_numbers(virtual, calibration, reproduce, k) for k in range(count)]
    return {item: tuple(np.quantile([numbers[item] for numbers in draws], _QUANTILES).tolist()) for item in draws[0]}


def _numbers(virtual, calibration, reproduce, number):
    """The numbers of one draw."""
    robot, mechanism = virtual.robot, virtual.robot.mechanism
    measured, _ = robot.run(virtual.plan, virtual.noise_mm, virtual.generator("redraw", number, "measure"))
    after, fits = {}, {}
    for key in ("line_calibration", "spiral_calibration"):
        patterns = calibration["sets"][reproduce[key]]
        residuals = select(measured, mechanism, patterns, calibration["use_near_singularity"])
        fits[key] = least_squares(residuals)
        if reproduce["method"] != "least_squares":
            fits[key] = least_mean_distance(residuals, fits[key].deviations)
        generator = virtual.generator("redraw", number, "closed_loop")
        again, _ = robot.run(
            virtual.plan, virtual.noise_mm, generator, lambda x, e=fits[key].deviations: mechanism.inverse(x, e)
        )
        after[key] = rows.measured(again) - rows.command(again)
    before = rows.measured(measured) - rows.command(measured)
    numbers = study_numbers(measured["trajectory"], before, after["line_calibration"], after["spiral_calibration"])
    return numbers | {"lines_objective": fits["line_calibration"].mean_mm}
