"""The 3-RRRU as three five-joint chains closed in space, derived apart from the package's legs of screws.

Leg i from the base's centre to the platform's, in the leg's frame (x radial, y tangential, z down), with a small rigid
displacement D after every fixed part:

    T_i = Rz(phi) D0 Tx(R) D1 D2 Ry(-q1) Tx(L1) D3 Ry(-q2) Tx(L2) D4 Rz(q3) Tx(L3) D5 Rz(q4) D6 Ry(-q5) Tx(-r) D7
          Rz(-phi)

T_1 = T_2 = T_3 gives 12 equations for the 12 passive angles, solved by Newton; the platform may turn. Nothing here uses
eq. (8), which the calibration solves. Lengths in mm, angles in rad.
"""

import numpy as np
from scipy.spatial.transform import Rotation

AZIMUTH = np.radians([0.0, 120.0, 240.0])
# of the displacements D0 to D7 of a leg, as the package calls them
PLACES = ("root", "foot", "drive", "elbow", "knee", "wrist", "cross", "platform")
LENGTHS = np.tile([400.0, 400.0, 100.0, 800.0, 400.0], (3, 1))
# the rotation part of a closure counts as the distance that it makes at this arm
_CHARACTERISTIC_LENGTH_MM = 500.0


def moves(rotation_vectors, shifts):
    """Homogeneous matrices (n, 4, 4) of rotation vectors and shifts, (n, 3) or (3,)."""
    rotation_vectors, shifts = np.broadcast_arrays(np.atleast_2d(rotation_vectors), np.atleast_2d(shifts))
    result = np.tile(np.eye(4), (len(shifts), 1, 1))
    result[:, :3, :3] = Rotation.from_rotvec(rotation_vectors).as_matrix()
    result[:, :3, 3] = shifts
    return result


def _turn(axis, angles):
    """Rotations (n, 4, 4) about one axis by angles (n,) or a number."""
    return moves(np.multiply.outer(np.atleast_1d(angles), axis), np.zeros(3))


def _along(x):
    """Shift (1, 4, 4) along x."""
    return moves(np.zeros(3), [x, 0.0, 0.0])


def chain(azimuth, lengths, displacements, angles):
    """Platform poses (n, 4, 4) of one leg, and the axes and places (n, 5, 3) of its joints.

    lengths (5,): R, L1, L2, L3, r; displacements (n or 1, 8, 6): shift and rotation vector; angles (n, 5).
    """
    base, arm, offset, forearm, platform = lengths
    d = [moves(displacements[:, k, 3:], displacements[:, k, :3]) for k in range(len(PLACES))]
    y, z = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    before = [
        _turn(z, azimuth) @ d[0] @ _along(base) @ d[1] @ d[2],
        _along(arm) @ d[3],
        _along(offset) @ d[4],
        _along(forearm) @ d[5],
        d[6],
    ]
    pose, axes, places = np.eye(4), [], []
    for joint, (fixed, axis) in enumerate(zip(before, (y, y, z, z, y), strict=True)):
        pose = pose @ fixed
        axes.append(np.broadcast_to(pose[:, :3, :3] @ axis, (len(angles), 3)))
        places.append(np.broadcast_to(pose[:, :3, 3], (len(angles), 3)))
        pose = pose @ _turn(axis, angles[:, joint])
    pose = pose @ _along(-platform) @ d[7] @ _turn(z, -azimuth)
    return pose, np.stack(axes, axis=1), np.stack(places, axis=1)


def closure(lengths, displacements, theta, passive, azimuth=AZIMUTH):
    """What the closure lacks (n, 12) in mm, its Jacobian (n, 12, 12) by the passive angles, and leg 1's pose.

    lengths (3, 5); displacements (n or 1, 3 legs, 8, 6); theta (n, 3); passive (n, 3, 4).
    """
    n = len(theta)
    residual, jacobian, poses = np.zeros((n, 12)), np.zeros((n, 12, 12)), []
    for leg in range(3):
        angles = np.concatenate([theta[:, leg, None], passive[:, leg]], axis=1)
        pose, axes, places = chain(azimuth[leg], lengths[leg], displacements[:, leg], angles)
        poses.append(pose)
        for joint in range(1, 5):
            moved = np.cross(axes[:, joint], pose[:, :3, 3] - places[:, joint])
            column = np.concatenate([moved, _CHARACTERISTIC_LENGTH_MM * axes[:, joint]], axis=1)
            # the first leg closes both loops, the others one each
            for loop in (0, 1):
                if leg in (0, loop + 1):
                    sign = 1.0 if leg == 0 else -1.0
                    jacobian[:, 6 * loop : 6 * loop + 6, 4 * leg + joint - 1] = sign * column
    for loop in (0, 1):
        apart = poses[0][:, :3, :3] @ poses[loop + 1][:, :3, :3].transpose(0, 2, 1)
        turned = 0.5 * np.stack([apart[:, i, j] - apart[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1)
        residual[:, 6 * loop : 6 * loop + 3] = poses[0][:, :3, 3] - poses[loop + 1][:, :3, 3]
        residual[:, 6 * loop + 3 : 6 * loop + 6] = _CHARACTERISTIC_LENGTH_MM * turned
    return residual, jacobian, poses[0]


def close(lengths, displacements, theta, passive, azimuth=AZIMUTH):
    """Platform positions (n, 3) and turns (n, 3, 3) at drive angles (n, 3), by Newton from passive angles (n, 3, 4)."""
    displacements = np.reshape(displacements, (-1, 3, len(PLACES), 6))
    passive = np.array(passive, dtype=float)
    for _ in range(20):
        residual, jacobian, _ = closure(lengths, displacements, theta, passive, azimuth)
        passive -= np.linalg.solve(jacobian, residual[:, :, None])[:, :, 0].reshape(passive.shape)
    residual, _, pose = closure(lengths, displacements, theta, passive, azimuth)
    assert np.abs(residual).max() < 1e-9
    return pose[:, :3, 3], pose[:, :3, :3]


def closure_determinant(theta, passive):
    """Determinant (n,) of the nominal robot's Jacobian (12, 12); lengths count in units of 500 mm."""
    residual, jacobian, _ = closure(LENGTHS, np.zeros((1, 3, len(PLACES), 6)), theta, passive)
    assert np.abs(residual).max() < 1e-6
    return np.linalg.det(jacobian / _CHARACTERISTIC_LENGTH_MM)
