"""Slices of the reachable workspace with both singularity measures. Lengths in mm."""

from typing import TYPE_CHECKING

import numpy as np

from rrru.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from rrru.kinematics.robot import Robot

PLANES = {"xz": (0, 2, 1), "xy": (0, 1, 2)}


def slice_points(
    plane: str, at_mm: float, horizontal_mm: tuple[float, float], vertical_mm: tuple[float, float], step_mm: float
) -> FloatArray:
    """Regular grid (n, 3) in a plane, "xz" at a y or "xy" at a z; ranges (low, high) of its first and second axis."""
    first, second, fixed = PLANES[plane]
    grid_a, grid_b = np.meshgrid(
        np.arange(horizontal_mm[0], horizontal_mm[1] + 0.5 * step_mm, step_mm),
        np.arange(vertical_mm[0], vertical_mm[1] + 0.5 * step_mm, step_mm),
        indexing="ij",
    )
    points = np.empty((grid_a.size, 3))
    points[:, first], points[:, second], points[:, fixed] = grid_a.ravel(), grid_b.ravel(), at_mm
    return points


def measures(
    mechanism: "Robot", points_mm: FloatArray, theta: FloatArray
) -> tuple[BoolArray, FloatArray, FloatArray, FloatArray]:
    """Reachable (n,), translational and constraint measure (n,), constraint determinant (n,); NaN out of reach.

    theta (n, K): the actuator values of the points, as `planned` gives them.
    """
    # of the poses that these actuator values allow, the robot takes the one of its own assembly
    reachable = np.linalg.norm(mechanism.forward(theta, guess_mm=points_mm) - points_mm, axis=1) < 1e-6
    result = np.full((3, len(points_mm)), np.nan)
    inside = points_mm[reachable]
    result[:, reachable] = mechanism.singularities(inside, theta[reachable])
    return reachable, *result


def farthest_mm(robot: "Robot") -> float:
    """Distance of the farthest reachable point from the origin in mm, found on rays in all directions."""
    count = 400
    height, turn = np.linspace(-1.0, 1.0, count), np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    ring = np.sqrt(1.0 - height**2)
    rays = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=-1)
    radius = np.linspace(0.0, 1.0, 101)[1:] * robot.size_mm
    points = (radius[:, None, None] * rays).reshape(-1, 3)
    return float(np.linalg.norm(points[np.isfinite(robot.inverse(points)).all(axis=1)], axis=1).max())
