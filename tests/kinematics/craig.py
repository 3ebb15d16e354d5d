"""Placements of DH rows after Craig, written out, independent of those of the package."""

import numpy as np
from scipy.spatial.transform import Rotation


def fixed(place, rpy_deg):
    """Placement (4, 4) of a fixed frame at a place (3,), its turn about the fixed x, y and z."""
    result = np.eye(4)
    result[:3, :3] = Rotation.from_euler("xyz", rpy_deg, degrees=True).as_matrix()
    result[:3, 3] = place
    return result


def row(numbers, angle):
    """Rx(alpha) Tx(a) Rz(theta + q) Tz(d) of numbers d, theta in degrees, a, alpha in degrees, at an angle q in rad."""
    d, theta, a, alpha = numbers[0], np.radians(numbers[1]) + angle, numbers[2], np.radians(numbers[3])
    (s, c), (sa, ca) = (np.sin(theta), np.cos(theta)), (np.sin(alpha), np.cos(alpha))
    return np.array(
        [
            [c, -s, 0.0, a],
            [s * ca, c * ca, -sa, -sa * d],
            [s * sa, c * sa, ca, ca * d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
