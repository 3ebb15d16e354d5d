"""Effects of many waves of the drives' own angles: columns against differences, sites, which robots have them."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.drive_spectra import resolved
from rrru.diagnosis.state import ModelState
from rrru.effects.drive_error_function import ORDERS
from rrru.effects.library import find
from rrru.effects.motion import Course, make_motion
from rrru.kinematics.dynamics import Masses
from rrru.robots.catalogue import make_mechanism
from rrru.robots.delta import Delta
from rrru.robots.hexapod import hexapod
from rrru.robots.linear_delta import LinearDelta
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from tests.diagnosis import arms
from tests.robots import two_arms

_ANGLES = np.radians([0.0, 20.0, 120.0, 140.0, 240.0, 260.0])
_RING = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), 0.0 * _ANGLES], axis=1)
HEXAPOD = hexapod(300.0 * _RING, 120.0 * np.roll(_RING, 1, axis=0), 400.0, 80.0)
FUNCTION, SHARP = "drive_error_function", "transmission_orders"
WAVES = ((0, 3.0), (4, 7.25), (0, 41.5), (5, 1.5))
# numbers of coefficients of the function that are looked at: of several drives, constants, sines and cosines, low and
# high orders
_ONE = 1 + 2 * len(ORDERS)
_SOME = (0, 1, 2 * 6, _ONE + 2, _ONE + 2 * 30 + 1, 3 * _ONE + 7, 6 * _ONE - 1)


def _law(name):
    """The effect of the arm, with its waves where these are to be found."""
    effect = find(name, arms.ARM)
    return effect.with_waves(WAVES) if name == SHARP else effect


@pytest.fixture(scope="module")
def frame():
    return arms.measure(count=40)


@pytest.fixture(scope="module")
def motion(frame):
    return arms.problem_of(frame).motion


def _expected(name, number, drive):
    """Drive and function (n,) of one coefficient, by their definition."""
    if name == FUNCTION:
        joint, rest = divmod(number, _ONE)
        # the constant is the cosine of order 0
        order, cosine = (rest + 1) // 2, rest % 2 == 0
    else:
        (joint, order), cosine = WAVES[number // 2], number % 2
    return joint, (np.cos if cosine else np.sin)(order * drive[:, joint])


@pytest.mark.parametrize("name", [FUNCTION, SHARP])
def test_a_coefficient_turns_its_own_joint_by_its_wave(name, motion):
    effect = _law(name)
    count = len(effect.coordinates)
    assert count == (6 * _ONE if name == FUNCTION else 2 * len(WAVES))
    for number in _SOME if name == FUNCTION else range(count):
        values = effect.coordinates.to_values(1e-4 * np.eye(count)[number], {})
        twists = effect.contribute(motion, values).twists
        joint, wave = _expected(name, number, motion.drive)
        expected = np.zeros_like(twists)
        expected[:, arms.ARM.legs.site_numbers[f"joint {joint + 1}"], 5] = 1e-4 * wave
        np.testing.assert_allclose(twists, expected, rtol=0.0, atol=1e-15)


def test_the_functions_along_the_drives_are_differences_of_what_the_law_contributes(motion):
    effect, generator = _law(FUNCTION), np.random.default_rng(0)
    functions = effect.along_drives(motion)
    assert [f.shape for f in functions] == [(40, _ONE)] * 6
    start, site = 1e-4 * generator.standard_normal(len(effect.parameters)), arms.ARM.legs.site_numbers
    before = effect.contribute(motion, start).twists
    together = np.concatenate(functions, axis=1)
    for number in _SOME:
        step = 1e-3 * np.eye(len(start))[number]
        slope = (effect.contribute(motion, start + step).twists - before) / 1e-3
        own = site[f"joint {number // _ONE + 1}"]
        np.testing.assert_allclose(slope[:, own, 5], together[:, number], rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("name", [FUNCTION, SHARP])
def test_columns_are_slopes_of_exact_readings(name, frame):
    """Central differences through the exact closure, about the calibrated arm; the generic way gives the same."""
    effect = _law(name)
    problem = arms.problem_of(frame, library={name: effect})
    if name == FUNCTION:
        assert len(problem.library[name].coordinates) < len(effect.coordinates)
        problem = replace(problem, library={name: effect})
    state = calibrate(problem)
    columns = problem.linearise(state).columns[name, 0]
    secant = replace(problem, library={name: replace(effect, along_drives=None)}).linearise(state).columns[name, 0]
    # turns by errors and by waves add up as vectors or one after the other
    largest = np.abs(columns).max()
    np.testing.assert_allclose(columns, secant, rtol=0.0, atol=2e-5 * largest)
    for number in _SOME if name == FUNCTION else range(len(effect.coordinates)):
        step = 1e-4 * np.eye(len(effect.coordinates))[number]
        down, up = (problem.residual(ModelState(state.deviations, {(name, 0): sign * step})) for sign in (-1.0, 1.0))
        assert np.abs(columns[..., number]).max() > 1.0
        np.testing.assert_allclose(columns[..., number], (down - up) / 2e-4, rtol=0.0, atol=5e-5 * largest)


def test_a_drive_that_others_follow_moves_them_too():
    """Joints on rods: the drive's column is what moving it does, not what turning its own joint does."""
    robot = make_mechanism("two_arms", two_arms.section())
    count, names = 20, two_arms.DRIVES
    drive = robot.legs.home_drives + np.random.default_rng(2).uniform(-0.5, 0.5, (count, len(names)))
    arm = np.array(["right", "left"] * count)[:count]
    position, still, rest = robot.guess(drive, arm), np.zeros((count, 3)), np.zeros_like(drive)
    course = Course(
        position, drive, drive, np.arange(count), np.arange(count), still, still, np.zeros(count), (rest, rest)
    )
    motion, effect = make_motion(robot, Masses(0.0, 0.0, 0.0), course), find(FUNCTION, robot)
    poses = robot.solve(drive, position)
    at = robot.map(drive, poses)
    functions = effect.along_drives(motion)
    for k in range(len(names)):
        number = k * _ONE + 6
        made = at.move(effect.contribute(motion, np.eye(len(effect.parameters))[number]).twists)
        np.testing.assert_allclose(functions[k][:, 6, None] * at.drive_effect[:, :, k], made, rtol=0.0, atol=1e-6)
        h = 1e-5 * np.eye(len(names))[k]
        moved = (robot.guess(drive + h, arm) - robot.guess(drive - h, arm)) / 2e-5
        np.testing.assert_allclose(made, np.cos(3.0 * drive[:, k, None]) * moved, rtol=0.0, atol=1e-3)


def test_what_repeats_with_every_turn_and_what_does_not(motion):
    generator = np.random.default_rng(1)

    def parted(effect, turn):
        values = effect.coordinates.to_values(1e-4 * generator.standard_normal(len(effect.coordinates)), {})
        twists = [effect.contribute(replace(motion, drive=motion.drive + by), values).twists for by in (0.0, turn)]
        return np.abs(twists[1] - twists[0]).max()

    function = _law(FUNCTION)
    assert parted(function, 2.0 * np.pi) < 1e-14 and parted(function, np.pi) > 1e-4
    sharp = find(SHARP, arms.ARM)
    assert parted(sharp.with_waves(((2, 7.25),)), 2.0 * np.pi / 7.25) < 1e-14
    assert parted(sharp.with_waves(((2, 7.25),)), 2.0 * np.pi) > 1e-5


def test_a_law_without_waves_does_nothing_and_one_with_them_is_of_the_stated_drives(motion):
    nothing = find(SHARP, arms.ARM)
    assert len(nothing.coordinates) == 0 and not np.any(nothing.contribute(motion, []).twists)
    effect = nothing.with_waves(WAVES, -3.0)
    assert [parameter.leg for parameter in effect.parameters] == [1, 1, 5, 5, 1, 1, 6, 6]
    assert len(set(effect.parameters.names)) == 8 and effect.coordinates.log_prior == -3.0


@pytest.mark.parametrize("name", [FUNCTION, SHARP])
def test_sharp_orders_are_of_robots_whose_drives_all_turn(name):
    for robot in (Ptt3(), LinearDelta()):
        assert (find(name, robot) is not None) == (name == FUNCTION)
    for robot in (Rrru3(), Delta(), arms.ARM):
        assert find(name, robot).name == name


@pytest.mark.parametrize(("robot", "stroke"), [(HEXAPOD, 160.0), (Ptt3(), 1000.0)], ids=["stated", "assumed"])
def test_the_waves_of_a_slide_make_any_function_of_its_stroke(robot, stroke, motion):
    """The longest wave is twice the stroke, 1 m where none is stated: no two ends of a stroke have to be alike."""
    along = np.linspace(0.1, 0.9, 40)[:, None] * stroke
    effect, drive = find(FUNCTION, robot), np.tile(along, (1, len(robot.parts.units)))
    assert {parameter.unit for parameter in effect.parameters} == {"mm"}
    functions = effect.along_drives(replace(motion, drive=drive))
    for own in functions:
        np.testing.assert_allclose(own[:, 1:3], np.hstack([f(np.pi * along / stroke) for f in (np.sin, np.cos)]))
        np.testing.assert_allclose(own[:, 10], np.cos(5.0 * np.pi * along[:, 0] / stroke), atol=1e-12)
    again = effect.along_drives(replace(motion, drive=drive + 2.0 * stroke))
    np.testing.assert_allclose(again, functions, atol=1e-11)


@pytest.mark.parametrize("span", [0.2, 1.0, 7.0, 60.0])
def test_what_a_range_resolves_is_the_same_process_there(span, motion):
    """Covariances of the functions over the measured range, of each drive and spectrum; a few coefficients do it."""
    whole, generator = _law(FUNCTION), np.random.default_rng(3)
    drive = 0.3 + span * generator.random((40, 6))
    moved = replace(motion, drive=drive)
    coarse = resolved(whole, moved)
    between = replace(motion, drive=drive.min(axis=0) + generator.random((40, 6)) * np.ptp(drive, axis=0))
    functions, full = coarse.along_drives(between), whole.along_drives(between)
    assert len(coarse.coordinates.roots) == len(whole.coordinates.spectra)
    for roots, sizes in zip(coarse.coordinates.roots, whole.coordinates.spectra, strict=True):
        for own, root, every, size in zip(functions, roots, full, np.split(sizes, 6), strict=True):
            exact = (every * size**2) @ every.T
            np.testing.assert_allclose(own @ root @ root.T @ own.T, exact, rtol=0.0, atol=3e-5 * exact.max())
    # as many as half waves of the highest order fit into the range, and some for its ends
    for own in functions:
        assert own.shape[1] <= min(_ONE, 2.0 * ORDERS[-1] * span / (2.0 * np.pi) + 60)
    # and they stand for the parameters
    values = generator.standard_normal(len(coarse.coordinates))
    parts = np.split(values, np.cumsum([own.shape[1] for own in functions])[:-1])
    of_parameters = np.split(coarse.coordinates.to_values(values, {}), 6)
    for own, part, every, parameters in zip(functions, parts, full, of_parameters, strict=True):
        np.testing.assert_allclose(own @ part, every @ parameters, rtol=0.0, atol=1e-9 * np.abs(own @ part).max())


def test_every_spectrum_falls_with_the_order_alike_for_all_drives():
    """Sine and cosine of an order have one size: 1 / n for steps at the end, 1 / n^2 for corners, or less."""
    falling = []
    for spectrum in _law(FUNCTION).coordinates.spectra:
        by_drive = np.reshape(spectrum, (6, _ONE))
        sizes = by_drive[:, 1:].reshape(6, len(ORDERS), 2)
        # the constant is the function at the unknown value of zeroing
        np.testing.assert_allclose(by_drive[:, 0] ** 2, (sizes[:, :, 0] ** 2).sum(axis=1))
        assert (sizes == sizes[:1, :, :1]).all() and (np.diff(sizes[0, :, 0]) <= 0.0).all()
        # slope in logarithms from order 32 to 64
        falling.append(np.log2(sizes[0, 31, 0] / sizes[0, 63, 0]))
    steps, corners, smooth = np.split(falling, [4, 9])
    for kind in (steps, corners, smooth):
        # the larger the bend, the later it falls
        assert (np.diff(kind) < 0.0).all()
    assert 0.9 < steps[0] < 1.0 < 1.9 < corners[0] < 2.0 < 10.0 < smooth[0]
    assert [one[-1] > 0.0 for one in _law(FUNCTION).coordinates.spectra] == [True] * 4 + [False] * 7
