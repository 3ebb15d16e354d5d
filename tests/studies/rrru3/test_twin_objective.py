"""The objective of the twin's search against SciPy's distributions, its weights by hand, the nearest draw."""

import numpy as np
import pytest
from scipy.stats import norm
from scipy.stats import t as student

from rrru.studies.rrru3 import redraw, twin_objective
from rrru.studies.rrru3.paper import ERRORS_MM, printed_half_mm
from rrru.studies.rrru3.redraw import Draw
from rrru.studies.rrru3.schemas import TABLES

LIMIT = "spiral_under_lines_z_abs_max"


def drawn(seed=0, draws=40, share=0.1):
    generator = np.random.default_rng(seed)
    return {item: value * generator.normal(1.05, share, draws) for item, value in ERRORS_MM.items()}


def slow(found, orders):
    """The objective by SciPy, one number after another, in mm instead of ratios."""
    total = 0.0
    for item, printed in ERRORS_MM.items():
        values, half = list(found[item]), printed_half_mm(item)
        mean = sum(values) / len(values)
        square = sum((value - mean) ** 2 for value in values) / (len(values) - 1) + half**2 / 3.0
        spread = square**0.5
        if item == LIMIT:
            total -= student.logcdf((printed - mean) / spread, 4)
        else:
            total -= np.log(2.0 * half * student.pdf((printed - mean) / spread, 4) / spread)
    return total - sum(student.logcdf(np.mean(one) / np.std(one, ddof=1), 4) for one in orders.values())


def test_the_objective_is_minus_the_log_probability_of_what_is_printed():
    orders = {"centre_before": np.linspace(-0.1, 0.3, 40), "links": np.linspace(-0.9, -0.8, 40)}
    assert twin_objective.misfit(drawn(), orders) == pytest.approx(slow(drawn(), orders), rel=1e-10)
    for t in (-300.0, -5.0, 0.0, 3.0):
        assert twin_objective._log_t_cdf(t) == pytest.approx(student.logcdf(t, 4), rel=1e-6)


def test_the_residuals_are_the_objective_and_a_tolerance_is_more_scatter():
    orders = {"centre_before": np.linspace(-0.1, 0.3, 40), "links": np.linspace(-0.9, -0.8, 40)}
    for weights in (None, {"lines_after_max": 4.0, LIMIT: 2.0, "order_links": 16.0}):
        squares = twin_objective.residuals(drawn(), orders, weights)
        objective = 0.5 * (squares**2).sum() + twin_objective.least(weights)
        assert objective == pytest.approx(twin_objective.misfit(drawn(), orders, weights))
    # met without scatter, by SciPy: twice half a digit over the rectangle's standard deviation
    assert twin_objective.least() == pytest.approx(-16.0 * np.log(2.0 * np.sqrt(3.0) * student.pdf(0.0, 4)))
    # a deviation of 5 % where numbers scatter by 1 % and 10 %
    exact = {item: value * np.linspace(0.999, 1.001, 40) for item, value in ERRORS_MM.items()}
    off = exact | {"lines_after_max": 1.05 * exact["lines_after_max"]}
    place = list(ERRORS_MM).index("lines_after_max")
    near, far = (twin_objective.residuals(off, {}, tolerance=tolerance)[place] for tolerance in (0.1, 0.0))
    assert near == pytest.approx(-np.sqrt(5.0 * np.log1p(0.25 * 0.5**2)), rel=0.01) and far < 5.0 * near


def test_half_a_printed_digit():
    halves = {
        "group1_before_min": 0.0005,
        "group1_after_max": 0.0005,
        "lines_after_min": 0.005,
        "lines_objective": 5e-5,
    }
    assert {item: printed_half_mm(item) for item in halves} == pytest.approx(halves)


def test_a_number_weighs_by_its_scatter_and_one_out_of_reach_does_not_dominate():
    def change(share, off):
        exact = drawn(share=share)
        moved = exact | {"group1_before_max": exact["group1_before_max"] + off * ERRORS_MM["group1_before_max"]}
        return twin_objective.misfit(moved, {}) - twin_objective.misfit(exact, {})

    # ten per cent weigh more in a number that varies by 3 % than in one that varies by 30 %
    assert change(0.03, 0.1) > 5.0 * abs(change(0.3, 0.1))
    # the tenfold deviation costs far less than a hundredfold, as a normal distribution's would
    assert change(0.03, 1.0) < 4.0 * change(0.03, 0.1)
    assert -norm.logpdf(1.0 / 0.03) > 10.0 * change(0.03, 1.0)
    # more scatter does not buy a better objective where the mean is right
    assert twin_objective.misfit(drawn(share=0.3), {}) > twin_objective.misfit(drawn(share=0.1), {})


def test_an_upper_limit_and_an_order_cost_only_on_the_wrong_side():
    low = drawn() | {LIMIT: np.linspace(0.5, 0.7, 40)}
    assert twin_objective.surprises(low, {})[LIMIT] < 1e-3
    holds, fails = ({"outer_after": np.linspace(at - 0.05, at + 0.05, 40)} for at in (0.5, -0.5))
    assert twin_objective.surprises(low, holds)["order_outer_after"] < 1e-2
    assert twin_objective.surprises(low, fails)["order_outer_after"] > 5.0


def test_the_nearest_draw_by_brute_force():
    found, margins = drawn(3, 25, 0.4), np.random.default_rng(4).normal(size=(25, 3))
    several = [
        Draw(number, {item: values[number] for item, values in found.items()}, dict(enumerate(margins[number])), ())
        for number in range(25)
    ]
    distances = []
    for number in range(25):
        total = 0.0
        for item, printed in ERRORS_MM.items():
            off = found[item][number] / printed - 1.0
            if item != LIMIT or off > 0.0:
                total += np.log(1.0 + (off / 0.15) ** 2)
        distances.append(total + np.log(2.0) * (margins[number] <= 0.0).sum())
    ranks = next(table for table in TABLES if table.name == "draw_ranks").pandera().validate(redraw.draw_ranks(several))
    assert ranks["draw"].tolist() == np.argsort(distances).tolist() and ranks["rank"].tolist() == [*range(1, 26)]
    np.testing.assert_allclose(ranks["misfit"], np.sort(distances))
    first = ranks.iloc[0]
    off = np.array([found[item][int(first["draw"])] / printed - 1.0 for item, printed in ERRORS_MM.items()])
    off[list(ERRORS_MM).index(LIMIT)] = max(off[list(ERRORS_MM).index(LIMIT)], 0.0)
    assert first["numbers_met"] == (abs(off) <= 0.15).sum()
    assert first["orders_met"] == (margins[int(first["draw"])] > 0.0).sum()


def test_the_printed_digits_themselves_are_at_no_distance():
    holds = {"centre_before": 0.1, "group6_after": 0.1}
    assert twin_objective.draw_misfit(ERRORS_MM, holds) == 0.0
    assert twin_objective.draw_misfit(ERRORS_MM | {LIMIT: 1.0}, holds) == 0.0
    broken = twin_objective.draw_misfit(ERRORS_MM, holds | {"group6_after": -0.01})
    off = twin_objective.draw_misfit(ERRORS_MM | {"lines_after_max": 1.15 * 1.34}, holds)
    assert broken == pytest.approx(off) == pytest.approx(np.log(2.0))
