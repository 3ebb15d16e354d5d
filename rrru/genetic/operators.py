"""Operators of the genetic algorithm that the paper used (MATLAB `ga`) as array functions, and its generations.

Scores are minimised; `inf` marks an infeasible individual. Genes are in 0..1. Random numbers are drawn outside and
passed in, so that the same numbers give the same children. All islands of a population are in one array, one after the
other; see `plan.make_plan` for `plan`. All compiled code is in this one file, since numba's cache does not see changes
of another. Sources: Global Optimization Toolbox, "Genetic Algorithm Options" and "How the Genetic Algorithm
Works"; J. E. Baker, "Reducing bias and inefficiency in the selection algorithm", ICGA 1987 (stochastic uniform).
"""

from typing import Any

import numpy as np

from rrru.arrays import FloatArray, IntArray
from rrru.genetic.plan import Bounds, Rules
from rrru.kinematics.typed_numba import njit

# expected number of the best individual's places over the average's ("shift linear" scaling's default)
SURVIVAL_RATE = 2.0
# adaptive feasible mutation's steps, in units of the range: roots of a mesh between 1 and the constraint tolerance 1e-3
LARGEST_STEP, SMALLEST_STEP = 1.0, 1e-3**0.5

_compiled = njit(cache=True, error_model="numpy")


@_compiled
def shift_linear(score: FloatArray, parents: int) -> FloatArray:
    """Expected numbers of places (n,) of individuals with scores (n,) among `parents` parents ("shift linear" scaling).

    Affine in the score, with mean d = parents / n over the feasible individuals; the best gets SURVIVAL_RATE d, unless
    the worst would fall below zero: then the worst gets zero. Where all scores are equal, or none is finite, everyone
    gets the same.
    """
    # ASSUME an infeasible individual (score inf) gets no place while another is feasible, nor enters mean and extremes.
    n = score.size
    feasible = 0
    best, worst = np.inf, -np.inf
    for value in score:
        if np.isfinite(value):
            feasible += 1
            best, worst = min(best, value), max(worst, value)
    if feasible == 0:
        return np.full(n, parents / n)
    # differences to the best are exact for close scores, so that a population about to become equal keeps its order
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
def stochastic_uniform(expectation: FloatArray, count: int, offset: float) -> IntArray:
    """Indices, shape (count,), of parents: equal steps along a line of segments as long as the expectations (n,).

    `offset` in 0..1 is the first position in units of the step; no individual without expectation is chosen.
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
def shuffled(values: IntArray, uniform: FloatArray) -> IntArray:
    """The values, shape (n,), in an order drawn by n uniform numbers in 0..1 (Fisher and Yates)."""
    result = values.copy()
    for i in range(values.size - 1, 0, -1):
        j = int(uniform[i] * (i + 1))
        result[i], result[j] = result[j], result[i]
    return result


@_compiled
def scattered(population: FloatArray, parents: IntArray, coin: FloatArray, children: FloatArray) -> None:
    """Write children (k, p) of consecutive pairs among the parents' indices (2 k,), with a population of shape (n, p).

    A gene is the first parent's where coin (k, p) < 1/2, else the second's.
    """
    for i in range(coin.shape[0]):
        for q in range(coin.shape[1]):
            children[i, q] = population[parents[2 * i] if coin[i, q] < 0.5 else parents[2 * i + 1], q]


@_compiled
def gaussian(population: FloatArray, parents: IntArray, step: FloatArray, mutants: FloatArray) -> None:
    """Write mutants (k, p) of parents' indices (k,) in a population (n, p): moved by step (k, p), folded to 0..1."""
    # ASSUME MATLAB's Gaussian mutation knows no bounds. Reflected there: with steps of one range, clipping would put
    # most mutated genes onto a bound, and finds worse minima.
    for i in range(step.shape[0]):
        for q in range(step.shape[1]):
            folded = abs(population[parents[i], q] + step[i, q]) % 2.0
            mutants[i, q] = 2.0 - folded if folded > 1.0 else folded


@_compiled
def feasible(population: FloatArray, parents: IntArray, steps: FloatArray, mutants: FloatArray) -> None:
    """Write mutants (k, p) of parents' indices (k,): moved by the first of steps (k, t, p) that stays in 0..1.

    A parent for which none does is copied.
    """
    for i in range(len(steps)):
        parent = population[parents[i]]
        mutants[i] = parent
        for step in steps[i]:
            if ((parent + step >= 0.0) & (parent + step <= 1.0)).all():
                mutants[i] = parent + step
                break


@_compiled
def adapted(size: float, best: FloatArray, generation: int) -> float:
    """Size of the steps to a generation, from `size` to the one before: doubled after a better one, else halved."""
    if generation <= 2:
        return LARGEST_STEP
    better = best[generation - 1] < best[generation - 2]
    return min(2.0 * size, LARGEST_STEP) if better else max(0.5 * size, SMALLEST_STEP)


@_compiled
def ranked(score: FloatArray) -> IntArray:
    """Indices (n,) of scores (n,) from the best to the worst, stable; NumPy's sort takes seconds to compile."""
    order = np.arange(score.size)
    for i in range(1, score.size):
        k, inserted = i, order[i]
        while k > 0 and score[order[k - 1]] > score[inserted]:
            order[k] = order[k - 1]
            k -= 1
        order[k] = inserted
    return order


@_compiled
def next_population(
    population: FloatArray,
    score: FloatArray,
    plan: IntArray,
    draws: tuple[FloatArray, FloatArray, float],
    children: FloatArray,
    known: FloatArray,
) -> None:
    """Write the next population to children (n, p) and what is known of its scores (n,): the elites', else NaN.

    draws: uniform random numbers and moves (mutants, t, p), see `plan`, and the moves' size. Each island's rows are its
    elites (best first), crossover children and mutants; all parents are selected at once, shuffled, first in pairs.
    """
    uniform, moves, size = draws
    genes = population.shape[1]
    known[:] = np.nan
    u, g = 0, 0
    for island in range(plan.shape[0]):
        start, stop, elites, crossed = plan[island]
        first = start + elites + crossed
        mutated = stop - first
        count = 2 * crossed + mutated
        members, member_score = population[start:stop], score[start:stop]
        rank = ranked(member_score)
        for i in range(elites):
            children[start + i] = members[rank[i]]
            known[start + i] = member_score[rank[i]]
        chosen = stochastic_uniform(shift_linear(member_score, count), count, uniform[u])
        parents = shuffled(chosen, uniform[u + 1 : u + 1 + count])
        u += 1 + count
        coin = uniform[u : u + crossed * genes].reshape(crossed, genes)
        u += crossed * genes
        scattered(members, parents, coin, children[start + elites : first])
        steps = size * moves[g : g + mutated]
        g += mutated
        if moves.shape[1] == 1:
            gaussian(members, parents[2 * crossed :], steps[:, 0], children[first:stop])
        else:
            feasible(members, parents[2 * crossed :], steps, children[first:stop])


@_compiled
def look_up(children: FloatArray, known: FloatArray, population: FloatArray, score: FloatArray) -> None:
    """Give children that equal an individual of the population (n, p) its score, in place."""
    for i in range(len(children)):
        k = 0
        while np.isnan(known[i]) and k < len(population):
            q = 0
            while q < children.shape[1] and children[i, q] == population[k, q]:
                q += 1
            if q == children.shape[1]:
                known[i] = score[k]
            k += 1


@_compiled
def decoded(genes: FloatArray, bounds: Bounds) -> FloatArray:
    """Parameters of genes in 0..1; rounding must not lead beyond the upper bound."""
    return np.minimum(bounds.low + genes * (bounds.high - bounds.low), bounds.high)


@_compiled
def has_stalled(best: FloatArray, stall_generations: int, tolerance: float) -> bool:
    """Whether the best objective's average relative change over the last `stall_generations` = S is <= tolerance.

    best: best objective of the initial population and after each of g generations. With f_k after generation k the
    test is (1 / S) sum over k = g - S + 1 .. g of |f_k - f_(k-1)| / max(1, |f_g|) <= tolerance, g >= S > 0. Elites
    survive, so the sum is f_(g-S) - f_g. MATLAB stops (since R2014a) on the "average relative change in the best
    fitness function value over MaxStallGenerations"; older versions weighted the changes by powers of 1/2.
    """
    # ASSUME "relative" is to max(1, |f_g|), as in MATLAB's other relative tolerances: absolute, in mm, below 1 mm.
    if stall_generations == 0 or best.size - 1 < stall_generations:
        return False
    before, now = best[-1 - stall_generations], best[-1]
    return bool((before - now) / stall_generations <= tolerance * max(1.0, abs(now)))


@_compiled
def advance(
    objective: Any,
    legs: FloatArray | None,
    points: FloatArray | None,
    bounds: Bounds,
    rules: Rules,
    draws: tuple[FloatArray, FloatArray, FloatArray],
    done: int,
    populations: FloatArray,
    scores: FloatArray,
    best: FloatArray,
) -> int:
    """Breed and rate as many generations as there are draws, fewer where the run stalls; returns their number.

    objective: writes the values (m,) of parameters (m, p), see `rrru.kinematics.compiled`; bounds, rules: see `plan`;
    draws: uniform (k, u), moves (k, mutants, t, p) and their sizes (k + 1,) of each generation and of the one before;
    adaptive ones are written; done: generations before. populations (k + 1, n, p) and scores (k + 1, n) start with the
    last generation, best (all generations + 1,) is written behind `done`.
    """
    uniform, moves, sizes = draws
    for k in range(len(uniform)):
        population, score, children, known = populations[k], scores[k], populations[k + 1], scores[k + 1]
        generation = done + k
        if rules.adaptive_mutation:
            sizes[k + 1] = adapted(sizes[k], best, generation + 1)
        next_population(population, score, rules.plan, (uniform[k], moves[k], sizes[k + 1]), children, known)
        if rules.reuses_scores:
            look_up(children, known, population, score)
        asked, count = np.empty_like(children), 0
        for i in range(len(known)):
            if np.isnan(known[i]):
                asked[count] = children[i]
                count += 1
        values = np.empty(count)
        objective(decoded(asked[:count], bounds), legs, points, values)
        best[generation + 1], count = np.inf, 0
        for i in range(len(known)):
            if np.isnan(known[i]):
                known[i] = values[count]
                count += 1
            best[generation + 1] = min(best[generation + 1], known[i])
        if has_stalled(best[: generation + 2], rules.stall_generations, rules.stall_tolerance):
            return k + 1
    return len(uniform)
