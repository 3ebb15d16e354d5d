"""Identifiability of parameters at the points: rank, condition, standard errors, correlations, observability indices.

The Jacobian is scaled first: angle errors count as the distance they make at the end of the drive arm, so that all
parameters are lengths and singular values compare. Indices O1 to O5 as in Joubair and Bonev, "Comparison of the
efficiency of five observability indices for robot calibration", Mechanism and Machine Theory 70, 2013.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from rrru.kinematics.robot import Robot

# A direction whose singular value is smaller than this share of the largest is not identifiable: it would need
# millimetre data true to nanometres.
RANK_TOLERANCE = 1e-6


def parameter_scale(mechanism: Robot) -> np.ndarray:
    """Deviation (p,) that moves something by about 1 mm: 1 mm for lengths, 1 mm over the mechanism's arm for angles."""
    return np.array(
        [1.0 / mechanism.characteristic_length_mm if unit == "rad" else 1.0 for unit in mechanism.parameters.units]
    )


@dataclass(frozen=True)
class Identifiability:
    """Singular values (p,) in mm per mm, right singular vectors (p, p) row by row, rank and the scale they refer to."""

    names: tuple[str, ...]
    scale: np.ndarray
    singular_values: np.ndarray
    directions: np.ndarray
    points: int

    @property
    def rank(self) -> int:
        """Number of parameter combinations that the points determine."""
        return int((self.singular_values > RANK_TOLERANCE * self.singular_values[0]).sum())

    @property
    def condition(self) -> float:
        """Ratio of the largest to the smallest singular value; inf where the smallest is zero."""
        smallest = self.singular_values[-1]
        return float(self.singular_values[0] / smallest) if smallest > 0.0 else np.inf

    @property
    def unseen(self) -> np.ndarray:
        """Flags (p,) of parameters with a part in a direction that the points do not determine."""
        return np.asarray((self.directions[self.rank :] ** 2).sum(axis=0) > 1e-8)

    def covariance(self, noise_mm: float) -> np.ndarray:
        """Covariance (p, p) of the parameters for noise of `noise_mm` per axis; inf variance for unseen parameters."""
        seen = slice(0, self.rank)
        half = self.directions[seen].T * self.scale[:, None] / self.singular_values[seen]
        result = np.asarray(noise_mm**2 * half @ half.T)
        result[self.unseen, self.unseen] = np.inf
        return result

    def standard_errors(self, noise_mm: float) -> np.ndarray:
        """Standard errors (p,) for noise of `noise_mm` per axis; inf for unseen parameters."""
        return np.sqrt(np.diag(self.covariance(noise_mm)))

    def robust_standard_errors(self, jacobian: np.ndarray, influence: np.ndarray, curvature: np.ndarray) -> np.ndarray:
        """Standard errors (p,) of an M-estimate: A^-1 B A^-1, A = J' diag(curvature) J, B = J' diag(influence^2) J.

        jacobian: (n, 3, p); influence, curvature: (n, 3), first and second derivative of the loss by the residuals. Inf
        for unseen parameters.
        """
        seen = slice(0, self.rank)
        basis = self.directions[seen].T * self.scale[:, None]
        flat = jacobian.reshape(-1, len(self.scale)) @ basis
        bread = np.linalg.inv(flat.T @ (curvature.reshape(-1, 1) * flat))
        half = basis @ bread @ (flat * influence.reshape(-1, 1)).T
        result = np.asarray(np.sqrt((half**2).sum(axis=1)))
        result[self.unseen] = np.inf
        return result

    def correlations(self) -> np.ndarray:
        """Correlation matrix (p, p) of the estimates; NaN for unseen parameters."""
        covariance = self.covariance(1.0)
        deviation = np.sqrt(np.diag(covariance))
        with np.errstate(invalid="ignore"):
            return np.asarray(covariance / np.outer(deviation, deviation))

    def indices(self) -> dict[str, float]:
        """Observability indices O1 to O5 by name; 0 where a direction is not determined."""
        s = np.where(self.singular_values > RANK_TOLERANCE * self.singular_values[0], self.singular_values, 0.0)
        full = s[-1] > 0.0
        return {
            "O1": float(np.exp(np.log(s).mean()) / np.sqrt(self.points)) if full else 0.0,
            "O2": float(s[-1] / s[0]),
            "O3": float(s[-1]),
            "O4": float(s[-1] ** 2 / s[0]),
            "O5": float(1.0 / (1.0 / s).sum()) if full else 0.0,
        }


def analyse(mechanism: Robot, jacobian: np.ndarray) -> Identifiability:
    """Identifiability from the derivative (n, 3, p) of the positions with respect to the mechanism's parameters."""
    return analyse_columns(mechanism.parameters.names, parameter_scale(mechanism), jacobian)


def analyse_columns(names: Iterable[str], scale: np.ndarray, jacobian: np.ndarray) -> Identifiability:
    """Identifiability of named parameters with scales (p,) from the positions' derivative (n, 3, p) by them."""
    flat = np.asarray(jacobian).reshape(-1, len(scale)) * scale
    # with at least as many rows as parameters the thin decomposition holds all directions
    _, singular_values, directions = np.linalg.svd(flat, full_matrices=len(flat) < len(scale))
    padded = np.pad(singular_values, (0, len(scale) - len(singular_values)))
    # the sign of a singular vector is free: its largest entry is made positive
    largest = np.take_along_axis(directions, np.abs(directions).argmax(axis=1)[:, None], axis=1)
    return Identifiability(tuple(names), np.asarray(scale), padded, directions * np.sign(largest), len(jacobian))
