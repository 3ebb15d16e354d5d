"""Calibration from lengths alone, where every row brings its own unknowns beside the machine's numbers.

The search starts from several machines (`rrru.fit.lengths_start`). Bad readings are found by a fit under Cauchy's loss
and then left out.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from rrru.errors import FitError
from rrru.fit.identifiability import Identifiability, analyse_columns
from rrru.fit.lengths_model import LengthModel
from rrru.fit.lengths_search import SHORT, search, settled

_ROUNDS = 10
# starts are compared over so many rows
_COMPARED = 100
# Cauchy's loss bends at 2.385 standard deviations: 95 % efficient for normal noise (Rey, 1983)
_BEND = 2.385
# where a model is not quite right its own errors reach ten standard deviations of the rest: only what is beyond that
# is a blunder and left out
LEFT_OUT = 12.0
# more bad readings than this share of all are no outliers, the model is wrong
_MOST_BAD = 0.2
# nearest places with which a reading is compared, and how much of the worst of a row is as bad
_NEIGHBOURS, _AS_BAD = 5, 0.9
# a reading that the others check by less than this share of its variance is not judged
_CHECKED = 0.02


@dataclass(frozen=True)
class LengthFit:
    """Fitted theta (p,) and places (N, d) of a model, and how far to trust them.

    weight (N, k): 0 for readings left out, else 1. residual_mm (N, k). redundancy (N, k): share of a reading's variance
    that is left in its residual, so residual / redundancy is what the other readings foretell it wrong by. covariance
    (p, p): from the residual's noise_mm per reading, as if all were independent.
    """

    model: LengthModel
    theta: np.ndarray
    places: np.ndarray
    weight: np.ndarray
    residual_mm: np.ndarray
    redundancy: np.ndarray
    noise_mm: float
    freedom: int
    covariance: np.ndarray
    identifiability: Identifiability

    @property
    def rms_mm(self) -> float:
        """Root mean square of the residual over the readings in use."""
        return float(np.sqrt((self.residual_mm**2 * self.weight).sum() / self.weight.sum()))

    @property
    def standard_errors(self) -> np.ndarray:
        """Standard errors (n d + 2 k,) of anchors, start lengths and factors; inf where the readings do not tell."""
        unseen = (np.abs(self.model.basis) @ self.identifiability.unseen) > 0.0
        half = self.model.basis @ np.nan_to_num(self.covariance, posinf=0.0)
        return np.where(unseen, np.inf, np.sqrt((half * self.model.basis).sum(axis=1)))

    @property
    def bad(self) -> np.ndarray:
        """Row and reading (b, 2) of what was left out."""
        return np.argwhere(self.weight == 0.0)


def fit_lengths(
    model: LengthModel, starts: Iterable[tuple[np.ndarray, np.ndarray]], weight: np.ndarray | None = None
) -> LengthFit:
    """Least squares from the best of several starts (theta (p,), places (N, d)), bad readings left out.

    weight (N, k): 0 or 1 of every reading where the bad ones are known; None finds them. Raises FitError where there
    are fewer readings than unknowns, no start leads anywhere, or a fifth of the readings contradicts the others.
    """
    if model.redundant < 0:
        raise FitError(
            f"{model.counted.size} lengths; allowed: at least {model.counted.size - model.redundant} unknowns"
        )
    given = np.ones(model.counted.shape) if weight is None else weight
    theta, places = _best_start(model, starts, given)
    if weight is not None:
        return _made(model, *settled(model, theta, places, given, np.inf), given)
    for _ in range(3):
        size = _spread(model.residual(theta, places))
        theta, places = settled(model, theta, places, given, max(_BEND * size, 1e-9))
    return _without_bad(model, theta, places, given)


def _best_start(
    model: LengthModel, starts: Iterable[tuple[np.ndarray, np.ndarray]], weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Theta (p,) and places (N, d) of the start whose search leaves the smallest median residual over a few rows."""
    some = np.unique(np.linspace(0, len(weight) - 1, _COMPARED).astype(int))
    few, best = model.rows(some), (np.inf, model.origin, model.origin)
    for theta, places in starts:
        found, at = search(few, theta, places[some], weight[some], np.inf, SHORT)
        size = _spread(few.residual(found, at)[weight[some] > 0.0])
        if size < best[0]:
            best = size, found, places.copy()
            best[2][some] = at
    if not np.isfinite(best[0]):
        raise FitError("no start leads to a machine with these lengths")
    return search(model, *best[1:], weight, np.inf, SHORT, rows_only=True) if model.unknown else best[1:]


def _without_bad(model: LengthModel, theta: np.ndarray, places: np.ndarray, given: np.ndarray) -> LengthFit:
    """The fit without the readings that stand out from a robust one, judged again until no other does."""
    weight = given
    fit = _made(model, *settled(model, theta, places, weight, np.inf), weight)
    # judged first by the robust numbers, which bad readings have not drawn to themselves
    judged = _made(model, *search(model, theta, places, weight, rows_only=True), weight)
    for _ in range(_ROUNDS):
        weight = given * ~stands_out(judged, LEFT_OUT)
        if weight.sum() < (1.0 - _MOST_BAD) * given.sum():
            raise FitError(f"{int((weight == 0.0).sum())} of {weight.size} lengths contradict the others", fit)
        if (weight == fit.weight).all():
            break
        fit = judged = _made(model, *settled(model, fit.theta, fit.places, weight, np.inf), weight)
    return fit


def stands_out(fit: LengthFit, limit: float) -> np.ndarray:
    """Flags (N, k) of readings beyond a limit in standard deviations.

    They stand out from all others, and from the same reading at the nearest places, since errors of a model that is
    not quite right are smooth. In a row the worst reading is flagged, or all where another fits about as badly: the row
    does not tell which is bad. Those left out before are judged afresh.
    """
    used = fit.weight > 0.0
    checked = fit.redundancy > _CHECKED
    standard = np.where(checked, fit.residual_mm, 0.0) / np.sqrt(np.maximum(fit.redundancy, _CHECKED))
    if not (used & checked).any():
        return ~used
    size = np.abs(standard) / max(_spread(standard[used & checked]), 1e-12)
    if len(size) > 2 * _NEIGHBOURS:
        _, near = cKDTree(fit.places).query(fit.places, k=_NEIGHBOURS + 1)
        local = np.abs(standard - np.median(standard[near[:, 1:]], axis=1))
        size = np.minimum(size, local / max(_spread(local[used & checked]), 1e-12))
    worst = np.where(used, size, 0.0).max(axis=1, keepdims=True)
    alike = used & (size > _AS_BAD * worst)
    new = (worst > limit) & (alike | (alike.sum(axis=1, keepdims=True) > 1))
    # nothing foretells a row that is out as a whole
    return new | (~used & ((size > limit) | ~used.any(axis=1, keepdims=True)))


def _spread(residual: np.ndarray) -> float:
    """Standard deviation of normal noise with the same median absolute value."""
    return float(np.median(np.abs(residual))) / 0.6745


def _made(model: LengthModel, theta: np.ndarray, places: np.ndarray, weight: np.ndarray) -> LengthFit:
    """The fit of an optimum that a search has come to."""
    residual = model.residual(theta, places)
    by_theta, leverage = _reduced(model, theta, places, weight)
    rows, readings, numbers = by_theta.shape
    used = (weight[..., None] * by_theta).reshape(rows * readings, 1, numbers)
    ident = analyse_columns(model.names, model.scale, used)
    freedom = int((np.maximum(weight.sum(axis=1) - model.unknown, 0.0)).sum()) - ident.rank
    noise = float(np.sqrt((weight * residual**2).sum() / max(freedom, 1)))
    unit = np.nan_to_num(ident.covariance(1.0), posinf=0.0)
    leverage = leverage + np.einsum("ikp,pq,ikq->ik", by_theta, unit, by_theta)
    # a reading left out is foretold by the others: its error and theirs add
    redundancy = np.where(weight > 0.0, 1.0 - leverage, 1.0 + leverage)
    return LengthFit(model, theta, places, weight, residual, redundancy, noise, freedom, ident.covariance(noise), ident)


def _reduced(
    model: LengthModel, theta: np.ndarray, places: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Derivative (N, k, p) of the residual by theta, the rows' unknowns following, and the rows' leverage (N, k)."""
    by_theta, by_place = model.slopes(theta, places)
    if not model.unknown:
        return by_theta, np.zeros(weight.shape)
    weighted = weight[..., None] * by_place
    inverse = np.linalg.pinv(weighted.transpose(0, 2, 1) @ by_place, hermitian=True)
    gain = by_place @ inverse
    follow = inverse @ (weighted.transpose(0, 2, 1) @ by_theta)
    return by_theta - by_place @ follow, (gain * by_place).sum(axis=-1)
