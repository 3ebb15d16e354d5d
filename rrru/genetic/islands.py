"""Migration between the islands of a population, which are in one array, one after the other."""

import numpy as np


def migrate(population, score, plan, migrants):
    """Population (n, p) and scores (n,) after the best of each island were copied over the worst of the next.

    plan: see `plan.make_plan`; migrants: (islands,), see `plan.migrants_of`; they also stay where they were. Of equal
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
