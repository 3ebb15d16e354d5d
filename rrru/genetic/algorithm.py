"""The paper's genetic algorithm (MATLAB `ga`) on PyGAD: PyGAD keeps the loop, the random state and the callbacks, the
step is MATLAB's.

PyGAD's own hooks cannot express the step: MATLAB needs more parents than a population has members, and its crossover
*fraction* splits the children between crossover and mutation, which PyGAD's `crossover_probability` does not. So
PyGAD's selection passes through, its mutation is off, it keeps neither parents nor elites, and its crossover callable
returns the whole next population of all islands.
"""

import logging
from dataclasses import dataclass, fields
from numbers import Integral, Real

import numpy as np
import pygad

from rrru.errors import ConfigError, FitError
from rrru.genetic import islands, operators

# PyGAD logs every exception before raising it again; the exception is enough
_LOGGER = logging.getLogger(f"{__name__}.pygad")
_LOGGER.addHandler(logging.NullHandler())
_LOGGER.propagate = False

_ALLOWED = {
    "crossover_fraction": (Real, 0.0, 1.0, "0 to 1"),
    "migration_fraction": (Real, 0.0, 1.0, "0 to 1"),
    "migration_interval": (Integral, 1, np.inf, "a whole number from 1"),
    "elite_share": (Real, 0.0, 1.0, "above 0, below 1"),
    "generations": (Integral, 1, np.inf, "a whole number from 1"),
    "stall_generations": (Integral, 0, np.inf, "a whole number from 0; 0 never stops early"),
    "stall_tolerance": (Real, 0.0, np.inf, "0 or more"),
    "mutation_scale": (Real, 0.0, np.inf, "0 or more"),
    "mutation_shrink": (Real, 0.0, 1.0, "0 to 1"),
}


@dataclass(frozen=True)
class GeneticSettings:
    """Settings of one run, named as MATLAB's; see `operators` and `islands` for what each does.

    crossover_fraction: P_c, share of the non-elite children made by crossover, the rest by mutation.
    migration_fraction: P_m, share of the smaller island that migrates every `migration_interval` generations.
    populations: sizes of the islands. elite_share: elites per island are ceil(share size). stall_generations,
    stall_tolerance: see `has_stalled`; 0 generations never stop early. mutation_scale, mutation_shrink: see
    `operators.mutation_sigma`. Raises ConfigError for a value that is not allowed.
    """

    crossover_fraction: float = 0.8
    migration_fraction: float = 0.7
    populations: tuple[int, ...] = (30,)
    migration_interval: int = 20
    elite_share: float = 0.05
    generations: int = 1400
    stall_generations: int = 50
    stall_tolerance: float = 1e-6
    mutation_scale: float = 1.0
    mutation_shrink: float = 1.0

    def __post_init__(self):
        for item in fields(self):
            if item.name in _ALLOWED:
                _check(item.name, getattr(self, item.name), *_ALLOWED[item.name])
        sizes = self.populations
        if (
            not isinstance(sizes, tuple | list)
            or not sizes
            or not all(_is(size, Integral) and size >= 2 for size in sizes)
        ):
            raise ConfigError(
                f"populations is {sizes!r}; allowed: one whole number from 2 per island, at least one island"
            )
        object.__setattr__(self, "populations", tuple(int(size) for size in sizes))
        if not all(0 < operators.elite_count(size, self.elite_share) < size for size in sizes):
            raise ConfigError(
                f"elite_share is {self.elite_share!r}; allowed: above 0, and leaving a place in each of the islands of {sizes}"
            )


@dataclass(frozen=True)
class GeneticResult:
    """What one run found.

    errors: (p,) the best individual; objective: its objective, inf if none was feasible; generations: done;
    evaluations: individuals whose objective was computed (elites and migrants keep theirs); stopped: "generations" or
    "stalled"; best_history, mean_history: (generations + 1,) best, and mean over the feasible individuals, of the
    objective in the initial population (entry 0) and after each generation, before migration; inf where nobody is
    feasible.
    """

    deviations: np.ndarray
    objective: float
    generations: int
    evaluations: int
    stopped: str
    best_history: np.ndarray
    mean_history: np.ndarray


def minimise(objective, low, high, settings, seed):
    """Minimum of an objective within bounds by the genetic algorithm.

    objective: callable, error vectors (m, p) to values (m,), inf where infeasible; low, high: bounds (p,), finite, low
    < high; settings: GeneticSettings; seed: whole number in 0..2^32 - 1, handed to PyGAD as it is. Returns a
    GeneticResult; the same seed gives the same bytes. Raises ConfigError for bounds or a seed that are not allowed and
    FitError where the objective returns NaN or a wrong number of values. No process-wide random state is used or
    changed: every draw comes from PyGAD's own generator.
    """
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    if (
        low.ndim != 1
        or low.size == 0
        or low.shape != high.shape
        or not (np.isfinite(high - low).all() and (low < high).all())
    ):
        raise ConfigError(f"bounds are {low} and {high}; allowed: two vectors of one length, finite, low < high")
    if not _is(seed, Integral) or not 0 <= seed < 2**32:
        raise ConfigError(f"seed is {seed!r}; allowed: a whole number in 0..{2**32 - 1}")
    step = _Step(objective, low, high, settings)
    size = sum(settings.populations)
    ga = _BatchGA(
        num_generations=int(settings.generations),
        num_parents_mating=1,
        fitness_func=step.fitness,
        fitness_batch_size=size,
        sol_per_pop=size,
        num_genes=low.size,
        init_range_low=0.0,
        init_range_high=1.0,
        parent_selection_type=_pass_through,
        keep_parents=0,
        keep_elitism=0,
        crossover_type=step.crossover,
        mutation_type=None,
        on_generation=step.on_generation,
        suppress_warnings=True,
        random_seed=int(seed),
        logger=_LOGGER,
    )
    ga.run()
    return step.result(ga)


def has_stalled(best_history, stall_generations, tolerance):
    """Whether the best objective's average relative change over the last `stall_generations` = S generations is <=
    tolerance.

    best_history: best objective of the initial population and after each of g generations. With f_k after generation k
    the test is

        (1 / S) sum over k = g - S + 1 .. g of |f_k - f_(k-1)| / max(1, |f_g|)  <=  tolerance,   g >= S > 0

    Elites survive, so the sum is f_(g-S) - f_g. MATLAB stops (since R2014a) on the "average relative change in the best
    fitness function value over MaxStallGenerations"; older versions weighted the changes by powers of 1/2.
    """
    # ASSUME "relative" is to max(1, |f_g|), as in MATLAB's other relative tolerances: absolute, in mm, for objectives
    # below 1 mm.
    generation = len(best_history) - 1
    if stall_generations == 0 or generation < stall_generations:
        return False
    before, now = best_history[-1 - stall_generations], best_history[-1]
    return (before - now) / stall_generations <= tolerance * max(1.0, abs(now))


class _BatchGA(pygad.GA):
    """PyGAD's loop with the two methods that visit every individual in Python replaced by array forms (0.15 to 0.014 ms
    a generation).

    Both are public; what they return is the same, as nothing here is cached between generations.
    """

    def cal_pop_fitness(self):
        """Fitness of the whole population, shape (n,), in one call."""
        return self.fitness_func(self, self.population, None)

    def best_solution(self, pop_fitness=None):
        """Best individual, its fitness and its row."""
        fitness = self.cal_pop_fitness() if pop_fitness is None else pop_fitness
        row = int(np.argmax(fitness))
        return self.population[row].copy(), fitness[row], row


class _Step:
    """What one run carries from generation to generation, behind the callables that PyGAD is given."""

    def __init__(self, objective, low, high, settings):
        self.objective, self.low, self.high, self.span, self.settings = objective, low, high, high - low, settings
        self.rows = islands.rows_of(settings.populations)
        elites = [operators.elite_count(size, settings.elite_share) for size in settings.populations]
        crossed = [
            operators.child_counts(size, few, settings.crossover_fraction)[0]
            for size, few in zip(settings.populations, elites, strict=True)
        ]
        self.plan = np.column_stack([self.rows, elites, crossed]).astype(np.int64)
        self.uniforms, self.normals = operators.draws_needed(self.plan, low.size)
        self.children = np.concatenate([np.arange(start + few, stop) for start, stop, few, _ in self.plan])
        self.known = None  # scores of the next population, NaN for the children; None before the first generation
        self.best, self.mean, self.evaluations, self.stopped = [], [], 0, "generations"

    def fitness(self, ga, genes, _rows):
        """PyGAD's fitness, minus the objective, of the whole population; elites keep theirs."""
        if self.known is None:
            score = self._evaluate(genes)
        else:
            score = self.known
            score[self.children] = self._evaluate(genes[self.children])
        finite = score[np.isfinite(score)]
        self.best.append(float(finite.min()) if finite.size else np.inf)
        self.mean.append(float(finite.mean()) if finite.size else np.inf)
        return -score

    def crossover(self, _parents, _shape, ga):
        """MATLAB's step: migration if it is due, then elites, crossover children and mutants of every island."""
        settings, rng = self.settings, ga.numpy_random_generator
        population, score = ga.population, -ga.last_generation_fitness
        if islands.is_due(ga.generations_completed, settings.migration_interval, len(self.rows)):
            population, score = islands.migrate(population, score, self.rows, settings.migration_fraction)
        generation = ga.generations_completed + 1
        sigma = operators.mutation_sigma(
            generation, settings.generations, settings.mutation_scale, settings.mutation_shrink
        )
        uniform, normal = rng.random_sample(self.uniforms), rng.standard_normal(self.normals)
        population, self.known = operators.next_population(population, score, self.plan, uniform, normal, sigma)
        return population

    def on_generation(self, ga):
        """Tell PyGAD to stop where the best objective has stalled."""
        last = ga.generations_completed == self.settings.generations
        if not last and has_stalled(self.best, self.settings.stall_generations, self.settings.stall_tolerance):
            self.stopped = "stalled"
            return "stop"
        return None

    def result(self, ga):
        """The GeneticResult of a finished run."""
        genes, fitness, _ = ga.best_solution(ga.last_generation_fitness)
        return GeneticResult(
            deviations=self._decode(genes),
            objective=float(-fitness),
            generations=int(ga.generations_completed),
            evaluations=self.evaluations,
            stopped=self.stopped,
            best_history=np.array(self.best),
            mean_history=np.array(self.mean),
        )

    def _decode(self, genes):
        """Error vectors of genes in 0..1; rounding must not lead beyond the upper bound."""
        return np.minimum(self.low + genes * self.span, self.high)

    def _evaluate(self, genes):
        """Objective (m,) of genes (m, p), counted."""
        score = np.asarray(self.objective(self._decode(genes)), dtype=float)
        if score.shape != (len(genes),) or np.isnan(score).any():
            raise FitError(
                f"the objective of {len(genes)} individuals has shape {score.shape} or holds NaN; allowed: a number or inf each"
            )
        self.evaluations += len(genes)
        return score


def _pass_through(_fitness, count, ga):
    """PyGAD's selection hook, unused: the first individuals, not copied."""
    return ga.population[:count], np.arange(count)


def _is(value, kind):
    """Whether the value is a number of the kind; a truth value is not a number."""
    return isinstance(value, kind) and not isinstance(value, bool)


def _check(name, value, kind, lowest, highest, allowed):
    """Raise ConfigError where the value of a setting is not a finite number of its kind within its range."""
    if not _is(value, kind) or not np.isfinite(value) or not lowest <= value <= highest:
        raise ConfigError(f"{name} is {value!r}; allowed: {allowed}")
