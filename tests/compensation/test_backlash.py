"""Compensated backlash and repeatability, against the play operator and against numbers done by hand."""

import numpy as np
import pandas as pd
import pytest

from rrru.compensation.backlash import compensated, measured_width, repeatability
from rrru.effects.backlash import play

WIDTHS = np.array([0.06, 0.045, 0.075])


def _wander(seed):
    """A path (2000, 3) in mm that turns back often."""
    generator = np.random.default_rng(seed)
    return np.cumsum(generator.standard_normal((2000, 3)).repeat(5, axis=0)[:2000] * 0.05, axis=0)


@pytest.mark.parametrize("seed", range(4))
def test_behind_the_play_the_slider_is_where_it_is_wanted(seed):
    """Once the backlash is crossed, wherever the path turns; without the jumps it is half the backlash behind."""
    wanted = _wander(seed)
    sent = compensated(wanted, WIDTHS)
    attained = sent + play(sent, 0.5 * WIDTHS)
    settled = (np.abs(np.cumsum(np.abs(np.diff(wanted, axis=0, prepend=wanted[:1])), axis=0)) > WIDTHS).all(axis=1)
    np.testing.assert_allclose(attained[settled], wanted[settled], atol=1e-12)
    assert np.abs(play(wanted, 0.5 * WIDTHS)[settled]).max() == pytest.approx(0.0375, rel=1e-9)


def test_a_slider_that_stands_keeps_its_side():
    wanted = np.array([[0.0], [0.0], [1.0], [1.0], [0.5], [0.5], [0.7]])
    np.testing.assert_allclose(compensated(wanted, [0.2])[:, 0] - wanted[:, 0], [0.1, 0.1, 0.1, 0.1, -0.1, -0.1, 0.1])
    still = np.ones((4, 1))
    np.testing.assert_array_equal(compensated(still, [0.2]), still)


def test_the_width_is_the_mean_difference_of_the_directions_away_from_the_turns():
    """Three passes of 10 mm at a lead of 2 mm, by hand: 0.03 and 0.05 over the inner places, nonsense at the ends."""
    places = np.arange(0.0, 10.5, 0.5)
    inner = (places > 2.0) & (places < 8.0)
    passes = {"forward_1": -0.03 * inner, "reverse": 0.0 * places, "forward_2": -0.05 * inner}
    record = pd.concat(
        [
            pd.DataFrame({"pass": name, "commanded_mm": places, "encoder_mm": places + shift})
            for name, shift in passes.items()
        ],
        ignore_index=True,
    )
    width = measured_width(record, 2.0)
    assert (width.mean_mm, width.first_mm, width.second_mm) == pytest.approx((0.04, 0.03, 0.05), abs=1e-12)


def test_repeatability_is_the_pooled_scatter_over_the_repeats():
    generator = np.random.default_rng(0)
    places = np.linspace(0.0, 100.0, 400)[:, None] * np.array([1.0, 0.5, 2.0])
    values = places + np.array([0.01, 0.02, 0.03]) * generator.standard_normal((7, 400, 3))
    scatter, travel = repeatability(values)
    # relative error of a standard deviation with 2400 degrees of freedom: 1.4 %
    np.testing.assert_allclose(scatter, [0.01, 0.02, 0.03], rtol=0.06)
    np.testing.assert_allclose(travel, [100.0, 50.0, 200.0], atol=0.1)
