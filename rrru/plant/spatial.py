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

from rrru.effects.effect import PLACES

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
    """Solved points: platform centre (n, 3), platform rotation vector (n, 3), closure residual (n,) in mm, converged
    (n,).
    """

    position_mm: np.ndarray
    rotation_rad: np.ndarray
    residual_mm: np.ndarray
    converged: np.ndarray


@dataclass(frozen=True)
class SpatialGeometry:
    """Azimuths (3,), lengths (3, 5) = R, L1, L2, L3, r per leg, or (n, 3, 5) where they change from point to point, and
    displacements.

    axis_deviations: (3 legs, 6 PLACES, 6) = shift in mm, rotation vector in rad, in the leg's frame at that place.
    """

    azimuth_rad: np.ndarray
    lengths_mm: np.ndarray
    axis_deviations: np.ndarray

    def solve(self, theta_rad, passive_guess_rad, joint_shift_mm=None):
        """Close the chains at drive angles (n, 3).

        passive_guess_rad: (n, 3, 4) of the ideal robot; joint_shift_mm: (n, 3, 3), displacement of the platform's joint
        centre against the forearm, robot frame. Points are solved in their order, each warm-started with the correction
        that the last one needed.
        """
        n = len(theta_rad)
        shift = np.zeros((n, 3, 3)) if joint_shift_mm is None else np.broadcast_to(joint_shift_mm, (n, 3, 3))
        rotations = (
            Rotation.from_rotvec(self.axis_deviations[..., 3:].reshape(-1, 3)).as_matrix().reshape(3, len(PLACES), 3, 3)
        )
        position, turned, residual = _solve_points(
            np.ascontiguousarray(self.azimuth_rad, dtype=float),
            np.ascontiguousarray(np.broadcast_to(self.lengths_mm, (n, 3, 5)), dtype=float),
            np.ascontiguousarray(self.axis_deviations[..., :3], dtype=float),
            np.ascontiguousarray(rotations),
            np.ascontiguousarray(theta_rad, dtype=float),
            np.ascontiguousarray(passive_guess_rad, dtype=float).reshape(n, 12),
            np.ascontiguousarray(shift, dtype=float),
        )
        return SpatialSolution(position, turned, residual, residual < 1e3 * _TOLERANCE_MM)

    def solve_under(self, theta_rad, passive_guess_rad, change):
        """Close the chains as `solve` does under what effects contribute; positions are in the tracker's frame.

        Displacements of effects and the geometry's own at one place are added, which holds to first order in their
        angles.
        """
        changed = replace(
            self,
            lengths_mm=self.lengths_mm + change.length_mm,
            axis_deviations=self.axis_deviations + change.displacement,
        )
        solution = changed.solve(theta_rad + change.drive, passive_guess_rad, change.joint_mm)
        return (
            solution
            if not np.ndim(change.frame)
            else replace(solution, position_mm=into_frame(solution.position_mm, change.frame))
        )

    def closure_determinant(self, theta_rad, passive_rad):
        """Determinant (n,) of the 12 x 12 closure Jacobian at drive angles (n, 3) and passive angles (n, 3, 4), lengths
        in units of 500 mm.
        """
        rotations = (
            Rotation.from_rotvec(self.axis_deviations[..., 3:].reshape(-1, 3)).as_matrix().reshape(3, len(PLACES), 3, 3)
        )
        jacobian, residual = np.empty((12, 12)), np.empty(12)
        result = []
        lengths_mm = np.broadcast_to(self.lengths_mm, (len(theta_rad), 3, 5))
        for theta, passive, lengths in zip(theta_rad, passive_rad, lengths_mm, strict=True):
            _closure(
                np.asarray(self.azimuth_rad, dtype=float),
                np.ascontiguousarray(lengths, dtype=float),
                np.ascontiguousarray(self.axis_deviations[..., :3], dtype=float),
                np.ascontiguousarray(rotations),
                np.ascontiguousarray(theta, dtype=float),
                np.ascontiguousarray(passive, dtype=float).reshape(12),
                np.zeros((3, 3)),
                jacobian,
                residual,
            )
            result.append(np.linalg.det(jacobian / _ARM_MM))
        return np.array(result)


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
    """Go `length` along the local x, then the displacement: shift (3,) and rotation (3, 3) in the local frame, in
    place.
    """
    for k in range(3):
        point[k] += matrix[k, 0] * (length + shift[0]) + matrix[k, 1] * shift[1] + matrix[k, 2] * shift[2]
    matrix[:] = matrix @ rotation


@_compiled
def _chain(azimuth, lengths, shifts, rotations, angles, joint_shift, axes, points, matrix, point):
    """One leg: joint axes (5, 3) and points (5, 3) on them, platform rotation (3, 3) and position (3,), all written in
    place.
    """
    matrix[:] = np.eye(3)
    point[:] = 0.0
    _turn_z(matrix, azimuth)
    _displace(matrix, point, lengths[0], shifts[0], rotations[0])
    for joint in range(5):
        axes[joint] = -matrix[:, 1] if joint in (0, 1, 4) else matrix[:, 2]
        points[joint] = point
        if joint in (0, 1, 4):
            _turn_y(matrix, angles[joint])
        else:
            _turn_z(matrix, angles[joint])
        if joint < 3:
            _displace(matrix, point, lengths[joint + 1], shifts[joint + 1], rotations[joint + 1])
        elif joint == 3:
            point += joint_shift
            _displace(matrix, point, 0.0, shifts[4], rotations[4])
        else:
            _displace(matrix, point, -lengths[4], shifts[5], rotations[5])
    _turn_z(matrix, -azimuth)


@_compiled
def _closure(azimuth, lengths, shifts, rotations, theta, passive, joint_shift, jacobian, residual):
    """Closure residual (12,) and its Jacobian (12, 12) by the passive angles, in place; returns the platform pose of
    leg 1.
    """
    axes, points = np.empty((5, 3)), np.empty((5, 3))
    first_matrix, first_point = np.empty((3, 3)), np.empty(3)
    matrix, point, angles = np.empty((3, 3)), np.empty(3), np.empty(5)
    jacobian[:] = 0.0
    for leg in range(3):
        angles[0] = theta[leg]
        angles[1:] = passive[4 * leg : 4 * leg + 4]
        _chain(
            azimuth[leg],
            lengths[leg],
            shifts[leg],
            rotations[leg],
            angles,
            joint_shift[leg],
            axes,
            points,
            matrix,
            point,
        )
        if leg == 0:
            first_matrix[:], first_point[:] = matrix, point
        else:
            row = 6 * (leg - 1)
            difference = first_matrix @ matrix.T
            for k in range(3):
                residual[row + k] = first_point[k] - point[k]
            residual[row + 3] = 0.5 * _ARM_MM * (difference[2, 1] - difference[1, 2])
            residual[row + 4] = 0.5 * _ARM_MM * (difference[0, 2] - difference[2, 0])
            residual[row + 5] = 0.5 * _ARM_MM * (difference[1, 0] - difference[0, 1])
        for joint in range(1, 5):
            lever = point - points[joint]
            column = 4 * leg + joint - 1
            axis = axes[joint]
            moved = np.cross(axis, lever)
            for loop in range(2):
                if leg == 0 or leg == loop + 1:
                    sign = 1.0 if leg == 0 else -1.0
                    for k in range(3):
                        jacobian[6 * loop + k, column] = sign * moved[k]
                        jacobian[6 * loop + 3 + k, column] = sign * _ARM_MM * axis[k]
    return first_matrix, first_point


@_compiled
def _solve_points(azimuth, lengths, shifts, rotations, theta, guess, joint_shift):
    """Newton on the 12 closure equations, point after point; see SpatialGeometry.solve."""
    n = theta.shape[0]
    position, turned, residuals = np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.full(n, np.inf)
    jacobian, residual, correction = np.empty((12, 12)), np.empty(12), np.zeros(12)
    for j in range(n):
        if not (np.isfinite(theta[j]).all() and np.isfinite(guess[j]).all()):
            continue
        passive = guess[j] + correction
        for _ in range(_MOST_STEPS):
            matrix, point = _closure(
                azimuth, lengths[j], shifts, rotations, theta[j], passive, joint_shift[j], jacobian, residual
            )
            largest = np.abs(residual).max()
            residuals[j] = largest
            if not largest > _TOLERANCE_MM:
                break
            if np.linalg.det(jacobian / _ARM_MM) == 0.0:
                break
            step = np.linalg.solve(jacobian, residual)
            longest = np.abs(step).max()
            if longest > 0.2:
                step *= 0.2 / longest
            passive = passive - step
        if residuals[j] < 1e3 * _TOLERANCE_MM:
            correction = passive - guess[j]
            position[j] = point
            turned[j, 0] = 0.5 * (matrix[2, 1] - matrix[1, 2])
            turned[j, 1] = 0.5 * (matrix[0, 2] - matrix[2, 0])
            turned[j, 2] = 0.5 * (matrix[1, 0] - matrix[0, 1])
    return position, turned, residuals
