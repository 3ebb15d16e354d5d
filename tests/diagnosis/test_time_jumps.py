"""The moment at which something moves once, and what is said of it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rrru.diagnosis.discrepancy_basis import lone_jump
from rrru.diagnosis.time_jumps import moment_gains
from rrru.diagnosis.verdict_facts import answer
from rrru.diagnosis.verdict_text import sentences
from tests.diagnosis.campaigns import diagnosed, measure, strong


def test_the_reduction_of_each_moment_is_that_of_least_squares_with_and_without_the_jump():
    generator, count = np.random.default_rng(3), 40
    time = np.sort(generator.choice(np.arange(30.0), count))
    nuisance, response = (generator.standard_normal((count, 3, k)) for k in (5, 4))
    # the calibration absorbs one of the jumps
    response[..., 3] = 1000.0
    nuisance = np.concatenate([nuisance, np.ones((count, 3, 1))], axis=-1)
    data = generator.standard_normal((count, 3))
    basis, _ = np.linalg.qr(nuisance.reshape(3 * count, -1))
    left = data - (basis @ (basis.T @ data.ravel())).reshape(count, 3)
    order = generator.permutation(count)
    rows = (left[order], basis.reshape(count, 3, -1)[order], response[order], time[order])
    moments, gains = moment_gains(*rows)
    stops = np.unique(time)
    np.testing.assert_allclose(moments, 0.5 * (stops[1:] + stops[:-1])[4:-4])
    for moment, gain in zip(moments, gains, strict=True):
        columns = np.concatenate([nuisance, response * (time > moment)[:, None, None]], axis=-1)
        without, with_it = (
            data.ravel() - flat @ np.linalg.lstsq(flat, data.ravel(), rcond=None)[0]
            for flat in (nuisance.reshape(3 * count, -1), columns.reshape(3 * count, -1))
        )
        assert without @ without - with_it @ with_it == pytest.approx(gain, rel=1e-9)


def test_a_jump_next_to_another_function_is_none():
    assert lone_jump({"backlash", "unknown_jump"}) == {"unknown_jump"}
    assert not lone_jump({"unknown_jump", "unknown_drift"}) and not lone_jump({"unknown_jump", "unknown_zero_jump"})
    assert not lone_jump({"backlash", "unknown_drift"}) and not lone_jump(())


def test_a_few_stops_are_no_jump():
    one = np.ones((9, 3, 1))
    assert not len(moment_gains(one[..., 0], 0.0 * one, one, np.arange(9.0))[0])


@pytest.mark.parametrize(("effect", "leg"), [("backlash", 0), ("leg_asymmetry", 1)])
def test_a_tracker_that_is_bumped_between_two_runs_is_no_drift_of_the_base(effect, leg):
    """Without the bump in the model each leg has an asymmetry of its own: shares of other terms were asked for."""
    frame = measure((strong(effect, 4.0, leg=leg),))
    read = ["measured_x_mm", "measured_y_mm", "measured_z_mm"]
    starts = frame.groupby("run")["time_s"].agg(["min", "max"]).sort_values("min")
    before, after = starts["max"].iloc[2], starts["min"].iloc[3]
    passed = frame["time_s"] > before
    turned = Rotation.from_rotvec([2e-4, 0.0, -1e-4]).apply(frame.loc[passed, read])
    frame.loc[passed, read] = turned + np.array([0.15, -0.1, 0.05])
    found = diagnosed(frame, details=True)
    assert found.verdict["effects"] == f"{effect}+unexplained" and found.verdict["leg"] == leg
    said = " ".join(sentences(answer("bumped", found.verdict, found.tables)))
    moment = f"{0.5 * (before + after):.4g} s"
    assert (
        f"The unexplained part follows a jump at {moment}, as a move of the instrument or the base: it predicts" in said
    )
    assert f"something changed at {moment}: calibrate the readings before and after it separately" in said
