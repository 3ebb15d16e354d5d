"""Sentences on zeros, payload and tilt: written where the readings determine these, and true there."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.diagnose import MeasuredRobot, with_wide_bounds
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.model_fit import fit_model
from rrru.diagnosis.payload_nuisance import WEIGHT
from rrru.diagnosis.result_notes import (
    REPEATABILITY_UNKNOWN,
    REPEATABILITY_UNSURE,
    ROBOT_REPEATS,
    SUCCESSIVE_ALIKE,
    noise_notes,
    payload_notes,
    serial_correlation,
    successive_notes,
    undetermined_payload_notes,
    zero_notes,
)
from rrru.diagnosis.terms import EffectTerm
from rrru.errors import ConfigError
from rrru.estimation.parameters import Block, Parameters
from rrru.kinematics.dynamics import Masses
from rrru.robots.serial import serial
from tests.diagnosis import campaigns

_NOISE_MM, _QUARTER = 0.02, 0.5 * np.pi
_ZERO = re.compile(r"^joint (\d): zero, or the part that it moves, is off by (\S+) degrees \(95 %: (\S+) to (\S+)\)$")


def _arm(generator):
    """An arm of seven axes with links and a tool of random lengths, of which all numbers are fitted."""
    turned = [(0.0, 340.0, -1.0), (0.0, 0.0, 1.0), (0.0, 400.0, 1.0), (0.0, 0.0, -1.0)]
    turned += [(0.0, 400.0, -1.0), (0.0, 0.0, 1.0), (0.0, 126.0, 0.0)]
    links = [
        {"a": a + 20.0 * generator.uniform(), "d": d * generator.uniform(0.8, 1.2), "alpha": sign * _QUARTER}
        for a, d, sign in turned
    ]
    limits, home = np.tile([-1.5, 1.5], (7, 1)), np.full(7, 0.3)
    return serial(links, limits, home, tool_mm=(60.0, 20.0, 50.0), parameter_set="full")


def _measured(robot, errors, generator, place_mm=None, known=True):
    """The problem of 90 poses where the tool was read, or a target at a place; known: whether the place is stated."""
    driven = generator.uniform(-1.4, 1.4, (90, 7))
    command = robot.forward(driven)
    twists = robot.twists_of(errors)
    poses = robot.solve(driven, command, twists)
    seen = robot.measured(poses, twists)
    frame = pd.DataFrame({"run": 1, "trajectory": "poses", "point": np.arange(1, 91), "status": "ok"})
    frame = frame.assign(time_s=np.nan, speed_mm_s=np.nan, payload_kg=np.nan)
    if place_mm is not None:
        seen = poses.point(np.asarray(place_mm))
        frame = frame.assign(target="ball", **rows.vector_columns("target", np.tile(place_mm, (90, 1))))
    seen = seen + _NOISE_MM * generator.standard_normal(seen.shape)
    drives = dict(zip(robot.parts.columns, driven.T, strict=True))
    frame = frame.assign(**drives, **rows.vector_columns("command", command), **rows.vector_columns("measured", seen))
    robot = robot.with_measurement_config(rows.measurement_config(frame, () if known is False else ("ball",)))
    robot = robot.with_identifiable_parameters(driven, command, rows.readings(frame, robot.characteristic_length_mm))
    return make_diagnosis_problem(frame, with_wide_bounds(robot), Masses(0.0, 0.0, 0.0), _NOISE_MM, {})


def _zeros(problem):
    """Notes on zeros of a calibration."""
    return list(zero_notes(fit_model(problem, [calibrate(problem)]).estimate, problem.mechanism))


@pytest.mark.parametrize("seed", range(6))
def test_a_sentence_on_a_zero_is_true(seed):
    """Frame and tool are off by as much as a mounting may be; zeros are lost or right."""
    generator = np.random.default_rng(seed)
    robot = _arm(generator)
    zeros = np.where(generator.random(7) < 0.5, np.radians(generator.uniform(-3.0, 3.0, 7)), 0.0)
    zeros[6] = 7e-5
    errors = {f"dq{k}": zero for k, zero in enumerate(zeros.tolist(), 1)}
    errors |= {name: 2.0 * generator.standard_normal() for name in ("tool_x", "tool_y", "tool_z", "world_x", "world_y")}
    errors |= {"world_rz": 0.01}
    said = {}
    for note in _zeros(_measured(robot, errors, generator)):
        if found := _ZERO.match(note):
            joint, value, low, high = int(found[1]), *map(float, found.groups()[1:])
            truth = np.degrees(zeros[joint - 1])
            assert low < value < high and abs(truth - value) < 2.5 * (high - low)
            said[joint] = value
        else:
            assert "are not separately identifiable" in note and note[:8] in ("joint 1:", "joint 7:")
    lost = np.flatnonzero(np.abs(zeros[1:6]) > np.radians(0.5)) + 2
    assert set(said) == set(lost.tolist())


@pytest.mark.parametrize("known", [True, False])
def test_the_zero_of_the_last_joint_is_confounded_with_the_place_of_a_target(known):
    """The target is 3 mm off its stated place, or its place is unknown; the joint's own zero is right.

    An unknown place takes all of it: the zero stays as the file has it, and nothing is said of it.
    """
    generator = np.random.default_rng(8)
    robot = _arm(generator)
    place, off = np.array([70.0, -30.0, 60.0]), Rotation.from_rotvec([0.0, 0.0, 0.05]).as_matrix()
    problem = _measured(robot, {"dq3": 0.02}, generator, off @ place, known)
    stated = problem.measurements.assign(**rows.vector_columns("target", np.tile(place, (90, 1))))
    notes = _zeros(replace(problem, measurements=stated))
    last = [note for note in notes if note.startswith("joint 7")]
    assert len(last) == known == ("dq7" in problem.mechanism.parameters.names)
    assert all("zero and the place of the target are not separately identifiable" in note for note in last)
    (third,) = (note for note in notes if note.startswith("joint 3"))
    assert _ZERO.match(third)


def test_a_zero_confounded_with_a_link_is_said_to_be_most_probable_only():
    """As where poses hardly separate a zero from a shift of the next joint, which the prior holds to 10 mm."""
    generator = np.random.default_rng(3)
    robot = _arm(generator)
    problem = _measured(robot, {"dq3": 0.2}, generator)
    estimate, names = fit_model(problem, [calibrate(problem)]).estimate, problem.mechanism.parameters.names
    assert _ZERO.match(next(note for note in zero_notes(estimate, problem.mechanism) if note.startswith("joint 3")))
    zero, shift = names.index("dq3"), next(k for k, sd in enumerate(estimate.parameters.sd) if sd == 10.0)
    direction = np.zeros(len(names))
    direction[[zero, shift]] = 0.02, 10.0
    unsure = replace(estimate, covariance=estimate.covariance + np.outer(direction, direction))
    (note,) = (note for note in zero_notes(unsure, problem.mechanism) if note.startswith("joint 3"))
    assert "zero is not determined by the readings, its most probable offset is 11.5 degrees (95 %: 9.2" in note


def test_a_zero_that_is_as_good_as_the_stated_load_is_determined():
    """Most of its variance, of some 1e-5 rad, is that of a load, which the readings determine less than its prior."""
    generator = np.random.default_rng(3)
    robot = _arm(generator)
    problem = _measured(robot, {"dq3": 0.02}, generator)
    estimate, names = fit_model(problem, [calibrate(problem)]).estimate, problem.mechanism.parameters.names
    by_load = np.zeros(len(names))
    by_load[names.index("dq3")] = 3.0 * estimate.standard_errors[names.index("dq3")]
    covariance = np.block([[estimate.covariance + np.outer(by_load, by_load), by_load[:, None]], [by_load, 1.0]])
    parameters = Parameters((*estimate.parameters.blocks, Block.of(WEIGHT, ("extra_kg",), ("kg",), 1.0)))
    loaded = replace(
        estimate,
        problem=replace(estimate.problem, parameters=parameters),
        values=np.append(estimate.values, 0.0),
        at_bound=np.append(estimate.at_bound, False),
        covariance=covariance,
    )
    (note,) = (note for note in zero_notes(loaded, problem.mechanism) if note.startswith("joint 3"))
    assert _ZERO.match(note)


def _weighed(passes, stated_kg, unexplained=0.0):
    """Errors of payload and tilt, and both kinds of notes, of a soft robot with a stated mass of its platform.

    unexplained: probability that something is.
    """
    name = "drive_compliance"
    library = {name: campaigns.EFFECTS[name]}
    frame = campaigns.measure((campaigns.strong(name, 30.0),), plan=campaigns.plan_of(passes))
    masses = replace(campaigns.MASSES, platform_kg=stated_kg)
    problem = make_diagnosis_problem(frame, campaigns.MODEL, masses, campaigns.NOISE_MM, library)
    sizes = 20.0 * np.asarray(library[name].coordinates.typical)
    fit = fit_model(problem, [calibrate(problem)], [EffectTerm(name)], sizes)
    posterior = SimpleNamespace(probability_unexplained=unexplained)
    found = SimpleNamespace(problem=problem, fit=fit, posterior=posterior)
    return fit.weight, list(payload_notes(found)), list(undetermined_payload_notes(found))


_PLATFORM_KG = campaigns.MASSES.platform_kg


@pytest.mark.parametrize("passes", [(campaigns.FORWARD, campaigns.REVERSE), (campaigns.FORWARD, campaigns.LOADED)])
def test_of_a_payload_as_stated_nothing_is_said(passes):
    weight, notes, undetermined = _weighed(passes, _PLATFORM_KG)
    assert weight and not notes and not undetermined


def test_a_mass_that_is_not_stated_is_said_where_two_loads_were_driven():
    _, (note,), undetermined = _weighed((campaigns.FORWARD, campaigns.LOADED), 0.5 * _PLATFORM_KG)
    low, high = map(float, re.search(r"\(95 %: (\S+) to (\S+)\) more than stated", note).groups())
    assert low < 0.5 * _PLATFORM_KG < high < 1.2 * low and not undetermined


def test_a_mass_beside_something_unexplained_may_be_a_part_of_that():
    weight, notes, undetermined = _weighed((campaigns.FORWARD, campaigns.LOADED), 0.5 * _PLATFORM_KG, 0.9)
    assert weight and not notes and not undetermined


def test_a_mass_that_ends_at_its_bound_is_said():
    """Its standard error is not known there; a twentieth of the stated mass is on the platform."""
    weight, notes, _ = _weighed((campaigns.FORWARD, campaigns.LOADED), 20.0 * _PLATFORM_KG)
    (note,) = (note for note in notes if "mass" in note)
    value, low, high = map(float, re.search(r"is at its bound, (\S+) kg \(95 %: (\S+) to (\S+)\): ", note).groups())
    assert value == low == pytest.approx(weight[0][2], rel=1e-2) and high < -0.9 * 0.9 * 20.0 * _PLATFORM_KG
    assert note.endswith("sizes of compliances may be biased; check the stated masses and payloads")


def test_with_one_load_a_mass_and_a_compliance_are_confounded():
    weight, notes, (note,) = _weighed((campaigns.FORWARD, campaigns.REVERSE), 0.5 * _PLATFORM_KG)
    assert weight[0][2] > 3.0 * weight[0][3]
    assert not notes and note.endswith("are not separately identifiable from these readings: measure with two loads")


def _stops_again(again, sd_mm, found_mm):
    """A problem of 60 stops of which some were measured again, with a noise of the readings and one that was found."""
    rng = np.random.default_rng(again)
    place = np.concatenate([grid := rng.uniform(-300.0, 300.0, (60, 3)), grid[:again]])
    columns = rows.vector_columns("command", place)
    columns |= rows.vector_columns("measured", place + sd_mm * rng.standard_normal(place.shape))
    frame = pd.DataFrame({"run": 1, "trajectory": "stops", "point": np.arange(1, len(place) + 1), **columns})
    frame = frame.assign(status="ok", speed_mm_s=np.nan, payload_kg=np.nan, time_s=np.nan)
    return SimpleNamespace(measurements=frame, used=np.ones(len(place), dtype=bool), noise_mm=found_mm, noise=None)


@pytest.mark.parametrize(
    ("again", "sd_mm", "said", "why"),
    [
        (10, 0.03, ROBOT_REPEATS, "the robot has errors that are not in the model"),
        (10, 0.09, "", "the robot does not repeat, or the instrument is worse"),
        (1, 0.06, REPEATABILITY_UNSURE, "the instrument is worse, or the robot has errors that are not in the model"),
        (0, 0.03, REPEATABILITY_UNKNOWN, "the instrument is worse, or the robot has errors that are not in the model"),
    ],
)
def test_what_does_not_repeat_is_said_by_what_poses_say_that_were_measured_again(again, sd_mm, said, why):
    """A fixed error of an encoder looks like random error of 0.09 mm; its repeats agree within the stated 0.03."""
    first, *more = noise_notes(_stops_again(again, sd_mm, 0.09), 0.03, 1.3)
    assert first == f"noise stated 0.03 mm per axis, found 0.09: {why}" and more == ([said] if said else [])
    # a single axis above the limit
    one = _stops_again(again, sd_mm, 0.035)
    one.noise = SimpleNamespace(axis_mm=np.array([0.02, 0.03, 0.05]))
    # next to a found noise of 0.035 mm ten repeats are too few
    expected = REPEATABILITY_UNSURE if said == ROBOT_REPEATS else said
    assert [*noise_notes(one, 0.03, 1.3)] == ([expected] if expected else [])


def _swaying(error_mm, found_mm=0.09):
    """An inference whose residuals (n, 3) at n stops are an error that is not in the model, and noise of 0.03 mm."""
    n = len(error_mm)
    residual = error_mm + 0.03 * np.random.default_rng(3).standard_normal((n, 3))
    number = np.arange(n)
    problem = SimpleNamespace(noise_mm=found_mm, on_robot=np.ones(n, dtype=bool), run=0 * number, stop=number)
    problem.residual = lambda _: residual
    return SimpleNamespace(problem=problem, state=None)


def test_an_error_that_follows_the_time_is_no_random_error():
    """A pedestal that sways with a period of 20 stops, and the same errors in random order."""
    sway = 0.12 * np.sin(np.arange(150)[:, None] / 20 * 2 * np.pi) * [0.8, 0.6, 0.5]
    shuffled = np.random.default_rng(4).permutation(sway)
    assert [*successive_notes(_swaying(sway), 0.03, 1.3)] == [SUCCESSIVE_ALIKE]
    assert not [*successive_notes(_swaying(shuffled), 0.03, 1.3)]
    # as large as stated, or not stated
    assert not [*successive_notes(_swaying(sway, 0.035), 0.03, 1.3)]
    assert not [*successive_notes(_swaying(sway), None, 1.3)]
    # too few stops to say so
    assert not [*successive_notes(_swaying(sway[:12]), 0.03, 1.3)]


def test_rows_of_one_stop_and_of_two_runs_are_no_pairs():
    residual = np.repeat(np.random.default_rng(5).standard_normal((200, 3)), 2, axis=0)
    stop = np.repeat(np.arange(200), 2)
    correlation, pairs = serial_correlation(residual, 0 * stop, stop)
    assert pairs == 199 and abs(correlation) < 4.0 / np.sqrt(pairs)
    assert serial_correlation(residual, 0 * stop, np.arange(400))[0] > 0.4
    assert serial_correlation(residual, np.arange(400), np.arange(400)) == (0.0, 0)


def test_a_stated_noise_of_zero_is_no_noise_and_noted():
    (note,) = noise_notes(SimpleNamespace(noise_mm=0.021), 0.0, 2.0)
    assert note == "noise_mm is 0, which no instrument reaches: the noise is estimated, 0.021 mm per axis"
    assert not [*noise_notes(SimpleNamespace(noise_mm=0.021), None, 2.0)]


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("noise_mm", -0.02, "0 or more"),
        ("noise_rad", 0.0, "a positive number"),
        ("noise_rad", -1e-4, "a positive number"),
    ],
)
def test_a_noise_that_no_instrument_has_is_refused(name, value, allowed):
    with pytest.raises(ConfigError, match=f"{name} is {value}; allowed: {allowed}, or None where it is unknown"):
        MeasuredRobot(campaigns.MODEL, **{name: value})


def test_a_stated_noise_of_zero_is_allowed():
    assert MeasuredRobot(campaigns.MODEL, noise_mm=0.0).noise_mm == 0.0
