"""The paper's genetic algorithm (MATLAB `ga`) on PyGAD: PyGAD keeps the loop, the random state and the callbacks.

PyGAD's own hooks cannot express MATLAB's step, which needs more parents than a population has members, and whose
crossover *fraction* splits the children between crossover and mutation. So PyGAD's selection passes through, its
mutation is off, it keeps neither parents nor elites, and its crossover callable returns the whole next population of
all islands: that after a block of MATLAB's generations, since one of PyGAD's costs several times what the step does.
"""

import logging
from dataclasses import dataclass
from numbers import Integral

import numpy as np
import pandas as pd
import pygad

from rrru.errors import ConfigError, FitError
from rrru.genetic import operators
from rrru.genetic.plan import Box, draws_needed, make_rules, mutation_sigma
from rrru.genetic.settings import is_number
from rrru.robots.compiled import CompiledObjective

# MATLAB's generations in one of PyGAD's: enough to make PyGAD's cost negligible, few enough to stay in the cache
BLOCK = 100

# PyGAD logs every exception before raising it again; the exception is enough
_LOGGER = logging.getLogger(f"{__name__}.pygad")
_LOGGER.addHandler(logging.NullHandler())
_LOGGER.propagate = False


@dataclass(frozen=True)
class GeneticResult:
    """What one run found.

    deviations: (p,) the best individual; objective: its objective, inf if none was feasible; generations: done;
    evaluations: individuals whose objective was needed (elites and migrants keep theirs); stopped: "generations" or
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

    def row(self):
        """Objective, counts and reason to stop, by the tables' names."""
        counts = {"generations": self.generations, "evaluations": self.evaluations, "stopped": self.stopped}
        return {"objective_mm": self.objective} | counts

    def history(self):
        """Frame of the convergence: every generation up to 100, every 10th after it, and the last."""
        every = np.arange(self.generations + 1)
        kept = every[(every <= 100) | (every % 10 == 0) | (every == self.generations)]
        return pd.DataFrame(
            {"generation": kept, "best_mm": self.best_history[kept], "mean_mm": self.mean_history[kept]}
        )


def minimise(objective, low, high, settings, seed):
    """Minimum of an objective within bounds by the genetic algorithm.

    objective: callable, vectors (m, p) to values (m,), inf where infeasible; a CompiledObjective is called without
    Python and not asked again for a child that equals an individual of the last population. low, high: bounds (p,),
    finite, low < high; seed: whole number in 0..2^32 - 1, handed to PyGAD as it is. Returns a GeneticResult; the same
    seed gives the same bytes, since every draw comes from PyGAD's own generator. Raises ConfigError for bounds or a
    seed that are not allowed and FitError where the objective returns NaN or a wrong number of values.
    """
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    vectors = low.ndim == 1 and low.size and low.shape == high.shape
    if not (vectors and np.isfinite(high - low).all() and (low < high).all()):
        raise ConfigError(f"bounds are {low} and {high}; allowed: two vectors of one length, finite, low < high")
    if not is_number(seed, Integral) or not 0 <= seed < 2**32:
        raise ConfigError(f"seed is {seed!r}; allowed: a whole number in 0..{2**32 - 1}")
    run = _Run(objective, low, high, settings)
    size = sum(settings.populations)
    ga = _BatchGA(
        num_generations=-(-int(settings.generations) // BLOCK),
        num_parents_mating=1,
        fitness_func=run.fitness,
        fitness_batch_size=size,
        sol_per_pop=size,
        num_genes=low.size,
        init_range_low=0.0,
        init_range_high=1.0,
        parent_selection_type=_pass_through,
        keep_parents=0,
        keep_elitism=0,
        crossover_type=run.crossover,
        mutation_type=None,
        on_generation=run.on_generation,
        suppress_warnings=True,
        random_seed=int(seed),
        logger=_LOGGER,
    )
    ga.run()
    return run.result(ga)


class _BatchGA(pygad.GA):
    """PyGAD's loop with the two public methods that visit every individual in Python replaced by array forms."""

    def cal_pop_fitness(self):
        """Fitness of the whole population, shape (n,), in one call."""
        return self.fitness_func(self, self.population, None)

    def best_solution(self, pop_fitness=None):
        """Best individual, its fitness and its row."""
        fitness = self.cal_pop_fitness() if pop_fitness is None else pop_fitness
        row = int(np.argmax(fitness))
        return self.population[row].copy(), fitness[row], row


class _Run:
    """One run behind the callables that PyGAD is given; each of PyGAD's generations is a block of MATLAB's."""

    def __init__(self, objective, low, high, settings):
        self.objective, self.box, self.settings = objective, Box(low, high), settings
        self.rules = make_rules(settings, looks_up=isinstance(objective, CompiledObjective))
        self.draws = draws_needed(self.rules.plan, low.size)
        self.score, self.done, self.stopped = None, 0, "generations"
        self.best = np.empty(int(settings.generations) + 1)
        self.mean = [np.empty(0)]

    def fitness(self, _ga, genes, _rows):
        """PyGAD's fitness, minus the objective, of the whole population."""
        if self.score is None:
            self.score = np.empty(len(genes))
            self._rate(operators.decoded(genes, self.box), None, None, self.score)
            self.best[0] = self.score.min()
            self.mean.append(_means(self.score[None]))
        return -self.score

    def crossover(self, _parents, _shape, ga):
        """A block of MATLAB's generations: migration if due, elites, crossover children and mutants of all islands."""
        draws = self._draw(ga.numpy_random_generator)
        populations = np.empty((len(draws[2]) + 1, *ga.population.shape))
        scores = np.empty(populations.shape[:2])
        populations[0], scores[0] = ga.population, self.score
        if self.rules.looks_up:
            advance, objective = operators.advance, (self.objective.kernel, self.objective.legs, self.objective.points)
        else:
            advance, objective = operators.advance.py_func, (self._rate, None, None)
        count = advance(*objective, self.box, self.rules, draws, self.done, populations, scores, self.best)
        self.done += count
        self.score = scores[count]
        self.mean.append(_means(scores[1 : count + 1]))
        stall = self.rules.stall_generations, self.rules.stall_tolerance
        if self.done < self.settings.generations and operators.has_stalled(self.best[: self.done + 1], *stall):
            self.stopped = "stalled"
        return populations[count]

    def on_generation(self, _ga):
        """Tell PyGAD to stop where the best objective has stalled."""
        return "stop" if self.stopped == "stalled" else None

    def result(self, ga):
        """The GeneticResult of a finished run."""
        genes, fitness, _ = ga.best_solution(ga.last_generation_fitness)
        children = ga.sol_per_pop - self.rules.plan[:, 2].sum()
        return GeneticResult(
            deviations=operators.decoded(genes[None], self.box)[0],
            objective=float(-fitness),
            generations=self.done,
            evaluations=int(ga.sol_per_pop + self.done * children),
            stopped=self.stopped,
            best_history=self.best[: self.done + 1],
            mean_history=np.concatenate(self.mean),
        )

    def _draw(self, rng):
        """Random numbers and the mutation's sigma of the next block, in the order of single generations."""
        settings = self.settings
        following = range(self.done + 1, min(self.done + BLOCK, settings.generations) + 1)
        uniform, normal = (np.empty((len(following), number)) for number in self.draws)
        for k in range(len(following)):
            uniform[k], normal[k] = rng.random_sample(self.draws[0]), rng.standard_normal(self.draws[1])
        scale = settings.mutation_scale, settings.mutation_shrink
        sigma = [mutation_sigma(generation, settings.generations, *scale) for generation in following]
        return uniform, normal, np.array(sigma)

    def _rate(self, deviations, _legs, _points, values):
        """The objective as `operators.advance` calls it."""
        score = np.asarray(self.objective(deviations), dtype=float)
        if score.shape != values.shape or np.isnan(score).any():
            raise FitError(
                f"the objective of {len(values)} individuals has shape {score.shape} or holds NaN; "
                "allowed: a number or inf each"
            )
        values[:] = score


def _means(scores):
    """Mean over the feasible individuals of each row (k,) of scores (k, n), inf where nobody is feasible."""
    feasible = np.isfinite(scores)
    if feasible.all():
        return scores.mean(axis=1)
    rows = zip(scores, feasible, strict=True)
    return np.array([row[finite].mean() if finite.any() else np.inf for row, finite in rows])


def _pass_through(_fitness, count, ga):
    """PyGAD's selection hook, unused: the first individuals, not copied."""
    return ga.population[:count], np.arange(count)
