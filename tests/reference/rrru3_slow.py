"""The 3-RRRU written out leg by leg, with scipy's general solver and homogeneous matrices: nothing is shared with the
package.
"""

import numpy as np
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

AZIMUTH = np.radians([0.0, 120.0, 240.0])


def forward(theta, legs, guess):
    """Position (3,) of one pose: each leg's end lies at distance L3 from joint 3, which lies in the leg's plane."""

    def closures(position):
        result = []
        for leg in range(3):
            dtheta, arm, offset, forearm, radial = legs[leg]
            angle = theta[leg] + dtheta
            c, s = np.cos(AZIMUTH[leg]), np.sin(AZIMUTH[leg])
            along, across = position[0] * c + position[1] * s + radial, -position[0] * s + position[1] * c
            # joint 3 lies on the line from the elbow to the end's projection on the leg's plane, L2 from the elbow
            elbow = arm * np.array([np.cos(angle), np.sin(angle)])
            end = np.array([along, position[2]])
            direction = (end - elbow) / np.linalg.norm(end - elbow)
            knee = elbow + offset * direction
            result.append(np.sqrt(np.sum((end - knee) ** 2) + across**2) - forearm)
        return result

    return fsolve(closures, guess, xtol=1e-12)


def transform(rotation=None, shift=(0.0, 0.0, 0.0)):
    """Homogeneous matrix."""
    result = np.eye(4)
    if rotation is not None:
        result[:3, :3] = Rotation.from_rotvec(rotation).as_matrix()
    result[:3, 3] = shift
    return result


def chain(leg, lengths, deviations, angles):
    """Platform pose (4, 4) of one leg from its five joint angles; lengths R, L1, L2, L3, r; deviations (8, 6)."""
    base, arm, offset, forearm, platform = lengths
    displaced = [transform(d[3:], d[:3]) for d in deviations]
    matrix = transform((0.0, 0.0, AZIMUTH[leg])) @ displaced[0] @ transform(shift=(base, 0.0, 0.0)) @ displaced[1]
    matrix = matrix @ displaced[2] @ transform((0.0, -angles[0], 0.0)) @ transform(shift=(arm, 0.0, 0.0))
    matrix = matrix @ displaced[3] @ transform((0.0, -angles[1], 0.0)) @ transform(shift=(offset, 0.0, 0.0))
    matrix = matrix @ displaced[4] @ transform((0.0, 0.0, angles[2])) @ transform(shift=(forearm, 0.0, 0.0))
    matrix = matrix @ displaced[5] @ transform((0.0, 0.0, angles[3])) @ displaced[6]
    matrix = matrix @ transform((0.0, -angles[4], 0.0)) @ transform(shift=(-platform, 0.0, 0.0))
    return matrix @ displaced[7] @ transform((0.0, 0.0, -AZIMUTH[leg]))


def close(theta, lengths, deviations, guess):
    """Platform pose (4, 4) of the closed robot: fsolve on 18 equations in 12 passive angles and the platform's pose.

    deviations (3 legs, 8, 6).
    """

    def equations(unknown):
        pose = transform(unknown[12:15] / 500.0, unknown[15:])
        rows = []
        for leg in range(3):
            angles = [theta[leg], *unknown[4 * leg : 4 * leg + 4]]
            difference = np.linalg.inv(pose) @ chain(leg, lengths[leg], deviations[leg], angles)
            rows += [*difference[:3, 3], *(500.0 * Rotation.from_matrix(difference[:3, :3]).as_rotvec())]
        return rows

    solution = fsolve(equations, guess, xtol=1e-12)
    assert np.abs(equations(solution)).max() < 1e-8
    return transform(solution[12:15] / 500.0, solution[15:])
