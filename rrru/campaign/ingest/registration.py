"""Rigid registration: the six numbers that turn an instrument's frame into the robot's frame. Lengths in mm."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rrru.errors import FitError
from rrru.kinematics.legs import rigid_motions

# ASSUME points closer to one line than this share of their spread along it leave the turn about that line open to the
# robot's own errors.
_LEAST_WIDTH = 0.05


@dataclass(frozen=True)
class Registration:
    """Rigid motion: robot = rotation (3, 3) @ instrument + translation (3,), and its residuals at `points` points.

    placed_mm (n, 3): the measured positions in the robot's frame; off_mm (n,): how far these are from the commanded.
    """

    rotation: np.ndarray
    translation: np.ndarray
    rms_mm: float
    max_mm: float
    points: int
    placed_mm: np.ndarray
    off_mm: np.ndarray

    @cached_property
    def covariance(self) -> np.ndarray:
        """Covariance (6, 6) of the translation in mm and the rotation vector in rad.

        It holds for residuals that are random and of one size at all points; NaN for three points (no freedom).
        """
        return _covariance(self.placed_mm, self.off_mm, self.rotation, self.translation)

    @property
    def numbers(self) -> np.ndarray:
        """Translation in mm, and rotation vector in rad, (6,)."""
        from scipy.spatial.transform import Rotation

        return np.concatenate([self.translation, Rotation.from_matrix(self.rotation).as_rotvec()])

    def apply(self, position_mm: npt.ArrayLike) -> np.ndarray:
        """Positions (n, 3) in the robot's frame, mm, of positions (n, 3) in the instrument's frame."""
        moved: np.ndarray = np.asarray(position_mm, dtype=float) @ self.rotation.T + self.translation
        return moved


def register(measured_mm: npt.ArrayLike, command_mm: npt.ArrayLike) -> Registration:
    """Registration that best maps measured (n, 3) to commanded positions (n, 3), both in mm (least squares; Kabsch's
    solution).

    The commanded positions replace the true ones, which they only approximate. The registration therefore absorbs every
    part of the robot's own errors that is a rigid motion. A frame error of the robot's base is not identifiable from
    positions registered this way; to identify it, give points measured on the base itself.

    Raises FitError for fewer than three points and for points on one line, and ValueError for arguments of the wrong
    shape.
    """
    from scipy.spatial.transform import Rotation

    measured, command = np.asarray(measured_mm, dtype=float), np.asarray(command_mm, dtype=float)
    if measured.shape != command.shape or measured.ndim != 2 or measured.shape[1] != 3:
        raise ValueError(f"expected two arrays (n, 3), got {measured.shape} and {command.shape}")
    _require_spread("commanded", command)
    _require_spread("measured", measured)
    middle_measured, middle_command = measured.mean(axis=0), command.mean(axis=0)
    best, _ = Rotation.align_vectors(command - middle_command, measured - middle_measured)
    rotation = best.as_matrix()
    translation = middle_command - rotation @ middle_measured
    placed = measured @ rotation.T + translation
    off = np.linalg.norm(placed - command, axis=1)
    sizes = float(np.sqrt((off**2).mean())), float(off.max()), len(command)
    return Registration(rotation, translation, *sizes, placed, off)


def _covariance(placed: np.ndarray, off: np.ndarray, rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    """Covariance (6, 6) of translation and rotation vector from points (n, 3) and residual distances (n,), mm, rad.

    A small motion (s, w) in the robot's frame moves a point p by s + w x p; least squares has the covariance
    v (J^T J)^-1 of (s, w) with the variance v of the residuals (3 n - 6 degrees of freedom).
    """
    from scipy.spatial.transform import Rotation

    spare = 3 * len(placed) - 6
    columns = rigid_motions(placed).reshape(-1, 6)
    variance = (off**2).sum() / spare if spare else np.nan
    # of (s, w) to the translation t + s + w x t and the rotation vector of exp(w) R, by central differences
    step, slope = 1e-6, np.eye(6)
    slope[:3, 3:] = np.cross(np.eye(3), translation).T
    around = [
        [(Rotation.from_rotvec(sign * step * axis) * Rotation.from_matrix(rotation)).as_rotvec() for axis in np.eye(3)]
        for sign in (1.0, -1.0)
    ]
    slope[3:, 3:] = (np.array(around[0]) - np.array(around[1])).T / (2.0 * step)
    return variance * slope @ np.linalg.inv(columns.T @ columns) @ slope.T


def _require_spread(name: str, position: np.ndarray) -> None:
    """Raise FitError unless the points (n, 3) span a plane well enough."""
    count, remaining, distinct = len(position), position, 0
    while distinct < 3 and len(remaining):
        remaining, distinct = remaining[(remaining != remaining[0]).any(axis=1)], distinct + 1
    if distinct < 3:
        raise FitError(f"{distinct} different {name} positions; allowed: at least 3, not on one line")
    along, off, _ = np.linalg.svd(position - position.mean(axis=0), compute_uv=False) / np.sqrt(count)
    if off < _LEAST_WIDTH * along:
        line = f"{off:.3f} mm (rms) off the line that they spread along by {along:.3f} mm (rms)"
        allowed = f"at least 3 points, at least {_LEAST_WIDTH * along:.3f} mm (rms) off every line"
        raise FitError(f"{count} {name} positions on one line: {line}; allowed: {allowed}")
