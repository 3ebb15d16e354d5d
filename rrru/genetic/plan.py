"""How many individuals of each island survive, are crossed, mutate and migrate, and how far (MATLAB `ga`)."""

import math
from typing import NamedTuple

import numpy as np


class Box(NamedTuple):
    """Bounds (p,) of the parameters."""

    low: np.ndarray
    high: np.ndarray


class Rules(NamedTuple):
    """What stays the same in a run: plan and migrants of the islands, when they migrate, when the run stops."""

    plan: np.ndarray
    migrants: np.ndarray
    migration_interval: int
    stall_generations: int
    stall_tolerance: float
    looks_up: bool


def elite_count(size, share):
    """Number of elites in a population of `size` individuals: ceil(share size), float noise in the product removed."""
    return math.ceil(round(share * size, 9))


def child_counts(size, elites, crossover_fraction):
    """Numbers of children by crossover (the fraction of the elites' rest, rounded half up) and by mutation."""
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


def draws_needed(plan, genes):
    """Numbers of uniform and of normal random numbers that `operators.next_population` takes, of a number of genes."""
    crossed = plan[:, 3]
    mutated = plan[:, 1] - plan[:, 0] - plan[:, 2] - crossed
    return int((1 + 2 * crossed + mutated + crossed * genes).sum()), int((mutated * genes).sum())


def migrants_of(populations, fraction):
    """Numbers of individuals (islands,) that leave each island for the next, the last for the first."""
    following = (*populations[1:], populations[0])
    return np.array([migrant_count(fraction, *pair) for pair in zip(populations, following, strict=True)])


def mutation_sigma(generation, generations, scale, shrink):
    """Standard deviation of the mutation, in units of the range: scale (1 - shrink g / generations), g from 1."""
    return scale * (1.0 - shrink * generation / generations)


def make_rules(settings, looks_up):
    """Rules of GeneticSettings; looks_up: whether a child equal to one of the last population has its score."""
    return Rules(
        make_plan(settings.populations, settings.elite_share, settings.crossover_fraction),
        migrants_of(settings.populations, settings.migration_fraction),
        int(settings.migration_interval),
        int(settings.stall_generations),
        float(settings.stall_tolerance),
        looks_up,
    )
