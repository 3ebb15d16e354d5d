"""Calibration from lengths of belts or cables: estimates from several starts, and the screening of bad readings.

Bad readings are found by an estimate under Cauchy's loss and then left out.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from rrru.arrays import BoolArray, FloatArray
from rrru.campaign.outliers import off_neighbours, robust_sd
from rrru.errors import FitError
from rrru.estimation.discrepancy import Discrepancy
from rrru.estimation.estimate import Estimate
from rrru.estimation.evidence import MarginalLikelihood, marginalize
from rrru.estimation.observations.lengths import Lengths
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.solver import SolverOptions, solve

_MAX_SCREENINGS = 10
# starts are compared over so many rows; they and robust fits, which only judge readings that are far off, are searched
# until a step is a hundredth of a standard error
_COMPARED_ROWS, _COMPARISON = 100, SolverOptions(max_iterations=25, step_tolerance=1e-2)
_NO_SEARCH = SolverOptions(max_iterations=0)
# Cauchy's loss bends at 2.385 standard deviations: 95 % efficient for normal noise (Rey, 1983)
_CAUCHY_SD, _CAUCHY_ROUNDS, _MIN_CAUCHY_MM = 2.385, 3, 1e-9
# model discrepancy reaches ten standard deviations of the other readings: only what is beyond that is a gross error
MAX_STANDARD_RESIDUAL = 12.0
# more bad readings than this share of all are no outliers, the model is wrong
_MAX_BAD_SHARE = 0.2
# nearest places with which a reading is compared, and how much of the worst of a row is as bad
_NEIGHBOURS, _AS_BAD = 5, 0.9
# a reading that the others check by less than this share of its variance is not judged
_MIN_REDUNDANCY = 0.02
# a smooth discrepancy is compared with noise of this size at least
_MIN_NOISE_MM = 1e-9


@dataclass(frozen=True, eq=False)
class LengthFit:
    """Least squares estimate of a machine from its Lengths, of 1 mm noise, with its uncertainty.

    The noise is that of the residuals, as if all were independent.
    """

    lengths: Lengths
    estimate: Estimate

    @property
    def values(self) -> FloatArray:
        """Estimated parameters (p,)."""
        return self.estimate.values

    @property
    def used(self) -> BoolArray:
        """Flags (N, k) of readings in use."""
        return self.lengths.weight > 0.0

    @cached_property
    def places_mm(self) -> FloatArray:
        """Places (N, d), measured or estimated."""
        return np.asarray(self.lengths.places(self.values))

    @property
    def residual_mm(self) -> FloatArray:
        """Read less modelled lengths (N, k)."""
        return self.estimate.residual

    @property
    def rms_mm(self) -> float:
        """Root mean square of the residual over the readings in use."""
        return float(np.sqrt((self.residual_mm[self.used] ** 2).mean()))

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the residual."""
        rows = np.maximum(self.lengths.weight.sum(axis=1) - self.lengths.eliminated, 0.0)
        return int(rows.sum()) - self.estimate.rank

    @property
    def noise_mm(self) -> float:
        """Standard deviation of a reading."""
        return float(np.sqrt((self.residual_mm[self.used] ** 2).sum() / max(self.freedom, 1)))

    @property
    def determined(self) -> bool:
        """Whether the readings determine all parameters."""
        return self.estimate.rank == len(self.values)

    @property
    def covariance(self) -> FloatArray:
        """Covariance (p, p) of the parameters; inf on the diagonal of one that the readings do not determine."""
        return self.estimate.covariance * self.noise_mm**2

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors (n d + 2 k,) of anchors, start lengths and factors; inf for undetermined ones."""
        unseen = (np.abs(self.lengths.basis) @ np.isinf(np.diag(self.covariance))) > 0.0
        half = self.lengths.basis @ np.where(np.isinf(self.covariance), 0.0, self.covariance)
        return np.where(unseen, np.inf, np.sqrt((half * self.lengths.basis).sum(axis=1)))

    @cached_property
    def redundancy(self) -> FloatArray:
        """Share (N, k) of a reading's variance that is in its residual, above 1 for one that is not in use.

        The other readings contradict a reading by its residual over this share.
        """
        slopes = self.lengths.jacobian(self.values)
        covariance = np.where(np.isinf(self.estimate.covariance), 0.0, self.estimate.covariance)
        leverage = self.lengths.place_leverage(self.values) + np.einsum("ikp,pq,ikq->ik", slopes, covariance, slopes)
        # the error of a reading left out and of its prediction add
        return np.asarray(np.where(self.used, 1.0 - leverage, 1.0 + leverage))

    @property
    def bad(self) -> npt.NDArray[np.int_]:
        """Row and reading (b, 2) of the readings left out."""
        return np.argwhere(~self.used)

    def marginals(self, parameters: Parameters) -> tuple[MarginalLikelihood, MarginalLikelihood] | None:
        """Marginal likelihoods under priors, with independent noise and with a smooth discrepancy over the places.

        parameters: those of the fit; flat priors are common to all fits that are compared. None where readings and
        priors do not determine them, or no reading determines the noise.
        """
        if not self.determined or self.freedom < 1:
            return None
        noise = max(self.noise_mm, _MIN_NOISE_MM)
        estimate = solve(replace(self.lengths, noise_mm=noise).problem(parameters), [self.values])
        discrepancy = Discrepancy.over_places(self.places_mm, self.used.shape[1], noise)
        common = [name for name, sd in zip(parameters.names, parameters.sd, strict=True) if np.isinf(sd)]
        return marginalize(estimate, common=common), marginalize(estimate, discrepancy, common=common)


def fit_lengths(lengths: Lengths, starts: Iterable[FloatArray], used: BoolArray | None = None) -> LengthFit:
    """Least squares from the best of several starts (p,), bad readings left out.

    used (N, k): flags of good readings where the bad ones are known; None finds them. Raises FitError where there are
    fewer readings than parameters, no start leads anywhere, or a fifth of the readings contradicts the others.
    """
    given = replace(lengths, used=used)
    if given.redundancy < 0:
        count = int(given.weight.sum())
        raise FitError(f"{count} lengths; allowed: at least {count - given.redundancy} for as many parameters")
    start = _best_start(given, starts, used is not None)
    if used is not None:
        return _fit(given, [start])
    robust = start
    for _ in range(_CAUCHY_ROUNDS):
        size = robust_sd(given.residual(robust))
        cauchy = replace(given, cauchy_mm=max(_CAUCHY_SD * size, _MIN_CAUCHY_MM))
        robust = _fit(cauchy, [robust], _COMPARISON).values
    return _screen(given, robust)


def refit(fit: LengthFit, rows: npt.NDArray[np.bool_ | np.int_]) -> LengthFit:
    """The fit to some rows, a mask (N,) or their numbers, from the estimate of all."""
    return _fit(fit.lengths.rows(rows), [fit.values])


def _fit(lengths: Lengths, starts: Sequence[FloatArray], options: SolverOptions | None = None) -> LengthFit:
    """The fit of least squares from some starts (p,), flat priors."""
    names = [f"number_{place}" for place in range(lengths.basis.shape[1])]
    flat = Parameters((Block.of("machine", names, [lengths.unit] * len(names), np.inf),))
    return LengthFit(lengths, solve(lengths.problem(flat), starts, options))


def _best_start(lengths: Lengths, starts: Iterable[FloatArray], screened: bool) -> FloatArray:
    """The best end (p,) of searches over a few rows.

    Unless the rows are screened the best one has the smallest median residual, which is robust against bad readings.
    """
    few, starts = lengths.rows(np.unique(np.linspace(0, len(lengths) - 1, _COMPARED_ROWS).astype(int))), list(starts)
    if not starts:
        raise FitError("no start leads to a machine with these lengths")
    if screened:
        return _fit(few, starts, _COMPARISON).values
    fits = [_fit(few, [start], _COMPARISON) for start in starts]
    return min(fits, key=lambda fit: robust_sd(fit.residual_mm[fit.used])).values


def _screen(lengths: Lengths, robust: FloatArray) -> LengthFit:
    """The fit without the readings that stand out from a robust one (p,), repeated until no other stands out."""
    fit = _fit(lengths, [robust])
    # judged first by the robust parameters, which bad readings have not biased
    judged = _fit(lengths, [robust], _NO_SEARCH)
    for _ in range(_MAX_SCREENINGS):
        used = ~standing_out(judged, MAX_STANDARD_RESIDUAL)
        if used.sum() < (1.0 - _MAX_BAD_SHARE) * used.size:
            raise FitError(f"{int((~used).sum())} of {used.size} lengths contradict the others", fit)
        if (used == fit.used).all():
            break
        fit = judged = _fit(replace(lengths, used=used), [fit.values])
    return fit


def standing_out(fit: LengthFit, limit: float) -> BoolArray:
    """Flags (N, k) of readings beyond a limit in standard deviations.

    They stand out from all others, and from the same reading at the nearest places, since the model discrepancy is
    smooth. In a row the worst reading is flagged, or all where another fits about as badly: the row then does not
    determine the bad one. Readings left out before are judged again.
    """
    used, checked = fit.used, fit.redundancy > _MIN_REDUNDANCY
    standard = np.where(checked, fit.residual_mm, 0.0) / np.sqrt(np.maximum(fit.redundancy, _MIN_REDUNDANCY))
    if not (used & checked).any():
        return ~used
    size = np.abs(standard) / robust_sd(standard[used & checked], floor=1e-12)
    if len(size) > 2 * _NEIGHBOURS:
        _, near = cKDTree(fit.places_mm).query(fit.places_mm, k=_NEIGHBOURS + 1)
        local = off_neighbours(standard, near[:, 1:])
        size = np.minimum(size, local / robust_sd(local[used & checked], floor=1e-12))
    worst = np.where(used, size, 0.0).max(axis=1, keepdims=True)
    alike = used & (size > _AS_BAD * worst)
    new = (worst > limit) & (alike | (alike.sum(axis=1, keepdims=True) > 1))
    # no reading predicts a row without any reading in use
    return np.asarray(new | (~used & ((size > limit) | ~used.any(axis=1, keepdims=True))))
