"""PyGAD's genetic algorithm with its own operators: another reading of the paper.

The paper's settings are used: stochastic universal selection, a population of the stated size, genes in 0..1, and its
"crossover probability" as PyGAD's, the probability that a parent mates. Everything else is PyGAD's default:
single-point crossover, random mutation of a tenth of the genes (at least one), one elite. PyGAD has neither islands
nor migration. Here each island is an instance of its own. They migrate as MATLAB's do, between runs of as many
generations as the migration interval: PyGAD continues where it stopped when it is run again.
"""

import logging
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray
from rrru.errors import ConfigError, FitError
from rrru.genetic import operators
from rrru.genetic.plan import Bounds, make_plan, migrants_of, migrate
from rrru.genetic.result import GeneticResult, means
from rrru.genetic.settings import GeneticSettings, Objective

# PyGAD logs every exception before raising it again; the exception is enough
_LOGGER = logging.getLogger(__name__)
_LOGGER.addHandler(logging.NullHandler())
_LOGGER.propagate = False


def run(objective: Objective, bounds: Bounds, settings: GeneticSettings, seed: int) -> GeneticResult:
    """GeneticResult of an objective, see `algorithm.minimise`, within Bounds.

    Stalled is PyGAD's "saturate": the best objective stayed the same. Raises FitError where no individual is feasible,
    and ConfigError where PyGAD is not installed.
    """
    islands = [_Island(objective, bounds, settings, size, seed + k) for k, size in enumerate(settings.populations)]
    stall, rows = settings.stall_generations, make_plan(settings.populations, settings.elite_share, 1.0)
    migrants = migrants_of(settings.populations, settings.migration_fraction)
    stretch = settings.generations if len(islands) == 1 else settings.migration_interval
    while (done := islands[0].done) < settings.generations:
        if done:
            population = np.concatenate([island.ga.population for island in islands])
            score = np.concatenate([-island.ga.last_generation_fitness for island in islands])
            arrived, _ = migrate(population, score, rows, migrants)
            for island, (start, stop) in zip(islands, rows[:, :2], strict=True):
                island.ga.population = arrived[start:stop]
        for island in islands:
            island.advance(min(stretch, settings.generations - done))
        result = _joined(islands, bounds)
        stopped = result.stalled(stall, 0.0)
        if stopped.generations < settings.generations and stopped.stopped == "stalled":
            return stopped
    return result


def _pygad() -> Any:
    """The library, which only this reading of the paper needs."""
    try:
        import pygad
    except ImportError as error:
        allowed = "another entry of genetic.operators, or pip install 'rrru[genetic]'"
        raise ConfigError(f"genetic.operators is pygad, which is not installed; allowed: {allowed}") from error
    return pygad


class _Island:
    """One PyGAD instance and its histories, from the initial population on."""

    def __init__(self, objective: Objective, bounds: Bounds, settings: GeneticSettings, size: int, seed: int) -> None:
        self.objective, self.bounds, self.asked = objective, bounds, 0
        self.genes: list[FloatArray] = []
        self.scores: list[FloatArray] = []
        self.rated: list[int] = []
        # the only island may stop by itself
        alone = len(settings.populations) == 1 and settings.stall_generations
        self.ga = _pygad().GA(
            num_generations=1,
            # ASSUME PyGAD has no default: as many parents as there are places
            num_parents_mating=size,
            fitness_func=self._fitness,
            fitness_batch_size=size,
            sol_per_pop=size,
            num_genes=bounds.low.size,
            init_range_low=0.0,
            init_range_high=1.0,
            parent_selection_type="sus",
            crossover_probability=settings.crossover_fraction,
            # a mutated gene is drawn anew from the whole range
            mutation_by_replacement=True,
            random_mutation_min_val=0.0,
            random_mutation_max_val=1.0,
            stop_criteria=f"saturate_{settings.stall_generations}" if alone else None,
            on_generation=self._note,
            suppress_warnings=True,
            random_seed=seed % 2**32,
            logger=_LOGGER,
        )
        self._keep(self.ga.population, self.ga.cal_pop_fitness())
        # PyGAD rates its first population again when it is run
        self.asked = 0

    @property
    def done(self) -> int:
        """Generations done."""
        return len(self.scores) - 1

    def advance(self, generations: int) -> None:
        """Run so many generations more."""
        self.ga.num_generations = generations
        try:
            self.ga.run()
        except ValueError as error:
            raise FitError(f"PyGAD's selection: {error}") from error

    def _fitness(self, _ga: Any, genes: FloatArray, _rows: Any) -> FloatArray:
        """PyGAD's fitness, minus the objective, of a batch."""
        self.asked += len(genes)
        return -self.objective(operators.decoded(np.asarray(genes, dtype=float), self.bounds))

    def _note(self, ga: Any) -> None:
        """Keep a generation."""
        self._keep(ga.population, ga.last_generation_fitness)

    def _keep(self, population: FloatArray, fitness: npt.ArrayLike) -> None:
        """Keep the best individual, all scores and the number of evaluations so far."""
        score = -np.asarray(fitness, dtype=float)
        self.genes.append(population[score.argmin()].copy())
        self.scores.append(score)
        self.rated.append(self.asked)


def _joined(islands: Sequence[_Island], bounds: Bounds) -> GeneticResult:
    """The islands' histories as one GeneticResult."""
    scores = np.stack([np.concatenate(row) for row in zip(*(island.scores for island in islands), strict=True)])
    best = np.stack([[row.min() for row in island.scores] for island in islands])
    genes = np.stack([island.genes for island in islands])[best.argmin(axis=0), np.arange(len(scores))]
    return GeneticResult(
        stopped="generations",
        found=operators.decoded(genes, bounds),
        best_history=best.min(axis=0),
        mean_history=means(scores),
        asked=np.sum([island.rated for island in islands], axis=0),
    )
