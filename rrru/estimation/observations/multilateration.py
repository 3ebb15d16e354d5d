"""Multilateration: positions from their distances to anchors, row by row, by least squares or Cauchy's robust loss.

    minimise over p   sum_j rho(l_j - sqrt(|p - a_j|^2 + h_j^2)),    rho(r) = r^2  or  c^2 log(1 + r^2 / c^2)

Position p and anchors a_j have d = 2 or 3 coordinates. h_j is what the distance to anchor j has in addition,
perpendicular to these: the height of the anchor over the plane of p where d is 2. A search starts at the solution of
the linear equations 2 a . p - |p|^2 = |a|^2 - l^2 + h^2 and takes damped Newton steps (Levenberg-Marquardt).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rrru.arrays import BoolArray, FloatArray

# smallest distance in mm: a position at an anchor has no direction from it
MIN_DISTANCE_MM = 1e-9
# a row's search ends with a Newton step no longer than this: the next would be far below what any reading resolves
_STEP_TOLERANCE_MM, _MAX_STEPS = 1e-6, 60
# damping after a first step that raises the loss, and smallest damping, in units of the row's curvature
_FIRST_DAMPING, _MIN_DAMPING = 1e-3, 1e-12
# weight in the linear solution of a reading that is not used: it chooses where the others have two solutions
_UNUSED_WEIGHT = 1e-3
# anchors whose smallest singular value is a smaller share of the next are nearly in a plane (or on a line, for d = 2):
# both sides of it are searched
_FLAT_SPREAD = 0.2


def row_loss(residual: FloatArray, weight: FloatArray, cauchy_mm: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Loss (m,) in mm^2 of rows of residuals r (m, k) in mm, and by reading rho'(r) / (2 r) and rho''(r) / 2, (m, k).

    weight (m, k): of the readings; cauchy_mm: the constant c, inf for least squares. Beyond c the second derivative
    would be negative: it counts as 0.
    """
    square = weight * residual**2
    if np.isinf(cauchy_mm):
        return square.sum(axis=-1), weight, weight
    relative = square / cauchy_mm**2
    slope = weight / (1.0 + relative)
    curvature = slope * np.maximum(1.0 - relative, 0.0) / (1.0 + relative)
    return cauchy_mm**2 * np.log1p(relative).sum(axis=-1), slope, curvature


@dataclass(frozen=True, eq=False)
class Multilateration:
    """Distances of N positions to n anchors.

    anchors (n, d), heights_mm (n,): a_j and h_j in mm; lengths (N, n): measured distances in mm; used (N, n): which of
    these count.
    """

    anchors: FloatArray
    heights_mm: FloatArray
    lengths: FloatArray
    used: BoolArray

    def least_squares(self) -> FloatArray:
        """Positions (N, d) in mm of least squares.

        Anchors near a plane hardly determine on which side of it a position is. Both are tried; of two equally good
        ones the side to which the plane's normal points with a positive last coordinate is chosen.
        """
        weight, solutions = self.used.astype(float), self._linear_solutions()
        found = [self._minima(start, weight, np.inf) for start in solutions]
        if len(found) == 1:
            return found[0][0]
        best = np.array([loss for _, loss in found]).argmin(axis=0)
        return np.asarray(np.array([places for places, _ in found])[best, np.arange(len(self.lengths))])

    def least_cauchy(self, cauchy_mm: float) -> FloatArray:
        """Positions (N, d) in mm of least Cauchy loss with the constant cauchy_mm."""
        places, loss = self._minima(self.least_squares(), self.used.astype(float), cauchy_mm)
        # a row with a residual above the constant has at least this loss: rows below it need no other start
        poor = np.flatnonzero(loss > cauchy_mm**2 * np.log(2.0))
        if not len(poor):
            return places
        count = self.used.shape[1]
        # each of these rows is started without each of its readings in turn
        row, bad = np.tile(poor, count), np.repeat(np.arange(count), len(poor))
        repeated = Multilateration(self.anchors, self.heights_mm, self.lengths[row], self.used[row])
        without = self.used[row] & (np.arange(count) != bad[:, None])
        starts = Multilateration(self.anchors, self.heights_mm, self.lengths[row], without).least_squares()
        found, losses = repeated._minima(starts, self.used[row].astype(float), cauchy_mm)
        best = losses.reshape(count, -1).argmin(axis=0)
        better = losses.reshape(count, -1)[best, np.arange(len(poor))] < loss[poor]
        places[poor[better]] = found.reshape(count, len(poor), -1)[best, np.arange(len(poor))][better]
        return places

    def _distances(self, places: FloatArray, rows: slice | npt.NDArray[np.int_]) -> tuple[FloatArray, FloatArray]:
        """Residuals (m, n) in mm of some rows at positions (m, d), and derivatives (m, n, d) of their distances."""
        ways = places[:, None] - self.anchors
        distance = np.maximum(np.sqrt((ways**2).sum(axis=-1) + self.heights_mm**2), MIN_DISTANCE_MM)
        return self.lengths[rows] - distance, ways / distance[..., None]

    def _minima(self, places: FloatArray, weight: FloatArray, cauchy_mm: float) -> tuple[FloatArray, FloatArray]:
        """Positions (N, d) and loss (N,) of the local minima near positions (N, d); weight (N, n): of the readings."""
        going, damping, identity = np.arange(len(places)), np.full(len(places), _MIN_DAMPING), np.eye(places.shape[1])
        loss, *model = self._row_model(places, going, weight, cauchy_mm)
        places = places.copy()
        for _ in range(_MAX_STEPS):
            gradient, hessian, curvature = model
            step = np.linalg.solve(hessian + (damping * curvature)[:, None, None] * identity, gradient[..., None])[
                ..., 0
            ]
            trial = places[going] + step
            new_loss, *new = self._row_model(trial, going, weight[going], cauchy_mm)
            better = new_loss <= loss[going]
            places[going[better]], loss[going[better]] = trial[better], new_loss[better]
            on = np.flatnonzero((np.abs(step) > _STEP_TOLERANCE_MM).any(axis=1))
            if not len(on):
                break
            damping = np.where(better, damping * 0.1, np.maximum(damping * 10.0, _FIRST_DAMPING))[on]
            damping = np.maximum(damping, _MIN_DAMPING)
            if better.all():
                model = [one[on] for one in new]
            else:
                model = [
                    np.where(better.reshape(-1, *[1] * (one.ndim - 1)), one, old)[on]
                    for one, old in zip(new, model, strict=True)
                ]
            going = going[on]
        return places, loss

    def _row_model(
        self, places: FloatArray, rows: npt.NDArray[np.int_], weight: FloatArray, cauchy_mm: float
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Losses (m,) of rows, and of half of them negative gradient (m, d), Hessian (m, d, d) and its scale (m,)."""
        residual, unit = self._distances(places, rows)
        loss, slope, curvature = row_loss(residual, weight, cauchy_mm)
        pull = slope * residual
        # the Hessian of the distance l - r is (1 - u u') / (l - r)
        bent = pull / (self.lengths[rows] - residual)
        hessian = unit.mT @ (unit * (curvature + bent)[..., None])
        hessian -= bent.sum(axis=1)[:, None, None] * np.eye(places.shape[1])
        return loss, (pull[:, None] @ unit)[:, 0], hessian, np.maximum(slope.sum(axis=1), 1e-12)

    def _linear_solutions(self) -> list[FloatArray]:
        """Positions (N, d) that solve the linear equations: one each, of flat anchors two that mirror each other.

        For flat anchors |p|^2 determines the distance of a position from their plane.
        """
        middle = self.anchors.mean(axis=0)
        _, spread, axes = np.linalg.svd(self.anchors - middle)
        axes[-1] *= 1.0 if axes[-1, -1] >= 0.0 else -1.0
        size = max(float(spread[0]), MIN_DISTANCE_MM)
        anchors, flat = (self.anchors - middle) @ axes.T / size, int(spread[-1] < _FLAT_SPREAD * spread[-2])
        columns = np.column_stack([2.0 * anchors[:, : anchors.shape[1] - flat], -np.ones(len(anchors))])
        # rows that use the same readings share a pseudo-inverse; their numbers are exact for up to 53 anchors,
        # with more of them only the start of a search may be off
        _, first, pattern = np.unique(
            self.used @ 2.0 ** np.arange(len(anchors)), return_index=True, return_inverse=True
        )
        weight = np.where(self.used[first], 1.0, _UNUSED_WEIGHT)[..., None]
        solution = np.linalg.pinv(weight * columns) * weight.mT
        target = (anchors**2).sum(axis=1) - (self.lengths**2 - self.heights_mm**2) / size**2
        found = np.einsum("icn,in->ic", solution[pattern], target)
        places = [found[:, :-1]]
        if flat:
            off = np.sqrt(np.maximum(found[:, -1] - (found[:, :-1] ** 2).sum(axis=1), 0.0))
            places = [np.column_stack([found[:, :-1], side * off]) for side in (1.0, -1.0)]
        return [middle + size * one @ axes for one in places]
