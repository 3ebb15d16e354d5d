"""The paper's genetic algorithm: MATLAB's `ga` step by step, in blocks of generations that run compiled.

PyGAD's own algorithm, another reading of the paper, is in `pygad_run`, an evolution strategy in `cma_es`; `minimise`
calls the one that the settings name.
"""

from numbers import Integral
from typing import Any

import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray
from rrru.errors import ConfigError, FitError
from rrru.genetic import cma_es, operators, pygad_run
from rrru.genetic.plan import (
    Bounds,
    directions,
    make_rules,
    migrants_of,
    migrate,
    mutants_of,
    mutation_sigma,
    uniforms_needed,
)
from rrru.genetic.result import GeneticResult, means
from rrru.genetic.settings import GeneticSettings, Objective, is_number
from rrru.kinematics.compiled import CompiledObjective

# generations whose random numbers are drawn at once: few enough to stay in the cache
BLOCK = 100
# algorithms of their own by the name of their operators
_OTHERS = {"pygad": pygad_run.run, "cma_es": cma_es.run}


def minimise(
    objective: Objective, low: npt.ArrayLike, high: npt.ArrayLike, settings: GeneticSettings, seed: int
) -> GeneticResult:
    """Minimum of an objective within bounds by the genetic algorithm that GeneticSettings name.

    objective: callable, vectors (m, p) to values (m,), inf where infeasible; a CompiledObjective is called without
    Python and not asked again for a child that equals an individual of the last population. low, high: bounds (p,),
    finite, low < high; seed: whole number in 0..2^32 - 1. Returns a GeneticResult; the same seed gives the same bytes.
    Raises ConfigError for bounds or a seed that are not allowed and FitError where the objective returns NaN or a wrong
    number of values.
    """
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    vectors = low.ndim == 1 and low.size and low.shape == high.shape
    if not (vectors and np.isfinite(high - low).all() and (low < high).all()):
        raise ConfigError(f"bounds are {low} and {high}; allowed: two vectors of one length, finite, low < high")
    if not is_number(seed, Integral) or not 0 <= seed < 2**32:
        raise ConfigError(f"seed is {seed!r}; allowed: a whole number in 0..{2**32 - 1}")
    if settings.operators in _OTHERS:
        return _OTHERS[settings.operators](checked(objective), Bounds(low, high), settings, int(seed))
    return _Run(objective, Bounds(low, high), settings, np.random.default_rng(seed)).result()


def checked(objective: Objective) -> Objective:
    """The objective that raises FitError where it returns NaN or a wrong number of values."""

    def rate(deviations: FloatArray) -> FloatArray:
        score = np.asarray(objective(deviations), dtype=float)
        if score.shape != (len(deviations),) or np.isnan(score).any():
            raise FitError(
                f"the objective of {len(deviations)} individuals has shape {score.shape} or holds NaN; "
                "allowed: a number or inf each"
            )
        return score

    return rate


class _Run:
    """One run: the last generation's genes and scores, and the histories so far."""

    def __init__(
        self, objective: Objective, bounds: Bounds, settings: GeneticSettings, generator: np.random.Generator
    ) -> None:
        self.objective, self.bounds, self.settings, self.generator = objective, bounds, settings, generator
        self.rules = make_rules(settings, reuses_scores=isinstance(objective, CompiledObjective))
        self.migrants = migrants_of(settings.populations, settings.migration_fraction)
        self.rate = checked(objective)
        self.population = generator.random((sum(settings.populations), bounds.low.size))
        self.score = self.rate(operators.decoded(self.population, bounds))
        self.best, self.size = np.full(int(settings.generations) + 1, np.inf), np.nan
        self.best[0], self.done, self.stopped = self.score.min(), 0, "generations"
        self.mean: list[FloatArray] = []
        self.found: list[FloatArray] = []
        self._note(self.population[None], self.score[None])

    def result(self) -> GeneticResult:
        """Breed until the end or until the run stalls; the GeneticResult."""
        settings, several = self.settings, len(self.settings.populations) > 1
        while self.done < settings.generations and self.stopped != "stalled":
            if several and self.done > 0 and self.done % settings.migration_interval == 0:
                self.population, self.score = migrate(self.population, self.score, self.rules.plan, self.migrants)
            until_migration = settings.migration_interval - self.done % settings.migration_interval
            block = min(BLOCK, until_migration) if several else BLOCK
            self._breed(min(block, settings.generations - self.done))
        children = len(self.population) - self.rules.plan[:, 2].sum()
        return GeneticResult(
            stopped=self.stopped,
            found=np.concatenate(self.found),
            best_history=self.best[: self.done + 1],
            mean_history=np.concatenate(self.mean),
            asked=len(self.population) + children * np.arange(self.done + 1),
        )

    def _breed(self, count: int) -> None:
        """A block of generations: elites, crossover children and mutants of all islands."""
        draws = self._draw(count)
        populations = np.empty((count + 1, *self.population.shape))
        scores = np.empty(populations.shape[:2])
        populations[0], scores[0] = self.population, self.score
        advance: Any = operators.advance
        objective: tuple[Any, ...] = (self._rate_into, None, None)
        if isinstance(self.objective, CompiledObjective):
            objective = self.objective.kernel, self.objective.legs, self.objective.points
        else:
            advance = advance.py_func
        done = advance(*objective, self.bounds, self.rules, draws, self.done, populations, scores, self.best)
        self.done += done
        self.population, self.score, self.size = populations[done], scores[done], draws[2][done]
        self._note(populations[1 : done + 1], scores[1 : done + 1])
        stall = self.rules.stall_generations, self.rules.stall_tolerance
        if self.done < self.settings.generations and operators.has_stalled(self.best[: self.done + 1], *stall):
            self.stopped = "stalled"

    def _draw(self, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Random numbers and the mutation's sizes of the next generations."""
        settings, genes, plan = self.settings, self.bounds.low.size, self.rules.plan
        mutants = int(mutants_of(plan).sum())
        uniform = self.generator.random((count, uniforms_needed(plan, genes)))
        if self.rules.adaptive_mutation:
            moves = directions(self.generator, count * mutants, genes).reshape(count, mutants, 2 * genes, genes)
        else:
            moves = self.generator.standard_normal((count, mutants, 1, genes))
        scale = settings.mutation_scale, settings.mutation_shrink
        following = range(self.done + 1, self.done + count + 1)
        sizes = [mutation_sigma(generation, settings.generations, *scale) for generation in following]
        return uniform, moves, np.array([self.size, *sizes])

    def _note(self, populations: FloatArray, scores: FloatArray) -> None:
        """Keep mean objective and best individual of generations (k, n, p) with scores (k, n)."""
        self.mean.append(means(scores))
        best = populations[np.arange(len(scores)), scores.argmin(axis=1)]
        self.found.append(operators.decoded(best, self.bounds))

    def _rate_into(self, deviations: FloatArray, _legs: None, _points: None, values: FloatArray) -> None:
        """The objective as `operators.advance` calls it."""
        values[:] = self.rate(deviations)
