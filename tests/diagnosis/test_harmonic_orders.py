"""The search for the waves per turn of a gear: against plain least squares, and against gears that are known."""

import numpy as np
import pytest

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.drive_spectra import periodogram, resolution, searched_orders, with_orders
from rrru.diagnosis.settings import GapSettings
from rrru.effects.protocol import ActiveEffect
from tests.diagnosis.campaigns import EFFECTS, NOISE_MM, ROBOT, diagnosed, measure, problem_of, strong

_GEAR = EFFECTS["transmission_error"]


def _geared(ratio, seed, size=4e-4):
    """A gear error of a ratio, its phases drawn."""
    phases = np.random.default_rng(seed).uniform(-np.pi, np.pi, 3)
    values = _GEAR.parameters.mapping([size, 0.8 * size, 1.2 * size, *phases, ratio])
    return ActiveEffect(_GEAR, values)


def _squares(columns, data):
    """What least squares leaves of data (m, 3) by columns (m, 3, k)."""
    flat = columns.reshape(data.size, -1)
    fitted, *_ = np.linalg.lstsq(flat, data.ravel(), rcond=None)
    return ((data.ravel() - flat @ fitted) ** 2).sum()


@pytest.mark.parametrize("order", [4.2, 11.0, 60.5])
def test_the_periodogram_is_what_waves_take_off_the_sum_of_squares(order):
    problem = problem_of(measure((_geared(order, 1),)))
    linear = problem.linearise(calibrate(problem))
    drive = problem.motion.drive[problem.at]
    own = [linear.drive[..., k] * wave(order * drive[:, k])[:, None] for k in range(3) for wave in (np.sin, np.cos)]
    together = np.concatenate([linear.base, np.stack(own, axis=-1)], axis=-1)
    gain = _squares(linear.base, linear.data) - _squares(together, linear.data)
    found = periodogram(linear.data, linear.drive, drive, linear.base, np.array([order]))
    np.testing.assert_allclose(found, gain, rtol=1e-6)
    # waves of this order alone are there: they take all but the noise
    assert gain > 0.9 * (_squares(linear.base, linear.data) - 3.0 * len(problem) * NOISE_MM**2)


def test_a_turn_resolves_whole_orders():
    full = np.linspace(-np.pi, np.pi, 50)[:, None] * [1.0, 0.5, 0.2]
    assert resolution(full) == pytest.approx(1.0)
    assert resolution(0.25 * full) == pytest.approx(4.0)


@pytest.mark.parametrize(("ratio", "seed"), [(5.5, 1), (17.3, 2), (41.0, 3), (93.0, 4)])
def test_a_ratio_that_is_not_stated_is_found(ratio, seed):
    result = diagnosed(measure((_geared(ratio, seed),), seed=seed))
    assert result.verdict["effects"] == "transmission_error"
    problem = result.inference.problem
    ((key, _),) = result.state.effects.items()
    found = result.state.shape(problem.library, key)["ratio"]
    assert abs(found - ratio) < 0.15 * resolution(problem.motion.drive[problem.used])


def test_slow_waves_are_tried_down_to_half_a_wave_over_the_range():
    """A ratio below 1 is no gear; the highest order is not among them."""
    search = _GEAR.coordinates.searched
    orders = searched_orders(search, 2.8)
    assert 1.4 <= orders[0] < 1.9 and 199.0 < orders[-1] < 200.0
    assert np.abs(orders - 2.8).min() < 1e-12
    np.testing.assert_allclose(np.diff(orders), 2.8 / 6)
    assert searched_orders(search, 1.0)[0] == 1.0
    assert searched_orders(search, 1.5)[0] == 1.0


@pytest.mark.parametrize("waves_over_range", [0.8, 1.05, 1.3])
def test_slow_waves_of_all_drives_are_not_taken_for_eccentric_and_oval_encoders(waves_over_range):
    """Over a part of a turn waves of orders 1 and 2 add up to nearly any slow wave."""
    ratio = waves_over_range * resolution(problem_of(measure()).motion.drive)
    result = diagnosed(measure((_geared(ratio, 7, 2e-3),), seed=7))
    assert result.verdict["effects"] == "transmission_error"


def test_a_ratio_is_found_together_with_another_effect():
    result = diagnosed(measure((_geared(12.0, 5, 8e-4), strong("frame_misregistration", 10.0))))
    assert set(result.verdict["effects"].split("+")) == {"transmission_error", "frame_misregistration"}


def test_a_known_ratio_is_not_searched():
    settings = GapSettings(known={"transmission_error": {"ratio": 30.0}})
    library = settings.library(ROBOT)
    coordinates = library["transmission_error"].coordinates
    assert coordinates.searched is None and coordinates.doubt == 0.0 and coordinates.shapes == ({"ratio": 30.0},)
    problem = problem_of(measure((_geared(12.0, 5),)), library)
    same, added = with_orders(problem, problem.linearise(calibrate(problem)), ())
    assert not added and same.library["transmission_error"] is library["transmission_error"]


def test_the_stated_ratio_keeps_half_of_the_belief_and_orders_that_stand_out_are_added_once():
    problem = problem_of(measure((_geared(12.0, 5),)))
    linear = problem.linearise(calibrate(problem))
    problem, added = with_orders(problem, linear, ())
    coordinates = problem.library["transmission_error"].coordinates
    assert coordinates.shapes[0] == {"ratio": 50.0} and coordinates.weights[0] == 0.5
    assert added == [("transmission_error", k) for k in range(1, len(coordinates.shapes))]
    assert min(abs(shape["ratio"] - 12.0) for shape in coordinates.shapes) < 0.3
    # what is believed of all orders together is no more than the other half
    assert sum(coordinates.weights[1:]) < 0.5
    again, added = with_orders(problem, linear, ())
    assert not added and again.library["transmission_error"].coordinates.shapes == coordinates.shapes
