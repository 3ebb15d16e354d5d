"""The operators against exact loops, and the properties their sources promise."""

import itertools

import numpy as np
import pytest

from rrru.genetic import operators, plan
from tests.reference import matlab_ga

ULP = np.finfo(float).eps / 2.0
SCORES = {
    "spread": np.random.default_rng(0).uniform(0.5, 20.0, 30),
    "one far worse": np.r_[np.random.default_rng(1).uniform(0.5, 0.6, 29), 900.0],
    "one far better": np.r_[0.1, np.random.default_rng(2).uniform(5.0, 5.1, 29)],
    "ties": np.random.default_rng(3).integers(1, 4, 30).astype(float),
    "a few ulps apart": 0.5 + ULP * np.random.default_rng(4).integers(0, 3, 30),
    "one ulp, one better": np.r_[0.5, np.full(29, 0.5 + ULP)],
    "one ulp, one worse": np.r_[np.full(29, 0.5), 0.5 + ULP],
    "some infeasible": np.where(np.arange(30) % 4 == 1, np.inf, np.random.default_rng(5).uniform(0.5, 20.0, 30)),
    "one feasible": np.r_[np.full(29, np.inf), 3.0],
    "all equal": np.full(30, 0.5115),
    "none feasible": np.full(30, np.inf),
    "two": np.array([1.0, 2.0]),
}


def test_counts_are_those_that_matlab_makes_of_thirty():
    # Toolbox documentation: elites ceil(0.05 size), crossover children round(fraction (size - elites))
    assert plan.elite_count(30, 0.05) == 2
    crossed = [plan.child_counts(30, 2, tenths / 10)[0] for tenths in range(1, 11)]
    assert crossed == [3, 6, 8, 11, 14, 17, 20, 22, 25, 28]
    assert plan.child_counts(30, 2, 1.0) == (28, 0)


@pytest.mark.parametrize("size", [2, 7, 10, 20, 30, 60, 140, 1001])
def test_counts_have_no_float_noise(size):
    for hundredths in range(101):
        elites, crossed, mutated = matlab_ga.counts(size, hundredths / 100)
        assert plan.elite_count(size, 0.05) == elites
        assert plan.child_counts(size, elites, hundredths / 100) == (crossed, mutated)


@pytest.mark.parametrize("scores", SCORES.values(), ids=SCORES)
@pytest.mark.parametrize("parents", [31, 50, 56])
def test_scaling_equals_exact_arithmetic(scores, parents):
    exact = np.array([float(value) for value in matlab_ga.expectation(scores, parents)])
    np.testing.assert_allclose(operators.shift_linear(scores, parents), exact, rtol=1e-12, atol=1e-12 * parents)


@pytest.mark.parametrize("scores", SCORES.values(), ids=SCORES)
def test_scaling_shares_out_all_places_to_the_better_first(scores):
    expectation = operators.shift_linear(scores, 50)
    assert expectation.sum() == pytest.approx(50.0, rel=1e-12)
    assert (expectation >= 0.0).all()
    assert (np.diff(expectation[np.argsort(scores, kind="stable")]) <= 0.0).all()


def test_scaling_gives_the_best_twice_the_average_unless_the_worst_would_fall_below_zero():
    flat = operators.shift_linear(np.array([1.0, 2.0, 3.0, 3.0, 3.0]), 10)
    assert flat.max() == pytest.approx(4.0)
    steep = operators.shift_linear(np.array([1.0, 1.0, 1.0, 1.0, 9.0]), 10)
    assert steep[-1] == 0.0
    assert steep.max() < 4.0


def test_scaling_knows_neither_unit_nor_origin_of_the_scores():
    scores = SCORES["spread"]
    np.testing.assert_allclose(
        operators.shift_linear(3.7 * scores + 11.0, 50), operators.shift_linear(scores, 50), rtol=1e-9
    )


def test_infeasible_individuals_change_nothing_for_the_others():
    scores = SCORES["some infeasible"]
    feasible = np.isfinite(scores)
    expectation = operators.shift_linear(scores, 50)
    assert (expectation[~feasible] == 0.0).all()
    np.testing.assert_allclose(expectation[feasible], operators.shift_linear(scores[feasible], 50), rtol=1e-12)


@pytest.mark.parametrize("scores", SCORES.values(), ids=SCORES)
@pytest.mark.parametrize("offset", [0.0, 0.37, 1.0 - ULP])
def test_selection_has_the_least_possible_spread(scores, offset):
    # Baker 1987: everyone is taken floor or ceil of the expected number of times
    expectation = operators.shift_linear(scores, 50)
    chosen = operators.stochastic_uniform(expectation, 50, offset)
    taken = np.bincount(chosen, minlength=len(scores))
    assert taken.sum() == 50
    assert (np.abs(taken - expectation) < 1.0 + 1e-9).all()
    assert (taken[expectation == 0.0] == 0).all()


def test_selection_takes_the_expected_number_on_average():
    expectation = operators.shift_linear(SCORES["spread"], 50)
    offsets = (np.arange(4000) + 0.5) / 4000
    taken = np.mean(
        [np.bincount(operators.stochastic_uniform(expectation, 50, offset), minlength=30) for offset in offsets], axis=0
    )
    np.testing.assert_allclose(taken, expectation, atol=2.0 / 4000)


@pytest.mark.parametrize("name", ["spread", "one far worse", "ties", "some infeasible"])
def test_selection_walks_the_line_like_the_loop(name):
    for offset in np.random.default_rng(6).uniform(size=10):
        expected = matlab_ga.select(matlab_ga.expectation(SCORES[name], 50), 50, offset)
        chosen = operators.stochastic_uniform(operators.shift_linear(SCORES[name], 50), 50, offset)
        assert chosen.tolist() == expected


def test_shuffle_makes_every_order_equally_often():
    random = np.random.default_rng(7)
    seen = {order: 0 for order in itertools.permutations(range(4))}
    for _ in range(24_000):
        seen[tuple(operators.shuffled(np.arange(4), random.uniform(size=4)).tolist())] += 1
    # 24 orders, 1000 each, standard deviation 31
    assert max(abs(count - 1000) for count in seen.values()) < 5 * 31


def test_shuffle_loses_nobody_at_the_edge_of_the_unit_interval():
    assert sorted(operators.shuffled(np.arange(56), np.full(56, 1.0 - ULP))) == list(range(56))
    assert sorted(operators.shuffled(np.arange(56), np.zeros(56))) == list(range(56))


def bred(operator, population, parents, numbers):
    """Children (k, p) of an operator that is given numbers of that shape."""
    children = np.empty(numbers.shape)
    operator(population, parents, numbers, children)
    return children


def test_scattered_children_take_each_gene_from_the_parent_the_coin_names():
    population = np.arange(12.0).reshape(4, 3)
    coin = np.array([[0.1, 0.9, 0.4], [0.9, 0.1, 0.6]])
    children = bred(operators.scattered, population, np.array([0, 3, 2, 2]), coin)
    assert children.tolist() == [[0.0, 10.0, 2.0], [6.0, 7.0, 8.0]]


def test_mutants_stay_inside_and_bounce_like_a_ball():
    random = np.random.default_rng(8)
    population, step = random.uniform(size=(50, 8)), 3.0 * random.normal(size=(50, 8))
    mutants = bred(operators.gaussian, population, np.arange(50), step)
    expected = np.vectorize(matlab_ga.bounce)(population + step)
    np.testing.assert_allclose(mutants, expected, atol=1e-14)
    assert mutants.min() >= 0.0
    assert mutants.max() <= 1.0


def test_mutation_moves_every_gene_by_the_standard_deviation_it_is_given():
    step = 0.02 * np.random.default_rng(9).normal(size=(5000, 2))
    moved = bred(operators.gaussian, np.full((1, 2), 0.5), np.zeros(5000, dtype=np.int64), step) - 0.5
    assert moved.std() == pytest.approx(0.02, rel=0.03)
    assert moved.mean() == pytest.approx(0.0, abs=0.001)


def test_reflection_keeps_an_even_spread_even_where_clipping_would_pile_up():
    # the uniform distribution is the stationary one of a symmetric step between mirrors
    random = np.random.default_rng(10)
    genes = bred(
        operators.gaussian, random.uniform(size=(20_000, 1)), np.arange(20_000), random.normal(size=(20_000, 1))
    )[:, 0]
    assert np.histogram(genes, bins=10, range=(0.0, 1.0))[0] == pytest.approx(np.full(10, 2000), abs=5 * 43)
    assert np.isin(genes, (0.0, 1.0)).sum() == 0


def test_mutation_shrinks_to_nothing_in_the_last_generation():
    assert plan.mutation_sigma(1400, 1400, 1.0, 1.0) == 0.0
    assert plan.mutation_sigma(700, 1400, 0.8, 0.5) == pytest.approx(0.6)
    assert plan.mutation_sigma(1400, 1400, 0.3, 0.0) == 0.3


@pytest.mark.parametrize("crossover_fraction", [0.0, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("sizes", [(30,), (12, 30, 5)])
def test_a_generation_equals_the_loop(crossover_fraction, sizes):
    random = np.random.default_rng(11)
    population, score = random.uniform(size=(sum(sizes), 8)), random.uniform(0.5, 9.0, sum(sizes))
    score[::5] = np.inf
    ends = np.cumsum(sizes)
    rows = np.array(
        [
            (end - size, end, *matlab_ga.counts(size, crossover_fraction)[:2])
            for size, end in zip(sizes, ends, strict=True)
        ]
    )
    uniform = random.uniform(size=plan.uniforms_needed(rows, 8))
    moves = random.normal(size=(plan.mutants_of(rows).sum(), 1, 8))
    after, known = np.empty_like(population), np.empty_like(score)
    operators.next_population(population, score, rows, (uniform, moves, 0.7), after, known)
    one_by_one, steps = iter(uniform.tolist()), iter(moves.ravel().tolist())
    for start, stop, _, _ in rows:
        people, scores = matlab_ga.generation(
            population[start:stop].tolist(),
            score[start:stop].tolist(),
            crossover_fraction,
            0.05,
            0.7,
            one_by_one,
            steps,
        )
        np.testing.assert_allclose(after[start:stop], people, rtol=0.0, atol=1e-14)
        np.testing.assert_array_equal(known[start:stop], [np.nan if value is None else value for value in scores])
    assert next(one_by_one, None) is None
    assert next(steps, None) is None


def test_ranks_are_those_of_a_stable_sort():
    generator = np.random.default_rng(4)
    for size in (1, 2, 9, 30):
        score = generator.integers(0, 4, size).astype(float)
        score[generator.random(size) < 0.2] = np.inf
        np.testing.assert_array_equal(operators.ranked(score), np.argsort(score, kind="stable"))
