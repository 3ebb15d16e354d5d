"""Evidence of a hypothesis: the marginal likelihood of a linear model, all its parameters marginalised.

Along each run the data d (one axis, k points) are

    d = B b + X c + w + e,   w ~ N(0, level^2 sigma^2 K),   c ~ N(0, (prior_scale sigma)^2 S)

with noise e as in `rrru.estimation.noise_model`, of mean variance sigma^2, the geometric errors b (weak prior) and the
effects' coefficients c. The model discrepancy w is for whatever the library does not hold (Kennedy and O'Hagan,
Bayesian calibration of computer models, 2001). K is diagonal in the cosine basis of the run and falls with the
frequency. So w is smooth along the path, plus a small part that is not. S is scaled so that `prior_scale` is the rms of
the effect's part of the gap per axis over sigma, the calibration's share taken out; positive coefficients have the
positive half of it. Prior scales are averaged over a grid, even in their logarithm up to the upper bound of the effect,
which no prior is wider than (`Prior.log_scales`).

The shape parameters of an effect may lie between the points of their grid: each has a coefficient N(0, 1) on
`LinearizedProblem.shape_columns`. So have payload and tilt wherever a compliant effect acts
(`rrru.diagnosis.payload_nuisance`).

An effect may lack its inputs at some readings, such as the sense in which a drive arrives: it predicts nothing there.
All sets of effects then compare on the readings at which every effect of the library has what it needs
(`ModelEvidence.on_library`); coefficients of a set are those of the readings at which its own effects do.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial, reduce, wraps
from itertools import product
from typing import Concatenate, ParamSpec, TypeVar

import numpy as np

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.cache import Latest, read_only
from rrru.diagnosis.aliases import Grams
from rrru.diagnosis.discrepancy_basis import Library
from rrru.diagnosis.evidence_kernels import log_sum_exp
from rrru.diagnosis.hypothesis import Hypothesis
from rrru.diagnosis.marginal_problem import PRIOR_SCALES, Average, MarginalProblem, Prior
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.payload_nuisance import (
    WEIGHT,
    as_found,
    gained_over_cases,
    mean_over_cases,
    over_cases,
    with_nuisance,
)
from rrru.diagnosis.state import LinearizedProblem
from rrru.diagnosis.terms import EACH, SAME, EffectTerm, spread
from rrru.diagnosis.whitened import DISCREPANCY_SCALES, Whitened
from rrru.estimation.noise_model import NoiseModel

_P = ParamSpec("_P")
_R = TypeVar("_R")


def _on_complete(
    method: Callable[Concatenate["ModelEvidence", Sequence[EffectTerm], _P], _R],
) -> Callable[Concatenate["ModelEvidence", Sequence[EffectTerm], _P], _R]:
    """The method of a set of terms on the readings at which all its effects have what they need."""

    @wraps(method)
    def on_complete(self: "ModelEvidence", terms: Sequence[EffectTerm], /, *args: _P.args, **kwargs: _P.kwargs) -> _R:
        return method(self.on_complete(terms), terms, *args, **kwargs)

    return on_complete


@dataclass(frozen=True)
class ModelEvidence:
    """Evidence of sets of terms on one linearisation.

    library: effects by name; linear: `rrru.diagnosis.state.LinearizedProblem`; run (n,): the series of each row; noise:
    a NoiseModel; smooth: whether a discrepancy can be smooth along the runs, not so for poses in no order; known:
    effect to the rows (n,) at which it has all that it needs, of effects that lack something somewhere. Results for
    sets with such effects are those of the rows at which all of them do.
    """

    library: Library
    linear: LinearizedProblem
    run: IntArray
    noise: NoiseModel
    smooth: bool = True
    known: Mapping[str, BoolArray] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.run)

    def on_library(self) -> "ModelEvidence":
        """The evidence on the readings at which every effect has what it needs, where all sets compare."""
        return self._on(self.known)

    def on_complete(self, terms: Sequence[EffectTerm]) -> "ModelEvidence":
        """The evidence on the readings at which all effects of terms have what they need."""
        if not self.known:
            return self
        return self._on({term.effect for term in terms} & self.known.keys())

    def _on(self, names: Collection[str]) -> "ModelEvidence":
        """The evidence on the readings at which some effects have what they need."""
        needed = [self.known[name] for name in sorted(names)]
        if not needed:
            return self
        rows = np.all(needed, axis=0)
        key = rows.tobytes()
        if key not in self._parts:
            part = replace(self, linear=self.linear.at(rows), run=self.run[rows], known={})
            self._parts[key] = part
        return self._parts[key]

    @cached_property
    def _parts(self) -> dict[bytes, "ModelEvidence"]:
        """Evidences on some of the readings that have been asked for."""
        return {}

    @cached_property
    def _whitened(self) -> Whitened:
        """The columns, whitened."""
        return Whitened(self.library, self.linear, self.run, self.noise)

    @cached_property
    def levels(self) -> IntArray:
        """Levels (l,), as indices, that matter: those at which some effects may have more than a negligible weight."""
        return np.flatnonzero(self._at_levels[:, 1] >= self.none.max() - OPTIONS.negligible_nats)

    @property
    def none(self) -> FloatArray:
        """Log evidence (levels,) of no effect at all, -inf at levels that there cannot be."""
        return self._at_levels[:, 0]

    @cached_property
    def _at_levels(self) -> FloatArray:
        """`Whitened.none` (levels, 2), -inf at levels that there cannot be."""
        result = np.full((len(DISCREPANCY_SCALES), 2), -np.inf)
        for level in range(len(result) if self.smooth else 1):
            result[level] = self._whitened.none(level)
        return result

    @cached_property
    def _priors(self) -> dict[EffectTerm | str, Prior]:
        """Priors by term and by effect whose shape parameters are fitted, made when they are asked for."""
        return {name: Prior.normal(self._whitened.layout[0][name]) for name in self.linear.shape_columns}

    def _prior(self, term: EffectTerm) -> Prior:
        """The prior of one term's coefficients."""
        if term not in self._priors:
            coordinates, gram = self.library[term.effect].coordinates, np.diag(self._whitened.gram(0)[0])
            matrix = spread(coordinates, term.legs)
            index = self._whitened.layout[0][term.effect, term.shape, SAME if term.legs == SAME else EACH]
            index = index if term.legs in (EACH, SAME) else index[np.isin(coordinates.legs, term.legs)]
            size = matrix.T @ coordinates.typical / matrix.sum(axis=0)
            power, total = (
                (all_of[index] * size**2).sum() / (3.0 * len(self)) for all_of in (gram, self._whitened.whole)
            )
            # only rounding remains of a term that the calibration absorbs: do not scale it up to the size of an effect
            unit = np.sqrt(max(power, OPTIONS.min_visible_share * total, 1e-30))
            if coordinates.sized:
                # the data determine the size of many coefficients better than the grid resolves: their typical size is
                # made one of its scales
                unit = PRIOR_SCALES[np.abs(np.log(PRIOR_SCALES / unit)).argmin()]
            size /= unit
            most = np.broadcast_to(coordinates.most, len(coordinates))
            largest = np.array([most[column > 0.0].max() for column in matrix.T])
            self._priors[term] = Prior(index, size, largest, matrix.T @ coordinates.positive > 0)
        return self._priors[term]

    @_on_complete
    def projected(self, terms: Sequence[EffectTerm], levels: Sequence[int] | IntArray) -> MarginalProblem:
        """The projected problem of a set of terms at discrepancy levels (indices)."""
        terms = tuple(terms)
        asked = frozenset(terms), tuple(levels)
        made: tuple[EffectTerm, ...]
        problem: MarginalProblem
        made, problem = self._problems.of(asked, lambda: (terms, self._projected(terms, levels)))
        if made == terms:
            return problem
        return problem.reordered([made.index(term) for term in terms], self._order(made, terms))

    @_on_complete
    def found(self, terms: Sequence[EffectTerm]) -> FloatArray:
        """Coefficients (k,) of a set of terms under weak priors, which make the columns of payload and tilt."""
        terms = tuple(terms)
        made: tuple[EffectTerm, ...]
        found: FloatArray
        made, found = self._found.of(frozenset(terms), lambda: (terms, as_found(*self._weakly(terms))))
        return found if made == terms else found[self._order(made, terms)]

    def _weakly(self, terms: Sequence[EffectTerm]) -> tuple[MarginalProblem, FloatArray]:
        """The MarginalProblem of terms alone at one level, and weak prior_scales (1, terms)."""
        # payload and tilt are the same at all levels
        problem = self._without_nuisance(terms, partial(self._grams, self.levels[:1]))
        return problem, np.full((1, len(terms)), PRIOR_SCALES[-1])

    def _order(self, made: Sequence[EffectTerm], terms: Sequence[EffectTerm]) -> IntArray:
        """Numbers (k,) that coefficients of terms, and after them of their shapes, have in a set in another order."""
        ends = np.cumsum([0, *(len(prior.columns) for prior in self.priors_of(made))])
        numbers = {key: np.arange(*ends[k : k + 2]) for k, key in enumerate(self._keys(made))}
        return np.concatenate([numbers[key] for key in self._keys(terms)])

    def _keys(self, terms: Sequence[EffectTerm]) -> tuple[EffectTerm | str, ...]:
        """Keys of the priors of terms and after them of their shapes."""
        return *terms, *(term.effect for term in terms if term.effect in self.linear.shape_columns)

    def priors_of(self, terms: Sequence[EffectTerm]) -> list[Prior]:
        """Priors of terms and after them of their shapes."""
        return [*map(self._prior, terms), *(self._priors[effect] for effect in self._keys(terms)[len(terms) :])]

    @_on_complete
    def log_scales(self, terms: Sequence[EffectTerm]) -> FloatArray:
        """Log priors (m,) of all combinations of PRIOR_SCALES of some terms, in the order of `over_strengths`."""
        return np.ravel(reduce(np.add.outer, map(self._log_scales_of, terms), np.zeros(())))

    def _log_scales_of(self, term: EffectTerm) -> FloatArray:
        """Log priors (s,) of PRIOR_SCALES of one term."""
        if term not in self._log_scales:
            self._log_scales[term] = self._prior(term).log_scales
        return self._log_scales[term]

    @cached_property
    def _log_scales(self) -> dict[EffectTerm, FloatArray]:
        """What `_log_scales_of` has given."""
        return {}

    def _projected(self, terms: Sequence[EffectTerm], levels: Sequence[int] | IntArray) -> MarginalProblem:
        if not self._blocks(terms):
            return self._without_nuisance(terms, partial(self._grams, levels))
        return self._with_nuisance(terms, levels, self.found(terms))

    def _with_nuisance(
        self, terms: Sequence[EffectTerm], levels: Sequence[int] | IntArray, found: FloatArray
    ) -> MarginalProblem:
        """The MarginalProblem of terms, payload and tilt, whose columns are made with coefficients found (k,)."""
        grams, blocks = partial(self._grams, levels), self._blocks(terms)
        problem = self._without_nuisance(terms, grams)
        return with_nuisance(problem, len(terms), blocks, self.linear.weight_steps, found, grams)

    def _without_nuisance(self, terms: Sequence[EffectTerm], grams: Grams) -> MarginalProblem:
        """The MarginalProblem of terms without payload and tilt."""
        return MarginalProblem.of(self.priors_of(terms), len(terms), grams)

    def _blocks(self, terms: Sequence[EffectTerm]) -> dict[int, tuple[FloatArray, IntArray]]:
        """`_by_weight` of the compliant terms, by their number."""
        return {k: self._by_weight(t) for k, t in enumerate(terms) if (t.effect, t.shape) in self.linear.by_weight}

    def _grams(self, levels: Sequence[int] | IntArray, index: IntArray) -> tuple[FloatArray, FloatArray]:
        """Gram matrices (l, k, k) and moments (l, k) of some columns at levels (indices)."""
        grams = [self._whitened.gram(level) for level in levels]
        chosen = [(gram.take(index, 0).take(index, 1), moment[index]) for gram, moment in grams]
        return np.array([gram for gram, _ in chosen]), np.array([moment for _, moment in chosen])

    def _by_weight(self, term: EffectTerm) -> tuple[FloatArray, IntArray]:
        """Matrix from a term's coefficients to coordinates, and derivatives of its columns by payload and tilt."""
        numbers = self._whitened.layout[0][term.effect, term.shape, WEIGHT]
        matrix = spread(self.library[term.effect].coordinates, term.legs)
        return matrix, numbers.reshape(-1, len(matrix))

    @_on_complete
    def over_strengths(
        self,
        terms: Sequence[EffectTerm],
        prior_scales: Sequence[Sequence[float] | FloatArray] | None = None,
        levels: Sequence[int] | IntArray | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Log evidence (levels, m) over every combination of the terms' prior scales, and the combinations (m, terms).

        prior_scales: grids, one per term, by default PRIOR_SCALES for each; levels (l,): indices, by default all that
        may be.
        """
        grids = tuple(prior_scales or (PRIOR_SCALES,) * len(terms))
        combinations = _combinations(*(tuple(grid) for grid in grids))
        levels = self.levels if levels is None else levels
        broad = self._broadest(terms)
        if broad is None:
            found = gained_over_cases(self.projected(terms, levels), combinations)
            return self.none.take(levels)[:, None] + found, combinations
        narrow, others = (*terms[:broad], *terms[broad + 1 :]), (*grids[:broad], *grids[broad + 1 :])
        rows = _combinations(*(tuple(grid) for grid in others))
        problem = self.projected(narrow, levels) if narrow else None
        value = self._with_broad_term(terms[broad], grids[broad], problem, rows, levels)
        value = value.reshape(len(levels), len(grids[broad]), *map(len, others))
        return np.moveaxis(value, 1, broad + 1).reshape(len(levels), -1), combinations

    @_on_complete
    def remaining_columns(
        self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int
    ) -> tuple[FloatArray, FloatArray, FloatArray, MarginalProblem | None, FloatArray | None]:
        """All columns other than the broad term of a set, and the problem of the set's others.

        Gram matrix (K, K) of all columns; across (K, z): factor of the part that the broad term absorbs, the product
        with its transpose; moments (K,) after that; the MarginalProblem at the level (an index), and the prior
        deviations of its coefficients at the prior scales, both None where there is nothing else.
        """
        broad = self._broadest(terms)
        gram, moment = self._whitened.gram(level)
        narrow, prior_scales = tuple(terms), np.asarray(prior_scales, dtype=float)
        across, average = np.zeros((len(moment), 0)), None
        if broad is not None:
            average = self._average(terms[broad], prior_scales[broad], level)
            across, moment = average.across, average.moment
            narrow, prior_scales = (*terms[:broad], *terms[broad + 1 :]), np.delete(prior_scales, broad)
        if not narrow:
            return gram, across, moment, None, None
        problem = self.projected(narrow, [level])
        if average is not None:
            problem = problem.on(*(part[None] for part in average.rest(problem.index)))
        return gram, across, moment, problem, problem.scale(prior_scales[None])[0]

    def _broadest(self, terms: Sequence[EffectTerm]) -> int | None:
        """Number of the broad term, the one with the most coefficients, None where no term has many."""
        broad = [k for k, term in enumerate(terms) if self.library[term.effect].coordinates.broad]
        return max(broad, key=lambda k: len(self._prior(terms[k]).columns), default=None)

    def _with_broad_term(
        self,
        broad: EffectTerm,
        grid: Sequence[float] | FloatArray,
        problem: MarginalProblem | None,
        prior_scales: FloatArray,
        levels: Sequence[int] | IntArray,
    ) -> FloatArray:
        """Log evidence (levels, s, m) of a broad term at the prior scales of a grid (s,) together with other terms.

        problem: the others' MarginalProblem at the levels, None where there are none; prior_scales (m, terms): theirs.
        """
        averages = [self._average(broad, prior_scale, level) for level in levels for prior_scale in grid]
        none = self.none.take(levels)
        alone = none[:, None, None] + np.array([a.evidence for a in averages]).reshape(len(levels), -1, 1)
        if problem is None:
            return np.asarray(alone)
        gram, moment = (np.array(part) for part in zip(*(a.rest(problem.index) for a in averages), strict=True))
        found = gained_over_cases(problem.on(gram, moment), prior_scales)
        return np.asarray(alone + found.reshape(*alone.shape[:2], -1))

    def _average(self, term: EffectTerm, prior_scale: float, level: int) -> Average:
        """The Average over the coefficients of a broad term at a prior scale and a level (an index)."""

        def make() -> Average:
            gram, moment = self._whitened.gram(level)
            prior = self._prior(term)
            # drives on which this term does not act: no set has an effect twice
            apart = self._whitened.layout[0][term.effect, term.shape, EACH]
            return Average(gram, moment, prior.columns, prior.at(prior_scale), apart)

        average: Average = self._averages.of((term, float(prior_scale), int(level)), make)
        return average

    @cached_property
    def _problems(self) -> Latest:
        return Latest(OPTIONS.max_cached_results)

    @cached_property
    def _found(self) -> Latest:
        return Latest(OPTIONS.max_cached_results)

    @cached_property
    def _means(self) -> Latest:
        # only the last result: the effects of one hypothesis are asked for one after another
        return Latest(1)

    @cached_property
    def _averages(self) -> Latest:
        return Latest(OPTIONS.max_cached_results)

    @_on_complete
    def over_all_strengths(
        self, terms: Sequence[EffectTerm], level: int, start: Sequence[float] | FloatArray | None = None
    ) -> tuple[float, FloatArray]:
        """Log evidence of a set of terms at a level (an index) averaged over their prior scales, and the best (terms,).

        For one term or two it averages over all combinations; for more over each prior scale about the others' best, as
        if they were independent. start (terms,): prior scales to begin from.
        """
        if len(terms) <= OPTIONS.max_jointly_averaged_effects:
            value, grid = self.over_strengths(terms, levels=[level])
            return averaged(value, self.log_scales(terms))[0], grid[value[0].argmax()]
        best = np.ones(len(terms)) if start is None else np.array(start, dtype=float)
        losses, evidence = np.zeros(len(terms)), self._along(terms, level)
        of_scales = [*map(self._log_scales_of, terms)]
        for _ in range(OPTIONS.prior_scale_sweeps):
            before = best.copy()
            for k in range(len(terms)):
                value = evidence.of_term(k, best)
                best[k], highest = PRIOR_SCALES[value.argmax()], value.max()
                losses[k] = averaged(value, of_scales[k]) - highest
            if (best == before).all():
                break
        return highest + losses.sum(), best

    def _along(self, terms: Sequence[EffectTerm], level: int) -> "_AlongPriorScales":
        """The log evidence of more than one term along each of their prior scales."""
        broad, none = self._broadest(terms), self.none[[level]]
        narrow = [term for k, term in enumerate(terms) if k != broad]
        problem = self.projected(narrow, [level])
        if broad is None:
            return _AlongPriorScales(lambda _: (none, problem), None)

        def after(prior_scales: FloatArray) -> tuple[FloatArray, MarginalProblem]:
            averages = [self._average(terms[broad], prior_scale, level) for prior_scale in prior_scales]
            gram, moment = (np.array(part) for part in zip(*(a.rest(problem.index) for a in averages), strict=True))
            return none + np.array([a.evidence for a in averages]), problem.on(gram, moment)

        return _AlongPriorScales(after, broad)

    @_on_complete
    def scales(self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray) -> FloatArray:
        """Prior standard deviations (k,) of the terms' coefficients at given prior scales."""
        if not terms:
            return np.zeros(0)
        problem = self.projected(terms, [0])
        return np.asarray(problem.scale(np.asarray(prior_scales)[None])[0, problem.owner < len(terms)])

    def explained(self, hypothesis: Hypothesis, effects: Collection[str]) -> float:
        """Rms per axis, over sigma, of what some effects of a hypothesis explain at its best, calibration taken out."""
        if hypothesis.effects.isdisjoint(effects):
            return 0.0
        level = int(hypothesis.evidence.argmax())
        prior_scales = hypothesis.prior_scales[level]
        asked = hypothesis.terms, tuple(prior_scales), level
        mean = self._means.of(asked, lambda: self._mean(hypothesis.terms, prior_scales, level))
        problem = self.projected(hypothesis.terms, [0])
        chosen = np.array([*(term.effect in effects for term in hypothesis.terms), True])
        mean = np.where(chosen[problem.owner], mean, 0.0)
        return float(np.sqrt(max(mean @ problem.gram[0] @ mean, 0.0) / (3.0 * len(self.on_complete(hypothesis.terms)))))

    @_on_complete
    def _mean(self, terms: Sequence[EffectTerm], prior_scales: Sequence[float] | FloatArray, level: int) -> FloatArray:
        """Mean (k,) of the coefficients as `coefficients` gives it, without what their covariance costs."""
        broad = self._broadest(terms)
        if broad is None:
            return mean_over_cases(self.projected(terms, [level]), np.asarray(prior_scales)[None])
        narrow, average = (*terms[:broad], *terms[broad + 1 :]), self._average(terms[broad], prior_scales[broad], level)
        index, found, problem = np.zeros(0, dtype=int), np.zeros(0), None
        if narrow:
            problem = self.projected(narrow, [level])
            index = problem.index
            problem = problem.on(*(part[None] for part in average.rest(index)))
            found = mean_over_cases(problem, np.delete(prior_scales, broad)[None])
        of_broad = average.mean(index, found if problem is None else problem.of_columns(found))
        before = sum(len(self._prior(term).columns) for term in terms[:broad])
        return np.concatenate([found[:before], of_broad, found[before:]])

    @_on_complete
    def coefficients(
        self, terms: Sequence[EffectTerm], prior_scales: FloatArray, level: int
    ) -> tuple[FloatArray, FloatArray]:
        """Mean (k,) and covariance (k, k) of the coefficients of a set of terms at prior scales and a level (an index).

        The mean satisfies the constraint on positive coefficients; the covariance ignores it.
        """
        return over_cases(self.projected(terms, [level]), np.asarray(prior_scales)[None])


class _AlongPriorScales:
    """Log evidence of a set of terms at one level along the prior scale of one of them, those of the others fixed.

    after: from prior scales (s,) of the broad term to its log evidence (s,) and the MarginalProblem of the others after
    the average over its coefficients; broad: its number, None where there is none.
    """

    def __init__(self, after: Callable[[FloatArray], tuple[FloatArray, MarginalProblem]], broad: int | None) -> None:
        self._after, self._broad = after, broad
        self._made: dict[float, tuple[FloatArray, MarginalProblem]] = {}
        # the last sweep asks again for the terms whose others have not changed since
        self._known: dict[tuple[float, ...], FloatArray] = {}

    def of_term(self, k: int, prior_scales: FloatArray) -> FloatArray:
        """Log evidence (s,) at PRIOR_SCALES of term k, and at prior_scales (terms,) of the others; read-only."""
        asked = k, *prior_scales[:k].tolist(), *prior_scales[k + 1 :].tolist()
        if asked not in self._known:
            self._known[asked] = read_only(self._evaluated(k, prior_scales))
        return self._known[asked]

    def _evaluated(self, k: int, prior_scales: FloatArray) -> FloatArray:
        """`of_term`, computed."""
        others = prior_scales if self._broad is None else np.delete(prior_scales, self._broad)
        if k == self._broad:
            alone, problem = self._cached(np.inf)
            return np.asarray(alone + gained_over_cases(problem, others[None])[:, 0])
        rows = np.repeat(others[None], len(PRIOR_SCALES), axis=0)
        rows[:, k - int(self._broad is not None and k > self._broad)] = PRIOR_SCALES
        alone, problem = self._cached(1.0 if self._broad is None else float(prior_scales[self._broad]))
        return np.asarray(alone + gained_over_cases(problem, rows)[0])

    def _cached(self, of_broad: float) -> tuple[FloatArray, MarginalProblem]:
        """What `after` gives at a prior scale of the broad term, or at all of them (inf)."""
        if of_broad not in self._made:
            self._made[of_broad] = self._after(PRIOR_SCALES if np.isinf(of_broad) else np.array([of_broad]))
        return self._made[of_broad]


@lru_cache(maxsize=256)
def _combinations(*grids: tuple[float, ...]) -> FloatArray:
    """Every combination (m, terms) of one number of each grid; read-only."""
    return read_only(np.array(list(product(*grids)), dtype=float))


def averaged(value: FloatArray, log_scales: FloatArray) -> FloatArray:
    """Log evidence (..) over prior scales from that at each (.., m), and log priors (.., m) of these."""
    return log_sum_exp(value + log_scales)
