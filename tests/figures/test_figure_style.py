"""Numbers of the figures: round magnifications, short digits."""

import numpy as np
import pytest

from rrru.figures import style


@pytest.mark.parametrize(
    ("largest", "span", "factor"),
    [(8.0, 500.0, 10.0), (1.0, 500.0, 50.0), (1e3, 500.0, 1.0), (np.nan, 500.0, 500.0), (0.1, 0.0, 1.0)],
)
def test_magnification_is_round(largest, span, factor):
    assert style.magnification([0.1, np.nan, -largest], span) == factor


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0471, "0.047"), (-5.031, "\N{MINUS SIGN}5.03"), (-47.11, "\N{MINUS SIGN}47.1"), (471.1, "471"), (np.nan, "–")],
)
def test_numbers_are_short(value, text):
    assert style.number(value) == text
