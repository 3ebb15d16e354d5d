"""Operators of the genetic algorithm that the paper used (MATLAB `ga`), as pure array functions.

Scores are minimised; `inf` marks an infeasible individual. Genes lie in 0..1. Random numbers are drawn outside and
handed in, so that the same numbers give the same children. Sources: Global Optimization Toolbox, "Genetic Algorithm
Options" and "How the Genetic Algorithm Works"; J. E. Baker, "Reducing bias and inefficiency in the selection
algorithm", ICGA 1987 (stochastic uniform selection).
"""

import math

import numba
import numpy as np

SURVIVAL_RATE = (
    2.0  # expected number of the best individual's places over the average's ("shift linear" scaling's default)
)

_compiled = numba.njit(cache=True, error_model="numpy")


def elite_count(size, share):
    """Number of elites in a population of `size` individuals: ceil(share size), float noise in the product removed."""
    return math.ceil(round(share * size, 9))


def child_counts(size, elites, crossover_fraction):
    """Numbers of children by crossover (the fraction, rounded half up, of the places that the elites leave) and by
    mutation (the rest).
    """
    places = size - elites
    crossed = math.floor(round(crossover_fraction * places, 9) + 0.5)
    return crossed, places - crossed


@_compiled
def shift_linear(score, parents):
    """Expected numbers of places, shape (n,), of individuals with scores (n,) among `parents` parents ("shift linear"
    scaling).

    Affine in the score, with mean d = parents / n over the feasible individuals; the best gets SURVIVAL_RATE d, unless
    the worst would fall below zero: then the worst gets zero. Where all scores are equal, or none is finite, everyone
    gets the same.
    """
    # ASSUME an infeasible individual (score not finite) gets no place as long as anyone is feasible, and does not enter
    # mean and extremes.
    n = score.size
    feasible = 0
    best, worst = np.inf, -np.inf
    for value in score:
        if np.isfinite(value):
            feasible += 1
            best, worst = min(best, value), max(worst, value)
    if feasible == 0:
        return np.full(n, parents / n)
    # differences to the best are exact for close scores, so that a population about to become equal keeps meaningful
    # expectations
    mean = 0.0
    for value in score:
        if np.isfinite(value):
            mean += (value - best) / feasible
    d = parents / feasible
    slope = 0.0
    if mean > 0.0:
        slope = d * (SURVIVAL_RATE - 1.0) / mean
        if d + slope * (mean - (worst - best)) < 0.0:
            slope = d / (worst - best - mean)
    expectation = np.zeros(n)
    for i in range(n):
        if np.isfinite(score[i]):
            expectation[i] = max(d + slope * (mean - (score[i] - best)), 0.0)
    return expectation


@_compiled
def stochastic_uniform(expectation, count, offset):
    """Indices, shape (count,), of parents: equal steps along a line of segments as long as the expectations (n,).

    `offset` in 0..1 is the first position in units of the step; nobody without expectation is taken.
    """
    last = expectation.size - 1
    while expectation[last] <= 0.0 and last > 0:
        last -= 1
    step = expectation.sum() / count
    chosen = np.empty(count, dtype=np.int64)
    index, reach = 0, expectation[0]
    for k in range(count):
        while reach <= (k + offset) * step and index < last:
            index += 1
            reach += expectation[index]
        chosen[k] = index
    return chosen


@_compiled
def shuffled(values, uniform):
    """The values, shape (n,), in an order drawn by n uniform numbers in 0..1 (Fisher and Yates)."""
    result = values.copy()
    for i in range(values.size - 1, 0, -1):
        j = int(uniform[i] * (i + 1))
        result[i], result[j] = result[j], result[i]
    return result


@_compiled
def scattered(population, parents, coin):
    """Children (k, p) of consecutive pairs among the parents' indices (2 k,), with a population of shape (n, p).

    A gene is the first parent's where coin (k, p) < 1/2, else the second's.
    """
    children = np.empty(coin.shape)
    for i in range(coin.shape[0]):
        for q in range(coin.shape[1]):
            children[i, q] = population[parents[2 * i] if coin[i, q] < 0.5 else parents[2 * i + 1], q]
    return children


@_compiled
def gaussian(population, parents, step):
    """Mutants (k, p) of the parents' indices (k,) in a population (n, p), every gene moved by step (k, p) and folded
    back into 0..1.
    """
    # ASSUME the paper names neither its mutation nor its bounds. MATLAB's Gaussian mutation knows no bounds, and its
    # default with bounds ("adaptive feasible") is another operator. Genes are reflected at the bounds: with steps of
    # one range, clipping would put nearly two of three mutated genes exactly onto a bound, finds worse minima, and
    # makes "at the bound" meaningless as the sign of a bad fit.
    children = np.empty(step.shape)
    for i in range(step.shape[0]):
        for q in range(step.shape[1]):
            folded = abs(population[parents[i], q] + step[i, q]) % 2.0
            children[i, q] = 2.0 - folded if folded > 1.0 else folded
    return children


def mutation_sigma(generation, generations, scale, shrink):
    """Standard deviation of the mutation, in units of the range, in generation g = 1..generations: scale (1 - shrink g
    / generations).
    """
    return scale * (1.0 - shrink * generation / generations)


def draws_needed(plan, genes):
    """Numbers of uniform and of normal random numbers that `next_population` takes for a plan (islands, 4) and `genes`
    genes.
    """
    crossed = plan[:, 3]
    mutated = plan[:, 1] - plan[:, 0] - plan[:, 2] - crossed
    return int((1 + 2 * crossed + mutated + crossed * genes).sum()), int((mutated * genes).sum())


@_compiled
def next_population(population, score, plan, uniform, normal, sigma):
    """Next population (n, p) and what is known of its scores (n,): the elites' scores, NaN for the children.

    population: (n, p), islands one after the other; score: (n,); plan: (islands, 4) whole numbers, first row, row after
    the last, elites, children by crossover; uniform, normal: random numbers, see `draws_needed`; sigma: of the
    mutation. Each island's rows are its elites (best first), its crossover children, its mutants; all parents are
    selected at once, shuffled, and the first taken in pairs.
    """
    genes = population.shape[1]
    children = np.empty(population.shape)
    known = np.full(score.size, np.nan)
    u, g = 0, 0
    for island in range(plan.shape[0]):
        start, stop, elites, crossed = plan[island]
        mutated = stop - start - elites - crossed
        count = 2 * crossed + mutated
        here, here_score = population[start:stop], score[start:stop]
        if elites > 0:
            rank = np.argsort(here_score, kind="mergesort")
            for i in range(elites):
                children[start + i] = here[rank[i]]
                known[start + i] = here_score[rank[i]]
        if count > 0:
            parents = shuffled(
                stochastic_uniform(shift_linear(here_score, count), count, uniform[u]), uniform[u + 1 : u + 1 + count]
            )
            u += 1 + count
            coin = uniform[u : u + crossed * genes].reshape(crossed, genes)
            u += crossed * genes
            children[start + elites : start + elites + crossed] = scattered(here, parents, coin)
            step = sigma * normal[g : g + mutated * genes].reshape(mutated, genes)
            g += mutated * genes
            children[start + elites + crossed : stop] = gaussian(here, parents[2 * crossed :], step)
    return children, known
