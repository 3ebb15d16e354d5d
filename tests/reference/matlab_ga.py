"""One generation of MATLAB's `ga`, and a whole run of it, written as slowly and obviously as possible.

Scaling is done in exact fractions and by the textbook formula; everything else is loops over lists. The random numbers
are taken one by one from iterators, in the order: offset, shuffle, coins of the crossover children (uniform), steps of
the mutants (normal).
"""

import math
from fractions import Fraction

import numpy as np


def counts(size, crossover_fraction, elite_share=0.05):
    """Elites, crossover children, mutants; shares are read as the decimal numbers that they are written as."""
    elites = math.ceil(Fraction(str(elite_share)) * size)
    crossed = math.floor(Fraction(str(crossover_fraction)) * (size - elites) + Fraction(1, 2))
    return elites, crossed, size - elites - crossed


def expectation(scores, parents):
    """Shift linear scaling, as fractions: a s + b with s = -score; individuals with infinite score stand aside."""
    finite = [-Fraction(float(score)) for score in scores if math.isfinite(score)]
    if not finite:
        return [Fraction(parents, len(scores))] * len(scores)
    d = Fraction(parents, len(finite))
    mean = sum(finite) / len(finite)
    if max(finite) == mean:
        return [d if math.isfinite(score) else Fraction(0) for score in scores]
    a = d / (max(finite) - mean)
    b = d - a * mean
    if b + a * min(finite) < 0:
        a = d / (mean - min(finite))
        b = d - a * mean
    return [a * -Fraction(float(score)) + b if math.isfinite(score) else Fraction(0) for score in scores]


def select(expectations, parents, offset):
    """Stochastic uniform selection: whoever's segment holds the position, for each of the equally spaced positions."""
    step = sum(expectations) / Fraction(parents)
    chosen = []
    for k in range(parents):
        position, edge = (k + Fraction(offset)) * step, Fraction(0)
        for index, length in enumerate(expectations):
            if edge <= position < edge + length:
                chosen.append(index)
            edge += length
    return chosen


def shuffle(items, uniforms):
    """Fisher and Yates, from the end; one number is drawn for every item, the first item's is not used."""
    items, numbers = list(items), [next(uniforms) for _ in items]
    for i in reversed(range(1, len(items))):
        j = math.floor(numbers[i] * (i + 1))
        items[i], items[j] = items[j], items[i]
    return items


def bounce(gene):
    """A gene thrown back from the walls at 0 and 1 until it is between them."""
    while not 0.0 <= gene <= 1.0:
        gene = -gene if gene < 0.0 else 2.0 - gene
    return gene


def generation(people, scores, crossover_fraction, elite_share, sigma, uniforms, normals):
    """The next people of one island, and the scores that are known (None for children)."""
    elites, crossed, mutated = counts(len(people), crossover_fraction, elite_share)
    order = sorted(range(len(people)), key=lambda i: scores[i])
    parents = 2 * crossed + mutated
    chosen = shuffle(select(expectation(scores, parents), parents, next(uniforms)), uniforms)
    after, known = [people[i] for i in order[:elites]], [scores[i] for i in order[:elites]]
    for child in range(crossed):
        first, second = people[chosen[2 * child]], people[chosen[2 * child + 1]]
        after.append([a if next(uniforms) < 0.5 else b for a, b in zip(first, second, strict=True)])
        known.append(None)
    for mutant in range(mutated):
        after.append([bounce(gene + sigma * next(normals)) for gene in people[chosen[2 * crossed + mutant]]])
        known.append(None)
    return after, known


def migrate(people, scores, fraction):
    """Lists of islands after the best of each went, as copies, over the worst of the next."""
    after, after_scores = [list(island) for island in people], [list(island) for island in scores]
    for source in range(len(people)):
        target = (source + 1) % len(people)
        share = Fraction(str(fraction)) * min(len(people[source]), len(people[target]))
        best = sorted(range(len(people[source])), key=lambda i: scores[source][i])
        worst = sorted(range(len(people[target])), key=lambda i: scores[target][i])
        count = math.floor(share + Fraction(1, 2))
        for place, mover in zip(worst[len(worst) - count :], best[:count], strict=True):
            after[target][place], after_scores[target][place] = people[source][mover], scores[source][mover]
    return after, after_scores


def draws(settings, genes, seed, block):
    """The first people, then each generation's uniform and normal numbers, as they are drawn for whole blocks.

    A block ends after `block` generations, where islands migrate, and with the run.
    """
    random, several = np.random.default_rng(seed), len(settings.populations) > 1
    yield random.random((sum(settings.populations), genes)).tolist()
    shares = [counts(size, settings.crossover_fraction, settings.elite_share) for size in settings.populations]
    uniforms = sum(1 + 2 * crossed + mutated + crossed * genes for _, crossed, mutated in shares)
    normals = sum(mutated for _, _, mutated in shares) * genes
    done = 0
    while done < settings.generations:
        ends = [done + block, settings.generations]
        if several:
            ends.append((done // settings.migration_interval + 1) * settings.migration_interval)
        count = min(ends) - done
        yield from zip(random.random((count, uniforms)), random.standard_normal((count, normals)), strict=True)
        done += count


def run(objective, low, high, settings, seed, block=100):
    """Best objective of the initial population and after every generation; `settings` has the fields of
    GeneticSettings, no early stop.
    """
    numbers = draws(settings, len(low), seed, block)
    start = next(numbers)
    people = [[start.pop(0) for _ in range(size)] for size in settings.populations]

    def score_of(person):
        return float(objective(np.array([[a + x * (b - a) for a, b, x in zip(low, high, person, strict=True)]]))[0])

    scores = [[score_of(person) for person in island] for island in people]
    best = [min(min(island) for island in scores)]
    for number in range(1, settings.generations + 1):
        if number > 1 and (number - 1) % settings.migration_interval == 0 and len(people) > 1:
            people, scores = migrate(people, scores, settings.migration_fraction)
        uniforms, normals = (iter(part.tolist()) for part in next(numbers))
        sigma = settings.mutation_scale * (1.0 - settings.mutation_shrink * number / settings.generations)
        for island in range(len(people)):
            people[island], known = generation(
                people[island],
                scores[island],
                settings.crossover_fraction,
                settings.elite_share,
                sigma,
                uniforms,
                normals,
            )
            scores[island] = [score_of(p) if k is None else k for p, k in zip(people[island], known, strict=True)]
        assert next(uniforms, None) is None
        assert next(normals, None) is None
        best.append(min(min(island) for island in scores))
    return best
