"""Islands of the genetic algorithm: how a population is split, and what migrates between its parts (MATLAB `ga`,
direction "forward").

All islands live in one array, one after the other; scores are minimised.
"""

import math

import numpy as np


def rows_of(populations):
    """First row and row after the last of each island, shape (islands, 2), for islands of the given sizes."""
    ends = np.cumsum(np.asarray(populations, dtype=np.int64))
    return np.stack([ends - np.asarray(populations, dtype=np.int64), ends], axis=1)


def migrant_count(fraction, first_size, second_size):
    """Number of individuals that migrate between two islands: the fraction of the smaller one's size, rounded half
    up.
    """
    return math.floor(round(fraction * min(first_size, second_size), 9) + 0.5)


def is_due(generation, interval, islands):
    """Whether migration follows the given generation (counted from 1): every `interval` generations, and never with one
    island.
    """
    return islands > 1 and generation > 0 and generation % interval == 0


def migrate(population, score, rows, fraction):
    """Population (n, p) and scores (n,) after the best of each island were copied over the worst of the next, the last
    going to the first.

    population: (n, p); score: (n,), `inf` where infeasible; rows: (islands, 2), see `rows_of`. The migrants also stay
    where they were. Of equal scores the earlier row is the better. With one island nothing changes.
    """
    # ASSUME all migrants leave before any arrives, so that nothing travels further than one island at a time.
    arrived, arrived_score = population.copy(), score.copy()
    islands = len(rows)
    if islands < 2:
        return arrived, arrived_score
    ranks = [start + np.argsort(score[start:stop], kind="stable") for start, stop in rows]
    for source in range(islands):
        target = (source + 1) % islands
        count = migrant_count(fraction, len(ranks[source]), len(ranks[target]))
        leaving, replaced = ranks[source][:count], ranks[target][len(ranks[target]) - count :]
        arrived[replaced], arrived_score[replaced] = population[leaving], score[leaving]
    return arrived, arrived_score
