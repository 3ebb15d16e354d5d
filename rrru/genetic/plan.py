"""Numbers of elites, crossover children, mutants and migrants of each island, as MATLAB's `ga` has them."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rrru.arrays import FloatArray, IntArray

if TYPE_CHECKING:
    from rrru.genetic.settings import GeneticSettings


class Bounds(NamedTuple):
    """Bounds (p,) of the parameters."""

    low: FloatArray
    high: FloatArray


class Rules(NamedTuple):
    """Constants of a run.

    plan (islands, 4): see `make_plan`.
    stall_generations, stall_tolerance: stop criteria, as of GeneticSettings.
    adaptive_mutation: whether mutation adapts its steps.
    reuses_scores: whether a child equal to a member of the last population gets its score without an evaluation.
    """

    plan: IntArray
    stall_generations: int
    stall_tolerance: float
    adaptive_mutation: bool
    reuses_scores: bool


def elite_count(size: int, share: float) -> int:
    """Number of elites of `size` individuals: ceil(share size), without rounding errors of the product."""
    return math.ceil(round(share * size, 9))


def child_counts(size: int, elites: int, crossover_fraction: float) -> tuple[int, int]:
    """Numbers of children by crossover (the fraction of the non-elites, rounded half up) and by mutation."""
    places = size - elites
    crossed = math.floor(round(crossover_fraction * places, 9) + 0.5)
    return crossed, places - crossed


def migrant_count(fraction: float, first_size: int, second_size: int) -> int:
    """Number of migrants between two islands: the fraction of the smaller one's size, rounded half up."""
    return math.floor(round(fraction * min(first_size, second_size), 9) + 0.5)


def make_plan(populations: Sequence[int], elite_share: float, crossover_fraction: float) -> IntArray:
    """Plan (islands, 4) of islands of these sizes: first individual, last one + 1, elites, children by crossover.

    The rest of an island are mutants. Individuals are counted through all islands.
    """
    rows, start = [], 0
    for size in populations:
        elites = elite_count(size, elite_share)
        rows.append((start, start + size, elites, child_counts(size, elites, crossover_fraction)[0]))
        start += size
    return np.array(rows, dtype=np.int64)


def uniforms_needed(plan: IntArray, genes: int) -> int:
    """Number of uniform random numbers that `operators.next_population` takes for a plan (islands, 4) and p genes."""
    crossed = plan[:, 3]
    return int((1 + 2 * crossed + mutants_of(plan) + crossed * genes).sum())


def mutants_of(plan: IntArray) -> IntArray:
    """Numbers of mutants (islands,) of a plan (islands, 4)."""
    return plan[:, 1] - plan[:, 0] - plan[:, 2] - plan[:, 3]


def directions(generator: np.random.Generator, count: int, genes: int) -> FloatArray:
    """Directions (count, 2 p, p) that the mutants of adaptive feasible mutation try in this order; genes: p.

    Of each mutant both signs of the columns of a lower triangular matrix with 1 or -1 on its diagonal, coordinates and
    columns in random order. They span the space positively, as those of mesh adaptive direct search do (Audet and
    Dennis, SIAM Journal on Optimization 17, 2006, "LTMADS"), from which MATLAB's adaptive mutation is taken.
    """
    # ASSUME MATLAB's documentation says that "directions are adaptive with respect to the last successful or
    # unsuccessful generation" and "satisfy bounds"; the numbers are LTMADS': steps double or halve (a mesh four times
    # as wide or as fine), entries below the diagonal are even in -1..1 (there rounded to the mesh)
    sign = np.where(generator.random((count, genes)) < 0.5, -1.0, 1.0)
    below = np.tril(generator.uniform(-1.0, 1.0, (count, genes, genes)), -1)
    basis = (below + sign[:, :, None] * np.eye(genes)).transpose(0, 2, 1)
    coordinates = generator.random((count, 1, genes)).argsort(axis=2)
    order = generator.random((count, 2 * genes, 1)).argsort(axis=1)
    basis = np.take_along_axis(basis, coordinates, axis=2)
    return np.take_along_axis(np.concatenate([basis, -basis], axis=1), order, axis=1)


def migrants_of(populations: Sequence[int], fraction: float) -> IntArray:
    """Numbers of individuals (islands,) that leave each island for the next, the last for the first."""
    following = (*populations[1:], populations[0])
    return np.array([migrant_count(fraction, *pair) for pair in zip(populations, following, strict=True)])


def migrate(
    population: FloatArray, score: FloatArray, plan: IntArray, migrants: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Population (n, p) and scores (n,) after the best of each island were copied over the worst of the next.

    plan: see `make_plan`; migrants: (islands,), see `migrants_of`; they also stay where they were. Of equal
    scores the earlier is better.
    """
    # ASSUME all migrants leave before any arrives, so that no individual moves further than one island at a time.
    arrived, arrived_score = population.copy(), score.copy()
    ranks = [start + np.argsort(score[start:stop], kind="stable") for start, stop in plan[:, :2]]
    for source, count in enumerate(migrants if len(plan) > 1 else ()):
        target = ranks[(source + 1) % len(plan)]
        best, worst = ranks[source][:count], target[len(target) - count :]
        arrived[worst], arrived_score[worst] = population[best], score[best]
    return arrived, arrived_score


def mutation_sigma(generation: int, generations: int, scale: float, shrink: float) -> float:
    """Standard deviation of the mutation, in units of the range: scale (1 - shrink g / generations), g from 1."""
    return scale * (1.0 - shrink * generation / generations)


def make_rules(settings: "GeneticSettings", reuses_scores: bool) -> Rules:
    """Rules of GeneticSettings."""
    return Rules(
        make_plan(settings.populations, settings.elite_share, settings.crossover_fraction),
        int(settings.stall_generations),
        float(settings.stall_tolerance),
        settings.operators == "matlab_adaptive",
        reuses_scores,
    )
