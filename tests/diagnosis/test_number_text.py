"""Numbers of an answer keep their size and claim no more than they have."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rrru.diagnosis.number_text import probability, rounded, with_interval


@given(st.floats(1e-7, 1e6), st.integers(1, 5))
def test_a_rounded_number_is_off_by_half_a_digit_at_most(value, digits):
    text = rounded(-value, digits)
    assert abs(float(text) + value) <= 0.5000001 * 10.0 ** (np.floor(np.log10(value)) - digits + 1)
    assert "e" not in text


@pytest.mark.parametrize("value", [None, np.nan, np.inf])
def test_a_size_that_is_not_known_is_not_zero(value):
    assert rounded(value) == "unknown" and rounded(0.0) == "0"


@given(st.floats(-1e3, 1e3), st.floats(1e-7, 1e2))
def test_a_number_with_its_interval_is_given_to_two_digits_of_the_half_width(value, half):
    text = with_interval(value, value - half, value + half, "mm")
    size, low, high = (float(part) for part in re.fullmatch(r"(.+) mm \(95 %: (.+) to (.+)\)", text).groups())
    rounding = 0.051 * half + 1e-12 * abs(value)
    assert (
        abs(size - value) <= rounding and abs(low - value + half) <= rounding and abs(high - value - half) <= rounding
    )
    assert "-0 " not in text and "e" not in text


@pytest.mark.parametrize(("value", "text"), [(1.0, "more than 0.99"), (1e-9, "less than 0.01"), (0.5, "0.50")])
def test_a_probability_claims_no_certainty(value, text):
    assert probability(value) == text
