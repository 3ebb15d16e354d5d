"""Radial basis network that learns a correction of the position from measured points (paper B, 2.4). Lengths in mm.

A hidden neuron answers with a Gaussian of the distance from its centre, the output is a weighted sum and a threshold
(eqs. 14, 15, 17):

    h_k(x) = exp(-ln 2 (|x - c_k| / S)^2),    y(x) = sum_k h_k(x) w_k + theta

# ASSUME the spread S is the distance at which a neuron's answer has fallen to one half, as in MATLAB's `newrb`; the
scan has lost eq. (14). Centres are training points, taken one by one, each time the one that lowers the error most:
orthogonal least squares (Chen, Cowan and Grant, IEEE Transactions on Neural Networks 2, 1991). The weights are those of
least squares; eq. (16) goes down to the same minimum step by step. The paper's network answers with the corrected
position p - dp; here it answers with dp alone, so that narrow Gaussians need not add up to the straight line p (the
table ptt_training follows both).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.distance import cdist

from rrru.arrays import FloatArray, IntArray

# the least share of a neuron's answers that is more than rounding
ROUNDING = 1e-12


@dataclass(frozen=True)
class Network:
    """A trained network: centres (k, 3), weights (k, q), threshold (q,), spread in mm."""

    centres_mm: FloatArray
    weights: FloatArray
    threshold: FloatArray
    spread_mm: float

    def __call__(self, points_mm: npt.ArrayLike) -> FloatArray:
        """Answers (n, q) at points (n, 3)."""
        return answers(points_mm, self.centres_mm, self.spread_mm) @ self.weights + self.threshold


@dataclass(frozen=True)
class Growth:
    """Rows (k,) of the training points in the order taken, and mean squared errors (k + 1,), without a neuron first."""

    order: IntArray
    train_mse: FloatArray
    check_mse: FloatArray


def answers(points_mm: npt.ArrayLike, centres_mm: FloatArray, spread_mm: float) -> FloatArray:
    """Answers (n, k) of Gaussian neurons with centres (k, 3) at points (n, 3): one half at the spread's distance."""
    distance: FloatArray = cdist(points_mm, centres_mm, "sqeuclidean")
    return np.asarray(np.exp(-np.log(2.0) * distance / spread_mm**2))


def grow(
    points_mm: FloatArray,
    targets: FloatArray,
    spread_mm: float,
    neurons: int,
    new_share: float = ROUNDING,
    check_mm: FloatArray | None = None,
    check_targets: FloatArray | None = None,
) -> Growth:
    """Growth on training points (n, 3) and targets (n, q) up to a number of neurons, or until none adds anything.

    new_share: share of a neuron's squared answers that must be independent of the neurons before it. An almost
    dependent neuron gets a huge weight, which others cancel at the training points and nowhere else. check_mm (m, 3),
    check_targets (m, q): validation points, whose error is recorded as well; NaN without them.
    """
    if check_mm is None:
        check_mm, check_targets = points_mm[:0], targets[:0]
    every = answers(np.concatenate([points_mm, check_mm]), points_mm, spread_mm)
    return _grow(every, np.concatenate([targets, check_targets]), neurons, new_share)


def _grow(every: FloatArray, targets: FloatArray, neurons: int, new_share: float) -> Growth:
    """Growth from the answers (n + m, n) of neurons at the n training points, at these and at m validation points."""
    train = every.shape[1]
    least = new_share * (every[:train] ** 2).sum(axis=0)
    every = every - every[:train].mean(axis=0)
    residual = targets - targets[:train].mean(axis=0)
    basis = every[:train]
    # squared part of every neuron's answers that is orthogonal to the neurons taken
    new, taken = (basis**2).sum(axis=0), np.empty((neurons, len(every)))
    order: list[int] = []
    errors = [_split_mse(residual, train)]
    while len(order) < neurons:
        left = residual[:train].T @ basis
        gain = np.divide((left * left).sum(axis=0), new, out=np.full(train, -1.0), where=new > least)
        chosen = int(gain.argmax())
        if gain[chosen] < 0.0:
            break
        direction, before = every[:, chosen], taken[: len(order)]
        # twice, since rounding leaves a part behind
        for _ in range(2):
            direction = direction - (before[:, :train] @ direction[:train]) @ before
        direction /= np.sqrt(direction[:train] @ direction[:train])
        taken[len(order)] = direction
        new -= (direction[:train] @ basis) ** 2
        residual -= direction[:, None] * (direction[:train] @ residual[:train])
        least[chosen] = np.inf
        order.append(chosen)
        errors.append(_split_mse(residual, train))
    return Growth(np.array(order, dtype=int), *np.array(errors).T)


def fit(points_mm: FloatArray, targets: FloatArray, spread_mm: float, order: IntArray) -> Network:
    """Network with the rows `order` of points (n, 3) as centres and the weights that fit the targets (n, q) best."""
    centres = points_mm[order]
    design = answers(points_mm, centres, spread_mm)
    mean, level = design.mean(axis=0), targets.mean(axis=0)
    weights = np.linalg.lstsq(design - mean, targets - level, rcond=None)[0]
    return Network(centres, weights, level - mean @ weights, float(spread_mm))


def validation_mse(
    points_mm: FloatArray,
    targets: FloatArray,
    spread_mm: float,
    neurons: int,
    folds: IntArray,
    new_share: float = ROUNDING,
) -> FloatArray:
    """Cross-validated mean squared error (neurons + 1,) after every neuron.

    folds (n,): number of the fold in which each point is held out; a fold without further neurons keeps its last error.
    """
    every, result = answers(points_mm, points_mm, spread_mm), np.zeros(neurons + 1)
    for fold in np.unique(folds):
        known, out = np.flatnonzero(folds != fold), np.flatnonzero(folds == fold)
        rows = np.concatenate([known, out])
        curve = _grow(every[rows[:, None], known], targets[rows], neurons, new_share).check_mse
        result += len(out) / len(folds) * np.pad(curve, (0, neurons + 1 - len(curve)), mode="edge")
    return result


@dataclass(frozen=True)
class Choice:
    """The best spread and number of neurons, and all cross-validated mean squared errors (s, neurons + 1)."""

    spread_mm: float
    neurons: int
    validation_mse: FloatArray


def choose(
    points_mm: FloatArray,
    targets: FloatArray,
    spreads_mm: Sequence[float],
    neurons: int,
    folds: IntArray,
    new_share: float = ROUNDING,
) -> Choice:
    """The Choice of least cross-validated error among spreads (s,), see `validation_mse`."""
    curves = np.array([validation_mse(points_mm, targets, s, neurons, folds, new_share) for s in spreads_mm])
    best, count = np.unravel_index(curves.argmin(), curves.shape)
    return Choice(float(spreads_mm[int(best)]), int(count), curves)


def make_folds(count: int, folds: int, generator: np.random.Generator) -> IntArray:
    """Fold numbers (count,) of equal share, at random."""
    return generator.permutation(np.arange(count) % folds)


def _split_mse(residual: FloatArray, train: int) -> list[float]:
    """Mean squared residual of the first `train` rows and of the others, NaN without others."""
    return [
        float(np.vdot(part, part)) / part.size if part.size else np.nan for part in (residual[:train], residual[train:])
    ]
