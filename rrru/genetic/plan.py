"""Plan of an evolution: elites, crossover children, mutants and migrants of each island (MATLAB `ga`)."""

import math
from typing import NamedTuple

import numpy as np


class Box(NamedTuple):
    """Bounds (p,) of the parameters."""

    low: np.ndarray
    high: np.ndarray


class Rules(NamedTuple):
    """Constants of a run: plan of the islands, stop criteria, operators of a generation.

    adapts: whether mutation adapts its steps; looks_up: whether a child equal to one of the last population has its
    score.
    """

    plan: np.ndarray
    stall_generations: int
    stall_tolerance: float
    adapts: bool
    looks_up: bool


def elite_count(size, share):
    """Number of elites in a population of `size` individuals: ceil(share size), float noise in the product removed."""
    return math.ceil(round(share * size, 9))


def child_counts(size, elites, crossover_fraction):
    """Numbers of children by crossover (the fraction of the non-elites, rounded half up) and by mutation."""
    places = size - elites
    crossed = math.floor(round(crossover_fraction * places, 9) + 0.5)
    return crossed, places - crossed


def migrant_count(fraction, first_size, second_size):
    """Number of migrants between two islands: the fraction of the smaller one's size, rounded half up."""
    return math.floor(round(fraction * min(first_size, second_size), 9) + 0.5)


def make_plan(populations, elite_share, crossover_fraction):
    """Plan (islands, 4) of islands of the given sizes."""
    rows, start = [], 0
    for size in populations:
        elites = elite_count(size, elite_share)
        rows.append((start, start + size, elites, child_counts(size, elites, crossover_fraction)[0]))
        start += size
    return np.array(rows, dtype=np.int64)


def uniforms_needed(plan, genes):
    """Number of uniform random numbers that `operators.next_population` takes, of a number of genes."""
    crossed = plan[:, 3]
    return int((1 + 2 * crossed + mutants_of(plan) + crossed * genes).sum())


def mutants_of(plan):
    """Numbers of mutants (islands,)."""
    return plan[:, 1] - plan[:, 0] - plan[:, 2] - plan[:, 3]


def directions(generator, count, genes):
    """Moves (count, 2 p, p) of adaptive feasible mutation, to be tried in their order, of numbers of mutants and genes.

    Both senses of the columns of a lower triangular matrix with 1 or -1 on its diagonal, all in random order: each
    mutant's moves span the space, as those of mesh adaptive direct search do (Audet and Dennis, SIAM Journal on
    Optimization 17, 2006, "LTMADS"), from which MATLAB's adaptive mutation is taken.
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


def migrants_of(populations, fraction):
    """Numbers of individuals (islands,) that leave each island for the next, the last for the first."""
    following = (*populations[1:], populations[0])
    return np.array([migrant_count(fraction, *pair) for pair in zip(populations, following, strict=True)])


def mutation_sigma(generation, generations, scale, shrink):
    """Standard deviation of the mutation, in units of the range: scale (1 - shrink g / generations), g from 1."""
    return scale * (1.0 - shrink * generation / generations)


def make_rules(settings, looks_up):
    """Rules of GeneticSettings."""
    return Rules(
        make_plan(settings.populations, settings.elite_share, settings.crossover_fraction),
        int(settings.stall_generations),
        float(settings.stall_tolerance),
        settings.operators == "matlab_adaptive",
        looks_up,
    )
