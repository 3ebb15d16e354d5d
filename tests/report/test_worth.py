"""Sizes before and after a calibration that are compared are of the same points and the same kind."""

import numpy as np
import pandas as pd
import pytest

from rrru.report.worth import Worth, sentences, worth

BEFORE_MM, SEEN_MM, NOISE_MM, COUNT = 0.3, 0.1, 0.05, 20000


@pytest.fixture(scope="module")
def tables():
    """`errors` and `gap_points` of points whose offset is known, measured with noise; the last one is left out."""
    noise = np.random.default_rng(3).normal(0.0, NOISE_MM, (COUNT, 3))
    keys = pd.DataFrame({"run": 1, "point": np.arange(COUNT)})
    before = np.linalg.norm(noise + np.array([BEFORE_MM, 0.0, 0.0]), axis=1)
    before[-1] = 1e6
    errors = pd.concat([keys.assign(mode="before", error_mm=before), keys.assign(mode="model", error_mm=9.0)])
    left = (noise + np.array([0.0, SEEN_MM, 0.0])).T
    points = keys.assign(used=keys["point"] < COUNT - 1, before_x_mm=left[0], before_y_mm=left[1], before_z_mm=left[2])
    return errors, points


def test_the_noise_is_subtracted_from_both_at_the_same_points(tables):
    found = worth(*tables, np.sqrt(3.0) * NOISE_MM, False)
    assert found.points == COUNT - 1
    assert (found.before_mm, found.seen_mm) == pytest.approx((BEFORE_MM, SEEN_MM), rel=0.01)


def test_nothing_is_said_where_nothing_was_compared(tables):
    errors, points = tables
    assert worth(errors[errors["mode"] == "model"], points, 0.1, False) is None


def test_a_calibration_that_does_not_carry_over_is_said_to_have_absorbed_the_cause():
    found = Worth(144, 0.18, 0.15, True)
    size = "at the same 144 points is 0.18 mm rms, after registration of the instrument's frame (distance in space"
    assert size in sentences(found, 0.23)[0]
    assert "absorbed a part of the cause" in sentences(found, 0.23)[1]
    assert len(sentences(found, 0.17)) == 1
