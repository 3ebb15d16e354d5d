"""The point at given distances from three others: forward kinematics where all links end at one point."""

import numpy as np

from rrru.kinematics.legs import cross


def lower_intersection(centres_mm, radii_mm):
    """Lower, in z, of the two points (..., 3) that three spheres share; NaN where there is none.

    centres_mm: (..., 3 spheres, 3); radii_mm: broadcast to (..., 3). The two points mirror each other in the centres'
    plane. With u along the line of the first two centres, at the distance d, and v across it in their plane, where the
    third centre lies at (i, j),

        x = (d^2 + r1^2 - r2^2) / 2d,   y = (i^2 + j^2 + r1^2 - r3^2 - 2 i x) / 2j,   h^2 = r1^2 - x^2 - y^2.
    """
    centres = np.asarray(centres_mm, dtype=float)
    squares = np.broadcast_to(np.asarray(radii_mm, dtype=float) ** 2, centres.shape[:-1])
    first, second, third = centres[..., 0, :], centres[..., 1, :], centres[..., 2, :]
    with np.errstate(invalid="ignore", divide="ignore"):
        d = np.linalg.norm(second - first, axis=-1)
        along = (second - first) / d[..., None]
        i = ((third - first) * along).sum(axis=-1)
        perpendicular = third - first - i[..., None] * along
        j = np.linalg.norm(perpendicular, axis=-1)
        across = perpendicular / j[..., None]
        x = (d**2 + squares[..., 0] - squares[..., 1]) / (2.0 * d)
        y = (i**2 + j**2 + squares[..., 0] - squares[..., 2] - 2.0 * i * x) / (2.0 * j)
        height = np.sqrt(squares[..., 0] - x**2 - y**2)
        normal = cross(along, across)
        # centres in an upright plane have no lower side
        down = np.where(normal[..., 2:] == 0.0, np.nan, -np.sign(normal[..., 2:]))
        return first + x[..., None] * along + y[..., None] * across + down * height[..., None] * normal
