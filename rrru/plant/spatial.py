"""The real side's geometry: three five-joint chains closed in space, every axis and length with an error of its own.

Leg i, from the base's centre to the platform's, in the leg's frame (x radial, y tangential, z down):

    T_i = Rz(phi) Tx(R) D0 Ry(-q1) Tx(L1) D1 Ry(-q2) Tx(L2) D2 Rz(q3) Tx(L3) D3 Rz(q4) D4 Ry(-q5) Tx(-r) D5 Rz(-phi)

with a small rigid displacement D after every fixed part. T_1 = T_2 = T_3 gives 12 equations for the 12 passive angles;
the platform may turn. Nothing here uses eq. (8), which the calibration solves. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, replace

import numba
import numpy as np
from scipy.spatial.transform import Rotation

from rrru.effects.protocol import PLACES

# The rotation part of a closure residual counts as the distance it makes at this arm.
_ARM_MM = 500.0
_TOLERANCE_MM = 1e-10
_MOST_STEPS = 40

_compiled = numba.njit(cache=True, error_model="numpy")


def into_frame(position_mm, frame):
    """Positions (n, 3) carried by a frame (6,), shift in mm and rotation vector in rad, or by none, a number."""
    return position_mm @ Rotation.from_rotvec(frame[3:]).as_matrix().T + frame[:3] if np.ndim(frame) else position_mm


@dataclass(frozen=True)
class SpatialSolution:
    """Solved points: platform centres (n, 3), rotation vectors (n, 3), closure residuals (n,) in mm, converged (n,)."""

    position_mm: np.ndarray
    rotation_rad: np.ndarray
    residual_mm: np.ndarray
    converged: np.ndarray


@dataclass(frozen=True)
class SpatialGeometry:
    """Azimuths (3,), lengths (3, 5) = R, L1, L2, L3, r per leg, or (n, 3, 5) from point to point, and displacements.

    axis_deviations: (3 legs, 6 PLACES, 6) = shift in mm, rotation vector in rad, in the leg's frame at that place.
    """

    azimuth_rad: np.ndarray
    lengths_mm: np.ndarray
    axis_deviations: np.ndarray

    def solve(self, theta_rad, passive_guess_rad, joint_shift_mm=0.0):
        """Close the chains at drive angles (n, 3).

        passive_guess_rad: (n, 3, 4) of the ideal robot; joint_shift_mm: (n, 3, 3), displacement of the platform's joint
        centre against the forearm, robot frame. Points are solved in their order, each warm-started with the correction
        that the last one needed.
        """
        n = len(theta_rad)
        position, turned, residual = _solve_points(
            *(_array(part) for part in self.fixed_parts),
            _array(np.broadcast_to(self.lengths_mm, (n, 3, 5))),
            _array(theta_rad),
            _array(passive_guess_rad).reshape(n, 12),
            _array(np.broadcast_to(joint_shift_mm, (n, 3, 3))),
        )
        return SpatialSolution(position, turned, residual, residual < 1e3 * _TOLERANCE_MM)

    @property
    def fixed_parts(self):
        """What is the same at all points: azimuths (3,), shifts (3, 6, 3) in mm and rotations (3, 6, 3, 3)."""
        rotations = Rotation.from_rotvec(self.axis_deviations[..., 3:].reshape(-1, 3)).as_matrix()
        return self.azimuth_rad, self.axis_deviations[..., :3], rotations.reshape(3, len(PLACES), 3, 3)

    def solve_under(self, theta_rad, passive_guess_rad, change):
        """Close the chains as `solve` does under what effects contribute; positions are in the tracker's frame.

        Displacements of effects and the geometry's own at one place are added, which holds to first order in their
        angles.
        """
        deviations = self.axis_deviations + change.displacement
        changed = replace(self, lengths_mm=self.lengths_mm + change.length_mm, axis_deviations=deviations)
        solution = changed.solve(theta_rad + change.drive, passive_guess_rad, change.joint_mm)
        return replace(solution, position_mm=into_frame(solution.position_mm, change.frame))


def _array(values):
    """A writable copy, row by row in memory: one kind of array, so that the kernels are compiled once."""
    return np.array(values, dtype=float, order="C")


@_compiled
def _turn_y(matrix, angle):
    """Right-multiply (3, 3) by a rotation about -y, in place."""
    c, s = np.cos(angle), np.sin(angle)
    for k in range(3):
        x, z = matrix[k, 0], matrix[k, 2]
        matrix[k, 0] = c * x + s * z
        matrix[k, 2] = c * z - s * x


@_compiled
def _turn_z(matrix, angle):
    """Right-multiply (3, 3) by a rotation about z, in place."""
    c, s = np.cos(angle), np.sin(angle)
    for k in range(3):
        x, y = matrix[k, 0], matrix[k, 1]
        matrix[k, 0] = c * x + s * y
        matrix[k, 1] = c * y - s * x


@_compiled
def _displace(matrix, point, length, shift, rotation):
    """Go `length` along the local x, then by shift (3,) and rotation (3, 3) in the local frame, in place."""
    for k in range(3):
        x, y, z = matrix[k, 0], matrix[k, 1], matrix[k, 2]
        point[k] += x * (length + shift[0]) + y * shift[1] + z * shift[2]
    turned = matrix @ rotation
    for k in range(3):
        for j in range(3):
            matrix[k, j] = turned[k, j]


@_compiled
def _chain(azimuth, shifts, rotations, lengths, angles, joint_shift, axes, points, matrix, point):
    """One leg: joint axes (5, 3), points (5, 3) on them, platform rotation (3, 3) and position (3,), all in place."""
    for k in range(3):
        point[k] = 0.0
        for j in range(3):
            matrix[k, j] = 1.0 if k == j else 0.0
    _turn_z(matrix, azimuth)
    _displace(matrix, point, lengths[0], shifts[0], rotations[0])
    for joint in range(5):
        upright = joint in (2, 3)
        for k in range(3):
            axes[joint, k] = matrix[k, 2] if upright else -matrix[k, 1]
            points[joint, k] = point[k]
        if upright:
            _turn_z(matrix, angles[joint])
        else:
            _turn_y(matrix, angles[joint])
        if joint == 3:
            for k in range(3):
                point[k] += joint_shift[k]
        length = lengths[joint + 1] if joint < 3 else 0.0 if joint == 3 else -lengths[4]
        _displace(matrix, point, length, shifts[joint + 1], rotations[joint + 1])
    _turn_z(matrix, -azimuth)


@_compiled
def _closure(azimuth, shifts, rotations, lengths, theta, passive, joint_shift, jacobian, residual, matrices, positions):
    """Closure residual (12,), its Jacobian (12, 12) by the passive angles, and the legs' platform poses, in place."""
    axes, points, angles = np.empty((5, 3)), np.empty((5, 3)), np.empty(5)
    for row in range(12):
        for column in range(12):
            jacobian[row, column] = 0.0
    for leg in range(3):
        angles[0] = theta[leg]
        for joint in range(1, 5):
            angles[joint] = passive[4 * leg + joint - 1]
        matrix, point = matrices[leg], positions[leg]
        _chain(
            *(azimuth[leg], shifts[leg], rotations[leg], lengths[leg], angles, joint_shift[leg]),
            *(axes, points, matrix, point),
        )
        if leg > 0:
            row = 6 * (leg - 1)
            difference = matrices[0] @ matrix.T
            for k in range(3):
                residual[row + k] = positions[0, k] - point[k]
                i, j = (k + 2) % 3, (k + 1) % 3
                residual[row + 3 + k] = 0.5 * _ARM_MM * (difference[i, j] - difference[j, i])
        for joint in range(1, 5):
            _add_columns(leg, 4 * leg + joint - 1, axes[joint], points[joint], point, jacobian)


@_compiled
def _add_columns(leg, column, axis, through, point, jacobian):
    """Columns of the closure Jacobian by one passive angle: leg 1 closes both loops, legs 2 and 3 one each."""
    for loop in range(2):
        if leg == 0 or leg == loop + 1:
            sign = 1.0 if leg == 0 else -1.0
            for k in range(3):
                i, j = (k + 1) % 3, (k + 2) % 3
                moved = axis[i] * (point[j] - through[j]) - axis[j] * (point[i] - through[i])
                jacobian[6 * loop + k, column] = sign * moved
                jacobian[6 * loop + 3 + k, column] = sign * _ARM_MM * axis[k]


@_compiled
def _largest(values):
    """Largest magnitude of values (k,), NaN or inf where one is."""
    result = 0.0
    for value in values:
        if not abs(value) <= result:
            result = abs(value)
    return result


@_compiled
def _solve_points(azimuth, shifts, rotations, lengths, theta, guess, joint_shift):
    """Newton on the 12 closure equations, point after point; see SpatialGeometry.solve."""
    n = theta.shape[0]
    position, turned, residuals = np.empty((n, 3)), np.empty((n, 3)), np.empty(n)
    jacobian, residual, correction, passive = np.empty((12, 12)), np.empty(12), np.zeros(12), np.empty(12)
    matrices, centres = np.empty((3, 3, 3)), np.empty((3, 3))
    for j in range(n):
        residuals[j] = np.inf
        known = np.isfinite(_largest(theta[j])) and np.isfinite(_largest(guess[j]))
        for k in range(12):
            passive[k] = guess[j, k] + correction[k]
        for _ in range(_MOST_STEPS if known else 0):
            _closure(
                *(azimuth, shifts, rotations, lengths[j], theta[j], passive, joint_shift[j]),
                *(jacobian, residual, matrices, centres),
            )
            residuals[j] = _largest(residual)
            if not residuals[j] > _TOLERANCE_MM or np.linalg.det(jacobian / _ARM_MM) == 0.0:
                break
            step = np.linalg.solve(jacobian, residual)
            longest = _largest(step)
            for k in range(12):
                passive[k] -= step[k] * (0.2 / longest) if longest > 0.2 else step[k]
        solved = residuals[j] < 1e3 * _TOLERANCE_MM
        for k in range(12 if solved else 0):
            correction[k] = passive[k] - guess[j, k]
        for k in range(3):
            a, b = (k + 2) % 3, (k + 1) % 3
            position[j, k] = centres[0, k] if solved else np.nan
            turned[j, k] = 0.5 * (matrices[0, a, b] - matrices[0, b, a]) if solved else np.nan
    return position, turned, residuals
