"""Intervals of a diagnosis' numbers compared with the true ones."""

import numpy as np
import pandas as pd

from rrru.studies.blind_validation.numbers import fitted, held

_TRUTH = {"backlash": {"width1": 1.0, "width2": 2.0}, "transmission_error": {"phase1": 0.0}}


def _estimates(*rows):
    columns = ["effect", "parameter", "value", "standard_error", "at_bound"]
    return fitted(pd.DataFrame(rows, columns=columns))


def test_numbers_of_what_truly_acts_are_counted():
    estimates = _estimates(
        ("calibration", "ddrive1", 1.0, np.nan, False),
        ("backlash", "width1", 1.19, 0.1, False),
        ("backlash", "width2", 2.2, 0.1, False),
        ("backlash", "width2", 0.0, 0.1, True),
        ("servo_lag", "lag1", 0.0, 0.1, False),
        ("transmission_error", "phase1", 6.28, 0.1, False),
    )
    assert held(estimates, _TRUTH) == (2, 1)
    assert held(_estimates(), _TRUTH) == (0, 0) and held(estimates, {}) == (0, 0)


def test_intervals_hold_as_often_as_they_say():
    generator = np.random.default_rng(2)
    rows = [("backlash", "width1", 1.0 + 0.3 * generator.standard_normal(), 0.3, False) for _ in range(4000)]
    count, hits = held(_estimates(*rows), _TRUTH)
    assert count == 4000
    # four standard deviations of a share of 0.95
    np.testing.assert_allclose(hits / count, 0.95, atol=0.014)
