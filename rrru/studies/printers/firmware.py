"""Numbers that a printer's firmware calibrates: radius, angles of towers a and b, endstops, with distances the arms.

A rotation of the base is not identifiable, so that the angle of tower c is fixed. The firmware minimises the sum of
squares by coordinate steps and stops where steps of a stated size s improve no number. The Hessian H of the cost bounds
the error of this stop, without knowledge of its path:

    |saved - best|_i <= s sum_j |H^-1|_ij H_jj

A saved number with a larger error, beyond its own rounding, was not found from these readings. The firmware saves six
decimals, but three for endstops with an applied Z offset.
"""

import numpy as np

from rrru.estimation.observations.probed_heights import ProbedHeights

NAMES = ("radius", "angle_a", "angle_b", "endstop_a", "endstop_b", "endstop_c", "arm_a", "arm_b", "arm_c")
UNITS = ("mm", "deg", "deg", *("mm",) * 6)
# the firmware's weights: total weight of the heights over that of the distances
_HEIGHTS_COUNT = 2.0
_SAVED, _OFFSET = 5e-7, 5e-4


def residuals_of(printer, parameter_set=None):
    """Residuals of a printer's readings with the firmware's weights; by default for the parameters they calibrate."""
    distances, probed = len(printer.distance_mm), np.count_nonzero(~printer.by_hand)
    # heights entered by hand in addition to probed ones are not counted
    heights = probed or len(printer.height_mm)
    weight = _HEIGHTS_COUNT * distances / heights if distances else 1.0
    ways = -printer.height_drop_mm, printer.height_mm, -printer.distance_drop_mm, printer.distance_mm
    return ProbedHeights(printer.mechanism(parameter_set), *ways, weight)


def own_numbers(mechanism, deviations):
    """A printer's own numbers (p,), NAMES in UNITS, under deviations (p,), and their derivative (p, p) by these."""
    legs = mechanism.numbers(deviations)
    arm, radius = legs[:, 1], legs[0, 2]
    root = np.sqrt(arm**2 - radius**2)
    angle = np.degrees(np.asarray(mechanism.azimuth_rad) + legs[:, 3])
    slope = np.diag([1.0, *np.degrees([1.0, 1.0]), *np.ones(6)])
    slope[3:6, 0], slope[3:6, 6:] = radius / root, -np.diag(arm / root)
    count = len(deviations)
    return np.array([radius, *angle[:2], *(legs[:, 0] - root), *arm])[:count], slope[:count, :count]


def rounding(printer):
    """Half the last decimal (9,) of a printer's saved numbers, NAMES in UNITS."""
    endstops = printer.endstop_mm
    return np.where(np.arange(9) // 3 == 1, _OFFSET if (np.round(endstops, 3) == endstops).all() else _SAVED, _SAVED)


def own_jacobian(residuals, deviations):
    """Derivative (n, p) of the residual by the printer's own numbers."""
    return residuals.jacobian(deviations)[:, 0] @ np.linalg.inv(own_numbers(residuals.mechanism, deviations)[1])


def stop(jacobian, step):
    """Largest errors (p,) at which the coordinate search of a step can stop; jacobian (n, p)."""
    hessian = jacobian.T @ jacobian
    return step * np.abs(np.linalg.inv(hessian)) @ np.diag(hessian)
