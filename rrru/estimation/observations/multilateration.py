"""Places from their distances to anchors, row by row: the minima of least squares or of Cauchy's loss.

    minimise over p   sum_j rho(l_j - sqrt(|p - a_j|^2 + h_j^2)),    rho(r) = r^2  or  c^2 log(1 + r^2 / c^2)

A search starts at the linear solution, 2 a . p - |p|^2 = |a|^2 - l^2 + h^2, and takes damped Newton steps.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rrru.arrays import BoolArray, FloatArray

# a place at an anchor has no direction from it: the distance in mm that it is held off
MIN_DISTANCE_MM = 1e-9
# a row's search ends with a Newton step no longer than this: the next would be far below what any reading resolves
_STEP_TOLERANCE_MM, _MAX_STEPS = 1e-6, 60
# damping after a step that does not lower the loss, and at least, in units of the row's curvature
_FIRST_DAMPING, _MIN_DAMPING = 1e-3, 1e-12
# weight in the linear solution of a reading that is not used: it decides where the others have two solutions
_UNUSED_WEIGHT = 1e-3
# anchors whose least spread is a smaller share of the next are nearly in a plane: both sides of it are searched
_FLAT_SPREAD = 0.2


def row_loss(residual: FloatArray, weight: FloatArray, cauchy_mm: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Loss (m,) of rows with a residual (m, k), half its slope over the residual, and half its curvature (m, k).

    weight (m, k): of the readings; cauchy_mm: inf for least squares. The curvature of a reading that Cauchy's loss
    takes for a bad one would be negative, and counts as 0.
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
    """Distances lengths (N, n) in mm of N places to anchors (n, d) at heights_mm (n,), and which are used (N, n)."""

    anchors: FloatArray
    heights_mm: FloatArray
    lengths: FloatArray
    used: BoolArray

    def least_squares(self) -> FloatArray:
        """Places (N, d) of least squares.

        Anchors near a plane hardly determine on which side of it a place is: both are tried, the positive one first.
        """
        weight, solutions = self.used.astype(float), self._linear_solutions()
        found = [self._minima(start, weight, np.inf) for start in solutions]
        if len(found) == 1:
            return found[0][0]
        best = np.array([loss for _, loss in found]).argmin(axis=0)
        return np.asarray(np.array([places for places, _ in found])[best, np.arange(len(self.lengths))])

    def least_cauchy(self, cauchy_mm: float) -> FloatArray:
        """Places (N, d) of least Cauchy loss, which bends at cauchy_mm."""
        places, loss = self._minima(self.least_squares(), self.used.astype(float), cauchy_mm)
        # a minimum with a reading beyond the bend has at least this loss: rows below it need no other start
        poor = np.flatnonzero(loss > cauchy_mm**2 * np.log(2.0))
        if not len(poor):
            return places
        count = self.used.shape[1]
        # such a row without each reading in turn
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
        """Residuals (m, n) in mm of some rows at places (m, d), and slopes (m, n, d) of their distances."""
        ways = places[:, None] - self.anchors
        distance = np.maximum(np.sqrt((ways**2).sum(axis=-1) + self.heights_mm**2), MIN_DISTANCE_MM)
        return self.lengths[rows] - distance, ways / distance[..., None]

    def _minima(self, places: FloatArray, weight: FloatArray, cauchy_mm: float) -> tuple[FloatArray, FloatArray]:
        """Places (N, d) and loss (N,) of the local minima near places (N, d), with weights (N, n) of the readings."""
        going, damping, brake = np.arange(len(places)), np.full(len(places), _MIN_DAMPING), np.eye(places.shape[1])
        loss, *model = self._row_model(places, going, weight, cauchy_mm)
        places = places.copy()
        for _ in range(_MAX_STEPS):
            gradient, hessian, size = model
            step = np.linalg.solve(hessian + (damping * size)[:, None, None] * brake, gradient[..., None])[..., 0]
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
        """Losses (m,) of rows, and their halves' negative gradient (m, d), Hessian (m, d, d) and its size (m,)."""
        residual, unit = self._distances(places, rows)
        loss, slope, curvature = row_loss(residual, weight, cauchy_mm)
        pull = slope * residual
        # the Hessian of a distance l - r is (1 - u u') over it
        bent = pull / (self.lengths[rows] - residual)
        hessian = unit.mT @ (unit * (curvature + bent)[..., None])
        hessian -= bent.sum(axis=1)[:, None, None] * np.eye(places.shape[1])
        return loss, (pull[:, None] @ unit)[:, 0], hessian, np.maximum(slope.sum(axis=1), 1e-12)

    def _linear_solutions(self) -> list[FloatArray]:
        """Places (N, d) that solve the linear equations: one, of flat anchors two that mirror each other.

        For flat anchors |p|^2 determines the distance of a place from their plane.
        """
        middle = self.anchors.mean(axis=0)
        _, spread, axes = np.linalg.svd(self.anchors - middle)
        axes[-1] *= 1.0 if axes[-1, -1] >= 0.0 else -1.0
        size = max(float(spread[0]), MIN_DISTANCE_MM)
        anchors, flat = (self.anchors - middle) @ axes.T / size, int(spread[-1] < _FLAT_SPREAD * spread[-2])
        columns = np.column_stack([2.0 * anchors[:, : anchors.shape[1] - flat], -np.ones(len(anchors))])
        # rows that use the same readings share a solution
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
