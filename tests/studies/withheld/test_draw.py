"""The robots whose cause is withheld: drawn by a seed, as strong as they say, rich enough, and from outside where they
say so.
"""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from rrru.campaign import measurements as rows
from rrru.effects.library import EFFECTS
from rrru.gap.case import make_case
from rrru.plant.virtual_robot import VirtualRobot
from rrru.robots import singularity
from rrru.robots.dynamics import Masses
from rrru.robots.first_order import FirstOrder
from rrru.studies.withheld import draw
from rrru.studies.withheld.chunks import check, chunks
from rrru.studies.withheld.oracle import limits, with_truth
from rrru.studies.withheld.outside import OUTSIDE
from rrru.studies.withheld.robots import NOISE_MM, NOISE_RMS_MM, Robot, answer, measure, nominal, simulate, true_gap_mm

_MECHANISM = nominal({})


def _calibrated(measurements):
    """Errors (7,) and rms distance in mm of a calibration by repeated linear least squares."""
    theta, measured = rows.actuators(measurements), rows.measured(measurements)
    deviations = np.zeros(7)
    for _ in range(6):
        model = _MECHANISM.forward(theta, deviations, rows.command(measurements))
        slope = _MECHANISM.parameter_jacobian(model, theta, deviations).reshape(-1, 7)
        deviations = deviations + np.linalg.lstsq(slope, (measured - model).ravel(), rcond=None)[0]
    left = measured - _MECHANISM.forward(theta, deviations, rows.command(measurements))
    return deviations, np.sqrt((left**2).sum(axis=1).mean())


def _bare(number, kind="paper"):
    return replace(draw._bare("bare", np.random.default_rng(number), _MECHANISM), kind=kind)


@pytest.mark.parametrize("number", [0, 4, 8])
def test_a_robot_is_its_seed_and_survives_as_text(number):
    robot = draw.draw_labelled(2021, number, _MECHANISM)
    assert robot == draw.draw_labelled(2021, number, _MECHANISM)
    assert robot != draw.draw_labelled(2022, number, _MECHANISM)
    assert Robot.from_json(robot.to_json()) == robot
    np.testing.assert_array_equal(
        rows.measured(measure(robot, 1, _MECHANISM)), rows.measured(measure(robot, 1, _MECHANISM))
    )


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_effect_is_as_strong_as_the_answer_says(effect):
    robot = draw.draw_single(5, effect, 0, _MECHANISM)
    told = answer(robot, _MECHANISM)
    assert told["truth"] == effect and 2.0 <= told["strength"] <= 10.0
    measurements, truth = simulate(robot, _MECHANISM, 0.0, np.random.default_rng(0))
    _, gap = _calibrated(measurements)
    np.testing.assert_allclose(gap / NOISE_RMS_MM, told["strength"], rtol=1e-3)
    np.testing.assert_array_equal(rows.measured(measurements), truth[[f"true_{axis}_mm" for axis in "xyz"]])


def test_one_leg_means_that_leg_alone():
    generator = np.random.default_rng(3)
    bare = _bare(3)
    found = Counter()
    for _ in range(12):
        acting = draw._draw_acting(bare, "servo_lag", True, (0.5, 1.0), generator, _MECHANISM)
        coordinates = np.array(acting.coordinates)
        assert (coordinates >= 0.0).all()
        assert not acting.leg or (np.flatnonzero(coordinates) == acting.leg - 1).all()
        found[bool(acting.leg)] += 1
    assert 1 <= found[True] <= 8
    # a pair, or an effect without legs, sits on none alone
    assert draw._draw_acting(bare, "thermal_growth", True, (0.5, 1.0), generator, _MECHANISM).leg == 0


def test_truths_come_in_the_stated_shares(monkeypatch):
    drawn = Counter()
    monkeypatch.setattr(draw, "_trajectories", lambda *_: {})
    monkeypatch.setattr(draw, "true_gap_mm", lambda *_: 1.0)
    monkeypatch.setattr(draw, "_draw_acting", lambda robot, name, *_: name)
    effects, kinds = Counter(), Counter()
    for number in range(2000):
        robot = draw.draw_labelled(1, number, _MECHANISM)
        outside = any(name in OUTSIDE for name in robot.acting)
        drawn["outside" if outside else ("none", "one", "two")[len(robot.acting)]] += 1
        effects.update(robot.acting)
        kinds[robot.kind] += 1
    for truth, share in draw.TRUTHS.items():
        np.testing.assert_allclose(drawn[truth] / 2000, share, atol=0.03)
    assert set(effects) == {*EFFECTS, *OUTSIDE}
    assert max(effects[name] for name in EFFECTS) < 1.5 * min(effects[name] for name in EFFECTS)
    np.testing.assert_allclose(kinds["full"] / 2000, 0.5, atol=0.04)


def test_the_full_campaign_has_what_a_field_campaign_has():
    measurements, _ = simulate(_bare(1, "full"), _MECHANISM, 0.0, np.random.default_rng(0))
    assert len(measurements) == 732 and measurements["run"].nunique() == 26
    assert set(measurements["speed_mm_s"]) == {80.0, 300.0} and set(measurements["payload_kg"]) == {0.0, 5.0}
    assert (measurements.groupby("run")["trajectory"].first() == "line_1").sum() == 6
    assert set(rows.direction(measurements)) == {-1, 1}
    fast = measurements[(measurements["speed_mm_s"] == 300.0) & (measurements["trajectory"] == "line_1")]
    length = np.linalg.norm(rows.command(fast)[-1] - rows.command(fast)[0])
    # a trapezoid: rest to rest at 300 mm/s with 400 mm/s^2
    np.testing.assert_allclose(fast["time_s"].iloc[-1] - fast["time_s"].iloc[0], length / 300.0 + 300.0 / 400.0)
    assert len(simulate(_bare(1), _MECHANISM, 0.0, np.random.default_rng(0))[0]) == 222


def test_campaigns_keep_clear_of_singularities_and_fresh_runs_go_elsewhere():
    for number in range(5):
        robot = _bare(number)
        points = robot.plan.targets()
        theta = _MECHANISM.inverse(points)
        for measure_of in (singularity.translational_measure, singularity.constraint_measure):
            assert measure_of(_MECHANISM, points, theta).min() > 0.1
        other = draw.fresh(robot, 1, _MECHANISM)
        assert other.errors == robot.errors and other.acting == robot.acting
        assert np.abs(other.plan.targets() - points).max() > 5.0


def test_errors_alone_leave_no_gap():
    assert true_gap_mm(_bare(2), _MECHANISM) < 1e-6


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_cause_from_outside_is_physical_and_nothing_in_the_library_imitates_it(name):
    bare = _bare(0, "full")
    acting = draw._draw_acting(bare, name, False, (2.0, 2.001), np.random.default_rng(1), _MECHANISM)
    robot = replace(bare, acting=(acting,))
    assert answer(robot, _MECHANISM)["truth"] == f"outside:{name}"
    virtual = replace(robot.virtual(_MECHANISM), deviations={})
    motion = virtual.motion(robot.plan, _MECHANISM.inverse)
    moved, _ = virtual.positions(motion, motion.position_mm)
    still, _ = VirtualRobot(mechanism=_MECHANISM).positions(motion, motion.position_mm)
    first = FirstOrder(_MECHANISM, motion.position_mm, motion.drive).move(acting.law.contribute(motion, acting.values))
    np.testing.assert_allclose(moved - still, first, atol=0.02 * np.abs(first).max())
    measurements = measure(robot, 1, _MECHANISM)
    deviations, _ = _calibrated(measurements)
    case = make_case(measurements, _MECHANISM, Masses(), NOISE_MM, with_truth(EFFECTS, robot.acting))
    found = limits(case, deviations, robot.acting, list(EFFECTS))
    # a library that could make this gap would leave 50 once in a million noises
    assert found.detects and found.rival_chi2 > 50.0


def test_the_laws_from_outside_do_as_they_say():
    motion = VirtualRobot(mechanism=_MECHANISM).motion(_bare(0).plan, _MECHANISM.inverse)
    run = np.cumsum(np.diff(motion.time_s, prepend=0.0) > 30.0)
    jumps = OUTSIDE["rehoming"].contribute(motion, np.array([1e-3, 2e-3, 0.0, 1.0])).drive
    for number in range(8):
        assert (np.ptp(jumps[run == number], axis=0) == 0.0).all()
    assert np.unique(jumps[:, 0]).size == 8 and np.abs(jumps).max(axis=0)[0] <= 1e-3 and not jumps[:, 2].any()
    creep = OUTSIDE["tripod_creep"].contribute(motion, np.array([0.0, 1e-3, 0.0])).joint_mm
    np.testing.assert_allclose(creep[:, 2, 1], 1e-3 * motion.time_s)
    sway = OUTSIDE["tripod_sway"].contribute(motion, np.array([0.1, 0.0, 0.0, 10.0])).joint_mm[:, 0, 0]
    np.testing.assert_allclose(sway, 0.1 * np.sin(0.2 * np.pi * motion.time_s), atol=1e-12)
    pull = OUTSIDE["cable_pull"].contribute(motion, np.array([1e-3])).joint_mm[:, 0]
    assert 0.0 < (np.linalg.norm(pull, axis=1) > 0.0).mean() < 1.0


def test_chunks_hold_every_robot_once():
    parts = chunks({"robots": 7, "per_effect": 3, "chunk": 2})
    assert [parts[f"label_{k:03d}"].numbers for k in range(4)] == [range(2), range(2, 4), range(4, 6), range(6, 7)]
    for effect in EFFECTS:
        numbers = [n for part in parts.values() if part.effect == effect for n in part.numbers]
        assert numbers == [0, 1, 2]


@pytest.mark.parametrize(("key", "value"), [("field", ["nosuch"]), ("effects", ["nosuch"])])
def test_unknown_names_are_refused(key, value):
    from rrru.errors import ConfigError

    with pytest.raises(ConfigError, match=f"withheld.{key} has 'nosuch'"):
        check({"campaigns": {"paper": {}}, "withheld": {key: value}})
