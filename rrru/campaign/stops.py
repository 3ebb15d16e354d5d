"""Point to point: the commanded motion when every point is measured at rest. Lengths in mm, times in s."""

import numpy as np

from rrru.campaign.plan import Plan, Run
from rrru.campaign.speed_profile import Trapezoid

# points of the straight path between two stops
_STEPS = 8


def cylinder_points(centre_mm, radius_mm, z_mm, count, generator):
    """Points (count, 3) spread evenly over an upright cylinder about (x, y) between two heights: a Sobol sequence."""
    from scipy.stats import qmc

    share = qmc.Sobol(3, rng=generator).random_base2(int(np.ceil(np.log2(count))))[:count]
    radius, angle = radius_mm * np.sqrt(share[:, 0]), 2.0 * np.pi * share[:, 1]
    x, y = centre_mm[0] + radius * np.cos(angle), centre_mm[1] + radius * np.sin(angle)
    low, high = sorted(z_mm)
    return np.stack([x, y, low + share[:, 2] * (high - low)], axis=-1)


def nearest_first(points_mm):
    """The points (n, 3) in an order of short ways: from the first one always to the nearest that is left."""
    left, order = list(range(1, len(points_mm))), [0]
    while left:
        distance = np.linalg.norm(points_mm[left] - points_mm[order[-1]], axis=1)
        order.append(left.pop(int(distance.argmin())))
    return points_mm[order]


def stops(name, points_mm, speed_mm_s, acceleration_mm_s2, settle_s, payload_kg=0.0):
    """Plan of one run straight from point to point (n, 3), measured at rest, `settle_s` after each arrival."""
    points = np.asarray(points_mm, dtype=float)
    ways = np.linalg.norm(np.diff(points, axis=0), axis=1)
    durations = [Trapezoid(float(way), speed_mm_s, acceleration_mm_s2).duration_s if way > 0.0 else 0.0 for way in ways]
    at = np.arange(len(points)) * _STEPS
    path = np.stack([np.interp(np.arange(at[-1] + 1), at, points[:, axis]) for axis in range(3)], axis=-1)
    at_rest = np.zeros_like(points)
    time = np.concatenate([[0.0], np.cumsum(np.array(durations) + settle_s)]) + settle_s
    return Plan((Run(name, points, path, at, time, at_rest, at_rest, float(speed_mm_s), float(payload_kg)),), 0.0)
