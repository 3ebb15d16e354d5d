"""The bench of a screw: the encoder's readings, and that eq. (19) finds the backlash in them."""

import numpy as np
import pytest

from rrru.compensation.backlash import measured_width
from rrru.effects.library import active_effects
from rrru.errors import UnreachableError
from rrru.robots.ptt3 import Ptt3
from rrru.simulation.screw import ScrewBench, encoder_record
from rrru.simulation.virtual_robot import VirtualRobot

PLACE = (0.0, 0.0, -250.0)
EXACT = ScrewBench(turns=10, lead_mm=5.0, samples_per_turn=8, noise_mm=0.0, resolution_mm=1e-9)
REAL = ScrewBench(turns=10, lead_mm=5.0, samples_per_turn=40, noise_mm=5e-4, resolution_mm=1e-3)


def robot(widths=(0.06, 0.045, 0.075), compliance=0.0):
    effects = {f"width{leg}": width for leg, width in enumerate(widths, start=1)}
    soft = {f"compliance{leg}": compliance for leg in (1, 2, 3)}
    section = {"backlash": effects, "drive_compliance": soft}
    return VirtualRobot(Ptt3(), effects=active_effects(section, Ptt3()))


def test_every_pass_stops_at_the_same_places():
    travel, number = EXACT.path()
    assert len(travel) == 241 and travel.max() == 50.0
    forward, reverse, again = (travel[number == k] for k in range(3))
    np.testing.assert_array_equal(forward, np.arange(81) * 0.625)
    np.testing.assert_array_equal(reverse, forward[-2::-1])
    np.testing.assert_array_equal(again, forward[1:])


def test_the_carriage_stays_half_the_play_behind_and_turns_late():
    record = encoder_record(robot(), 1, 0.0, EXACT, PLACE, np.random.default_rng(0))
    lag = (record["encoder_mm"] - record["commanded_mm"]).to_numpy()
    assert record["pass"].tolist() == ["forward_1"] * 81 + ["reverse"] * 80 + ["forward_2"] * 80
    np.testing.assert_allclose(lag[1:81], -0.03, atol=1e-8)
    np.testing.assert_allclose(lag[81:161], 0.03, atol=1e-8)
    np.testing.assert_allclose(lag[161:], -0.03, atol=1e-8)


@pytest.mark.parametrize("leg", [1, 2, 3])
@pytest.mark.parametrize("payload_kg", [0.0, 8.0])
def test_eq_19_finds_the_play_within_its_standard_error_under_any_load(leg, payload_kg):
    """The load bends drives alike in both directions, so that it does not reach the difference."""
    record = encoder_record(robot(compliance=3e-3), leg, payload_kg, REAL, PLACE, np.random.default_rng(10 * leg))
    width = measured_width(record, REAL.lead_mm)
    assert width.standard_error_mm < 1e-4
    assert abs(width.mean_mm - (0.06, 0.045, 0.075)[leg - 1]) < 4.0 * width.standard_error_mm


def test_a_screw_without_play_has_none():
    width = measured_width(
        encoder_record(robot((0.0, 0.0, 0.0)), 2, 0.0, REAL, PLACE, np.random.default_rng(4)), REAL.lead_mm
    )
    assert abs(width.mean_mm) < 4.0 * width.standard_error_mm


def test_a_load_shifts_the_reading_by_the_compliance():
    """8 kg on three legs: the carriage's force by virtual work, from finite differences of the height."""
    light, heavy = (
        encoder_record(robot((0.0, 0.0, 0.0), 1e-3), 1, load, EXACT, PLACE, np.random.default_rng(0))[
            "encoder_mm"
        ].to_numpy()
        for load in (0.0, 8.0)
    )
    mechanism, step = Ptt3(), 1e-4
    at, move = mechanism.inverse(np.array([PLACE])), np.array([step, 0.0, 0.0])
    rise = (mechanism.forward(at + move) - mechanism.forward(at - move))[0, 2] / (2.0 * step)
    middle = 40
    assert heavy[middle] - light[middle] == pytest.approx(-1e-3 * 8.0 * 9.80665 * rise, rel=1e-5)


def test_a_travel_out_of_reach_is_refused():
    with pytest.raises(UnreachableError, match=r"screw 2: 1000 mm of travel"):
        encoder_record(robot(), 2, 0.0, ScrewBench(10, 100.0, 8, 0.0, 1e-3), PLACE, np.random.default_rng(0))
