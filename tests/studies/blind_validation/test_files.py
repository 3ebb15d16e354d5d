"""Robots of files with a fault, on our own plant and on MuJoCo's: the same fault, and the right answer to it."""

import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from rrru.campaign import measurements as rows
from rrru.diagnosis.settings import GapSettings
from rrru.effects.library import find
from rrru.errors import UnreachableError
from rrru.studies.blind_validation import draw, robots, score
from rrru.studies.blind_validation.causes import KINDS, Fault, draw_fault, kinds_of
from rrru.studies.blind_validation.chunks import Member
from rrru.studies.blind_validation.noise import NoiseModel
from rrru.studies.blind_validation.parts import parts
from rrru.studies.blind_validation.robots import mujoco_plant
from rrru.studies.blind_validation.verdicts import NONE, PREFIX
from tests.studies.blind_validation.files import FILES, conditions, short

# MuJoCo and our effect models agree on these, except for friction: (file, kind), share
_ALIKE = (
    ("hexapod_file", "soft_servo", 0.02),
    ("hexapod_file", "slow_servo", 0.01),
    ("hexapod_file", "length", 0.001),
    ("hexapod_file", "warming", 0.001),
    ("arm6_file", "soft_link", 0.002),
    ("arm6_file", "tilted_axis", 0.001),
    ("arm6_file", "base_on_springs", 0.001),
    ("arm6_file", "soft_servo_on_a_slope", 0.001),
    ("arm6_file", "soft_servo_under_a_load", 0.001),
)


def _fault(file, kind, seed=5):
    known = conditions(file)
    return draw_fault(kind, known.model, known.mechanism, np.random.default_rng(seed))


def _moved(file, fault, offsets=None):
    """What a fault does to the positions on our own plant and on MuJoCo's, (m, 3) each."""
    known = conditions(file)
    for plant in ("own", "mujoco"):
        read = [robots.noise_free(short(plant, file, acting, offsets), known) for acting in ((fault,), ())]
        yield rows.measured(read[0]) - rows.measured(read[1])


@pytest.mark.parametrize(("file", "kind", "share"), _ALIKE)
def test_a_fault_is_the_same_on_both_plants(file, kind, share):
    own, other = _moved(file, _fault(file, kind))
    assert np.abs(own).max() > 1e-3
    assert np.linalg.norm(own - other) < share * np.linalg.norm(own)


@pytest.mark.parametrize("kind", ["soft_servo", "soft_servo_on_a_slope"])
def test_loads_are_those_where_a_robot_stands(kind):
    """Zeros off by up to 0.9 mm and 0.2 mm of sag: with the loads at the commanded pose 7 % of it were wrong."""
    own, other = _moved("hexapod_file", _fault("hexapod_file", kind).scaled(5.0), (-0.9, -0.9, 0.0, -0.2, -0.5, 0.2))
    assert np.abs(own).max() > 0.1
    assert np.linalg.norm(own - other) < 0.01 * np.linalg.norm(own)


@pytest.mark.parametrize("file", FILES)
def test_every_fault_has_its_places_in_the_file(file):
    known = conditions(file)
    kinds = set(kinds_of(known.model, known.mechanism)) - {NONE}
    assert {"play", "soft_servo", "slow_servo", "length", "base_on_springs", "speed_friction"} <= kinds
    for kind in kinds:
        for seed in range(4):
            mujoco_plant(known, short("mujoco", file).offsets, _fault(file, kind, seed)).machine(3.0)


@pytest.mark.parametrize("kind", KINDS)
def test_the_right_answer_is_a_law_that_the_diagnosis_tries_or_none(kind):
    file = next(f for f in FILES if kind in kinds_of(conditions(f).model, conditions(f).mechanism))
    fault, robot = _fault(file, kind), conditions(file).mechanism
    if fault.outside:
        assert fault.truth == f"{PREFIX}:{kind}" and fault.effect == kind and not fault.numbers(robot)
    elif KINDS[kind].effect_model is None:
        assert fault.truth == NONE and not fault.effect
        # the calibration represents it: on 45 points, more than it has parameters, 5 % of the noise are left at most
        assert (
            robots.gap_over_noise(
                short("own", file, (fault,), across_mm=(-40.0, 0.0, 40.0), points=5), conditions(file)
            )
            < 0.05
        )
    else:
        effect, values = fault.values(robot)
        assert fault.truth == fault.effect == effect.name == KINDS[kind].answer
        assert fault.numbers(robot) == ({} if "load_kg" in fault.more else {effect.name: values})


def test_one_place_means_that_place_alone():
    alone = Counter()
    for seed in range(40):
        fault = _fault("hexapod_file", "play", seed)
        assert min(fault.sizes) >= 0.0
        alone[bool(fault.leg)] += 1
        assert not fault.leg or np.flatnonzero(fault.sizes).tolist() == [fault.leg - 1]
    # a third of 40: fewer than 5 or more than 24 come once in a thousand such draws
    assert 5 <= alone[True] <= 24


def test_a_robot_is_its_seed_as_strong_as_it_says_and_survives_as_text():
    known = conditions("hexapod_file")
    member = Member("own", "hexapod_file", 2)
    robot, measurements = draw.draw_file_robot(member, known)
    again, same = draw.draw_file_robot(member, known)
    assert robot == again and measurements.equals(same)
    assert robot.cause == "soft_servo" and robot.truth == "drive_compliance"
    (fault,) = robot.acting
    # the last step towards it is along a linear effect
    assert 0.9 * draw.FILE_STRENGTHS[0] < fault.strength < 1.1 * draw.FILE_STRENGTHS[1]
    twice = draw.as_driven(replace(robot, acting=(fault.scaled(2.0),)), known)[0].acting[0]
    np.testing.assert_allclose(twice.strength, 2.0 * fault.strength, rtol=0.02)
    answer = robot.answer(known)
    assert robots.robot_of(answer["drawn"]) == robot and json.loads(answer["drawn"])["plant"] == "own"
    # what it leaves in the noise-free residual is what the oracle finds in the noisy one
    count = len(measurements) * 3 * fault.strength**2
    np.testing.assert_allclose(robot.oracle_chi2, count, rtol=0.2)
    listed = parts(robot, "drive_compliance", _budget(), known.noise_rms_mm)
    assert listed.set_index("part").loc["drive_compliance", "strength"] == fault.strength


def test_a_campaign_has_what_tells_causes_apart_and_fresh_runs_go_elsewhere():
    known = conditions("rrru3_file")
    robot, measurements = draw.draw_file_robot(Member("own", "rrru3_file", 1), known)
    assert robot.cause == NONE and not robot.acting and len(measurements) <= 220
    assert set(measurements["speed_mm_s"]) == {40.0, 120.0} and set(measurements["payload_kg"]) == {0.0, 3.0}
    assert set(rows.direction(measurements)) == {-1, 1}
    elsewhere = draw.fresh(robot, known).plan(known).targets()
    assert np.abs(elsewhere - robot.plan(known).targets()).max() > 5.0
    assert np.linalg.norm(robots.residual(measurements, known), axis=1).mean() < 2.0 * known.noise_rms_mm


def test_a_fault_that_the_calibration_takes_up_cannot_be_sized():
    """Legs that always push never change sides of their clearance: it is a length."""
    fault = Fault("clearance", (0.1,) * 6, {})
    with pytest.raises(UnreachableError, match="a calibration absorbs clearance"):
        draw.sized(short("own", "hexapod_file"), fault, 3.0, conditions("hexapod_file"))


def test_a_fault_that_nobody_has_is_none():
    """A drive's compliance of a size beyond its parameter's bound."""
    known = conditions("arm6_file")
    effect = find("drive_compliance", known.mechanism)
    most = effect.parameters.parameters[0].high
    assert Fault("soft_servo", (1.01 * most, 0.0, 0.0, 0.0, 0.0, 0.0), {}).beyond(known.mechanism)
    assert not Fault("soft_servo", (0.99 * most, 0.0, 0.0, 0.0, 0.0, 0.0), {}).beyond(known.mechanism)
    assert Fault("base_on_springs", (1.0, 1.0, 0.0, 0.0), {}).beyond(known.mechanism)
    # the library has no effect model of it, and so no bound
    assert not Fault("speed_friction", (10.0,) * 6, {}).beyond(known.mechanism)


# with one cause and one from outside; with several
@pytest.mark.parametrize(("file", "number"), [("hexapod_file", 1), ("arm6_file", 2), ("hexapod_file", 3)])
def test_a_robot_of_a_file_as_robots_are_has_several_causes_of_its_own(file, number):
    known, member = conditions(file), Member("as_robots_are", file, number)
    robot, measurements = draw.drawn(member, known)
    assert robot == draw.drawn(member, known)[0] and robot.plant == "own" and robot.noise
    outside = [one for one in robot.acting if one.outside]
    assert len(outside) == (number % 3 == 1) and 1 <= len(robot.acting) - len(outside) <= 6
    for one in robot.acting:
        assert 0.9 * draw.MANY[0] < one.strength < 1.1 * draw.MANY[1]
        alone = robots.gap_over_noise(replace(robot, acting=(one,)), known)
        np.testing.assert_allclose(alone, one.strength, rtol=1e-9)
    answer = robot.answer(known)
    assert robots.robot_of(answer["drawn"]) == robot and answer["weakest"] == min(one.strength for one in robot.acting)
    assert answer["truth"] == "+".join(sorted(one.truth for one in robot.acting))
    assert set(robot.numbers(known)) == {one.effect for one in robot.acting if not one.outside}
    # noise as it was drawn, beyond the stated one
    off = rows.measured(measurements) - rows.measured(robots.noise_free(robot, known))
    assert off.std() > 1.05 * known.noise_mm
    listed = parts(robot, "none", _budget(), known.noise_rms_mm).set_index("part")
    for one in robot.acting:
        assert listed.loc[one.effect, "strength"] == one.strength
    assert listed.loc["scatter", "strength"] == NoiseModel(**robot.noise).beyond


def test_axes_of_a_robot_of_a_file_as_robots_are_are_found_by_its_calibration():
    known = conditions("arm6_file")
    robot = draw.bare_file_robot(Member("as_robots_are", "arm6_file", 0), np.random.default_rng(4), known)
    assert len(robot.offsets) == len(known.mechanism.candidates) and min(map(abs, robot.offsets)) > 0.0
    left = robots.residual(robots.noise_free(robot, known), known)
    assert np.linalg.norm(left, axis=1).max() < 0.1 * known.noise_mm


def _budget():
    """A budget without parts."""
    import pandas as pd

    return pd.DataFrame(columns=["part", "kind", "rms_mm", "share", "share_low", "share_high", "probability"])


@pytest.mark.parametrize("file", FILES)
def test_effects_of_the_nominal_robot_act_on_the_one_with_reflectors(file):
    """Its reflectors are sites, too: the score uses the effects of the nominal robot on it."""
    known = conditions(file)
    about = score.Known(known, GapSettings().library(known.mechanism))
    problem = score._problem(robots.noise_free(short("own", file), known), about, about.library)
    sites = len(problem.mechanism.legs.sites)
    for name, effect in about.library.items():
        coordinates = effect.coordinates
        values = coordinates.to_values(coordinates.typical, coordinates.shapes[0])
        assert effect.contribute(problem.motion, values).twists.shape[1] == sites, name
