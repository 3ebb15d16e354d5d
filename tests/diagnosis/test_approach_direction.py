"""From which side drives come to readings: what the rows determine, what the readings do, and what is done without."""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from rrru.campaign import measurements as rows
from rrru.diagnosis.approach_direction import at_reversals, read_back_jitter, rest_widths
from rrru.diagnosis.determined import require_determined
from rrru.diagnosis.diagnose import with_wide_bounds
from rrru.diagnosis.inference import infer
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.model_fit import fit_model
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import GEOMETRY
from rrru.diagnosis.settings import Prior
from rrru.diagnosis.state import ModelState
from rrru.effects.backlash import play
from rrru.effects.library import find
from rrru.effects.protocol import together
from rrru.errors import FitError
from rrru.kinematics.inverse import inverse_kinematics
from rrru.pipeline.setup import as_measured
from tests.diagnosis import arms
from tests.diagnosis.campaigns import ROBOT, active, measure, plan_of, problem_of, robot_of, strong

ERRORS = np.array([2e-3, -1e-3, 1.5e-3, 0.4, -0.3, 0.5, 0.2])
WIDTHS = np.full(3, 1e-8)


@pytest.mark.parametrize("jitter", [1e-6, 1e-5, 1e-4])
def test_the_jitter_of_a_drive_is_found_together_with_its_motion(jitter):
    """A swing of 40 points a period, a slow drive and one at rest, in runs of 30 points."""
    steps, generator = np.arange(300), np.random.default_rng(1)
    drive = np.stack([0.3 * np.sin(2.0 * np.pi * steps / 40.0), 1e-3 * steps, np.zeros(300)], axis=1)
    found = read_back_jitter(drive + jitter * generator.standard_normal(drive.shape), steps // 30)
    np.testing.assert_allclose(found, jitter, rtol=0.4)


@pytest.mark.parametrize("period", [3.0, 5.0, 7.0, 12.0, 40.0])
def test_a_motion_without_jitter_has_none(period):
    """However few of its points are read; rounding is left of a smooth one."""
    drive = 0.3 * np.sin(2.0 * np.pi * np.arange(300)[:, None] / period)
    assert rest_widths(drive, np.arange(300) // 30, ("rad",)) == 1e-8


def _swing(shift):
    """Path (97, 3) on which one drive swings as a sine, its crest `shift` rows after a reading, and readings' rows."""
    steps = np.arange(97)
    path = np.stack([1e-3 * steps, 0.2 * np.cos(np.pi * (steps - 24.0 - shift) / 48.0), 1e-3 * steps], axis=1)
    return path, np.arange(0, 97, 8)


def test_a_drive_that_turns_back_at_a_reading_leaves_its_sense_open_and_one_between_two_does_not():
    for shift, unknown in ((0.0, [3, 9]), (4.0, [])):
        path, index = _swing(shift)
        found = at_reversals(SimpleNamespace(path_drive=path, path_index=index, drive=path[index]), path, WIDTHS)
        assert np.flatnonzero(found[:, 1]).tolist() == unknown and not found[:, [0, 2]].any()


def test_where_two_interpolations_are_apart_none_determines_where_a_drive_reverses():
    """One crest is half a step from a reading, by another path a quarter: both readings next to it are open."""
    path, index = _swing(4.0)
    other, between = path.copy(), slice(25, 32)
    course = SimpleNamespace(path_drive=path, path_index=index, drive=path[index])
    assert not at_reversals(course, other, WIDTHS).any()
    other[between] = _swing(2.0)[0][between]
    assert np.flatnonzero(at_reversals(course, other, WIDTHS).any(axis=1)).tolist() == [3, 4]


def test_what_jitters_does_not_turn_back():
    """A slow drive read with a jitter of a fifth of its steps: each of its readings has one sense."""
    path, index = _swing(4.0)
    path[:, 0] = 1e-6 * np.arange(97) + 2e-5 * np.random.default_rng(2).standard_normal(97)
    course = SimpleNamespace(path_drive=path, path_index=index, drive=path[index])
    assert at_reversals(course, path, WIDTHS)[:, 0].sum() > 5
    assert not at_reversals(course, path, np.array([1.2e-4, 1e-8, 1e-8])).any()


def _driven(effects, widths):
    """A campaign's problem, and the sense (n, 3) in which the drives of the robot came to its points."""
    problem = problem_of(measure(effects))
    driven = robot_of().motion(plan_of(), ROBOT.inverse)
    share = play(np.ascontiguousarray(driven.path_drive), 0.5 * widths)[driven.path_index] / (-0.5 * widths)
    return problem, share


def test_known_senses_are_those_that_were_driven_and_open_ones_are_found_from_strong_backlash():
    widths = np.array([2e-3, 2e-3, 2e-3])
    problem, share = _driven((active("backlash", widths),), widths)
    state = ModelState(ERRORS, {("backlash", 0): widths})
    motion, known = problem.motion, problem.known["backlash"]
    own = play(np.ascontiguousarray(motion.path_drive), 0.5 * widths)[motion.path_index] / (-0.5 * widths)
    # the path between the points is an interpolation
    np.testing.assert_allclose(own[known], share[known], atol=0.1)
    found = problem.with_approach(state).motion.approach
    unknown = np.isfinite(found)
    assert unknown.sum() > 30 and (np.abs(found[unknown] - share[unknown]) < 0.2).mean() > 0.9


def test_a_fit_is_the_same_where_senses_of_approach_differ_at_points_that_it_does_not_use():
    widths = np.array([2e-3, 2e-3, 2e-3])
    problem, _ = _driven((active("backlash", widths),), widths)
    moved = problem.with_approach(ModelState(ERRORS, {("backlash", 0): widths}))
    assert not problem.fits_as(moved) and problem.fits_as(problem.at_complete(()))
    one, other = problem.at_complete({"backlash"}), moved.at_complete({"backlash"})
    assert len(one) < len(problem) and one.fits_as(other)
    assert not one.fits_as(other.without(np.arange(len(other)) == 0)) and not one.fits_as(replace(other, noise_mm=0.1))


def _likelihoods(problem, state, point, senses):
    """Likelihoods (k,) of senses (k, 3) at a point, up to a factor; what is read there is linear in them."""

    def left(sense):
        approach = problem.motion.approach.copy()
        approach[point] = sense
        return replace(problem, motion=replace(problem.motion, approach=approach)).residual(state)[point]

    without = left(np.zeros(3))
    change = np.stack([left(sense) - without for sense in np.eye(3)])
    return np.exp(-0.5 * ((without + senses @ change) ** 2).sum(axis=1) / problem.noise_mm**2)


@pytest.mark.parametrize("at_start", [True, False])
def test_expected_senses_are_those_of_all_combinations_one_by_one(at_start):
    """At the start of a run the drives may be between both sides, too: there the mean is over draws of such places."""
    widths = np.array([1e-4, 3e-4, 2e-4])
    problem, _ = _driven((active("backlash", widths),), widths)
    state = ModelState(ERRORS, {("backlash", 0): widths})
    found = problem.with_approach(state).motion.approach
    run, unknown = problem.run, np.isfinite(problem.motion.approach).all(axis=1)
    starts = np.flatnonzero(np.diff(run, prepend=-1))
    point = starts[0] if at_start else np.setdiff1d(np.flatnonzero(unknown), starts)[0]
    senses = np.array([*product((-1.0, 1.0), repeat=3)])
    weights = _likelihoods(problem, state, point, senses) / len(senses)
    if at_start:
        drawn = np.random.default_rng(1).standard_normal((400_000, 3)) / np.sqrt(3.0)
        senses = np.concatenate([senses, drawn])
        weights = np.concatenate([weights, _likelihoods(problem, state, point, drawn) / len(drawn)])
    np.testing.assert_allclose(found[point], np.average(senses, axis=0, weights=weights), atol=0.02)


def _open(problem, share, seed=0):
    """The problem with the senses of a share of its points open, too, whatever its rows determine."""
    approach, made = problem.motion.approach.copy(), problem.motion_at
    approach[np.random.default_rng(seed).random(len(approach)) < share] = 0.0

    def motion_at(*stands):
        return replace(made(*stands), approach=approach)

    known = {"backlash": np.isnan(approach).all(axis=1)}
    return replace(problem, motion=motion_at(), motion_at=motion_at, known=known)


@pytest.mark.parametrize("acting", [(), ("backlash",), ("drive_compliance",), ("encoder_eccentricity", "backlash")])
def test_open_senses_change_no_verdict_and_every_reading_counts(acting):
    """At two thirds of the points the senses are unknown; the robot's errors are found as if they were known."""
    frame = measure(tuple(strong(name, 4.0) for name in acting))
    found = infer(_open(problem_of(frame), 0.66), Prior())
    assert found.problem.count == len(frame) and found.problem.known["backlash"].mean() < 0.35
    assert found.hypothesis.effects == set(acting) and found.posterior.marginal("backlash") > 0.9 * (
        "backlash" in acting
    )
    # the open senses are found where backlash acts: no more than the noise is left
    assert np.sqrt((found.problem.residual(found.state) ** 2).mean()) < 1.2 * found.problem.noise_mm


def test_a_set_confounded_with_backlash_does_not_win_by_the_readings_of_open_senses():
    """An effect of the drives' values may explain readings at which backlash predicts nothing: that does not count."""
    problem = _open(problem_of(measure((strong("backlash", 4.0),))), 0.66)
    found = infer(problem, Prior()).posterior
    assert found.sets[frozenset({"backlash"}), False] > 0.8 and found.probability_unexplained < 0.1


def _along_lines(effects, jitter_rad, seed=4):
    """Table of a six-axis arm along lines in steps of 5 mm there and back, its joint values read back with jitter."""
    generator, arm = np.random.default_rng(seed), arms.ARM
    lines = []
    for _ in range(5):
        low, high = arm.drive_range.T
        start = np.concatenate([0.6 * low[:3] + 0.4 * high[:3], [0.3, 0.8, -0.4]]) + 0.5 * generator.random(6)
        at = arm.solve(start[None], arm.forward(start[None]))
        way = generator.standard_normal(3)
        line = arm.forward(start[None]) + 5.0 * np.arange(24)[:, None] * way / np.linalg.norm(way)
        turn = np.broadcast_to(at.turn, (len(line), 3, 3))
        near = np.repeat(start[None], len(line), axis=0), np.repeat(line[:1], len(line), axis=0)
        drive = inverse_kinematics(arm, (line, turn), near, arm.twists(), False)
        lines += [drive, drive[::-1]]
    run = np.repeat(np.arange(1, len(lines) + 1), [len(line) for line in lines])
    drive = np.concatenate(lines)
    frame = arms.commands(drive).assign(run=run)
    measured = rows.vector_columns("measured", rows.command(frame))
    motion = make_diagnosis_problem(frame.assign(**measured), arm, arms.MASSES, 1.0, {}).motion
    # the robot itself knows how it came
    motion = replace(motion, approach=np.full_like(motion.drive, np.nan))
    twists = arm.twists_of(arms.ERRORS) + together(effects, motion).twists
    poses = arm.solve(drive, rows.command(frame), twists)
    measured = arm.measured(poses, twists) + arms.NOISE_MM * generator.standard_normal((len(drive), 3))
    read = drive + jitter_rad * generator.standard_normal(drive.shape)
    known = dict(zip(arm.parts.columns, read.T, strict=True)) | rows.vector_columns("command", arm.forward(read))
    return frame.assign(**known, **rows.vector_columns("measured", measured))


def _of_arm(frame, *names):
    """The problem of an arm's table, with all that its readings determine."""
    library = {name: find(name, arms.ARM) for name in names}
    robot = as_measured(replace(arms.ARM, parameter_set="full"), frame, (), False)
    return require_determined(
        make_diagnosis_problem(frame, with_wide_bounds(robot), arms.MASSES, arms.NOISE_MM, library)
    )


@pytest.fixture(scope="module")
def along_lines():
    """Attributions of one robot by its joint values as driven, and as read back with a jitter of 1e-5 rad."""
    names, acting = ("backlash", "encoder_eccentricity"), (arms.active("backlash", np.full(6, 1.5e-3)),)
    return [infer(_of_arm(_along_lines(acting, jitter), *names), Prior()) for jitter in (0.0, 1e-5)]


def test_jitter_of_joint_values_changes_neither_verdict_nor_errors(along_lines):
    plain, jittered = along_lines
    # at the very first reading the simulated backlash is in its middle, which is no side
    assert plain.problem.used[1:].all() and jittered.problem.used[1:].all()
    assert jittered.problem.known["backlash"].mean() > 0.8 * plain.problem.known["backlash"].mean() > 0.5
    assert plain.hypothesis.effects == jittered.hypothesis.effects == {"backlash"}
    first, second = (np.nan_to_num(found.fit.estimate.block_errors(GEOMETRY)) for found in along_lines)
    off = (plain.state.deviations - jittered.state.deviations) / np.hypot(first, second)
    assert np.sqrt((off**2).mean()) < 1.5


def test_where_hardly_a_sense_is_known_only_backlash_is_not_tested():
    """At 5 of 250 stops: all readings find the compliance, and a sentence says why backlash was not tested."""
    stiff = np.array([0.0, 6e-9, 1.2e-8, 0.0, 2e-8, 0.0])
    frame = arms.measure((arms.active("drive_compliance", stiff),), 250)
    frame["run"] = np.maximum(np.arange(len(frame)) - 4, 1)
    problem = require_determined(arms.problem_of(frame, "backlash", "drive_compliance", "read_before_rest"))
    assert problem.used.all() and set(problem.effects) == {"drive_compliance", "read_before_rest"}
    assert "is known at 5 of 250 points; allowed: at least 50% of them" in problem.untestable["backlash"]
    found = infer(problem, Prior())
    assert found.hypothesis.effects == {"drive_compliance"} and found.problem.count == 250


def test_too_few_readings_are_refused_with_what_to_do():
    frame = arms.measure((), 10)
    problem = arms.problem_of(frame)
    count = len(problem.mechanism.parameters)
    least = count + OPTIONS.min_spare_numbers
    more = int(np.ceil((least - 30) / 3.0))
    message = f"30 numbers read at 10 poses .* {count} parameters; .* least {least}: measure {more} more"
    with pytest.raises(FitError, match=message):
        require_determined(arms.problem_of(frame.drop(columns=[f"measured_r{axis}_rad" for axis in "xyz"])))


def test_poses_that_leave_a_number_open_are_diagnosed_as_far_as_they_determine_it():
    problem = arms.problem_of(arms.measure((), 200))
    same = {name: problem.measurements[name].iloc[0] for name in arms.ARM.parts.columns[:2]}
    still = problem.measurements.assign(**same)
    drive = rows.actuators(still, arms.ARM)
    place, generator = arms.ARM.forward(drive), np.random.default_rng(1)
    seen = place + arms.NOISE_MM * generator.standard_normal(place.shape)
    still = still.assign(**rows.vector_columns("command", place), **rows.vector_columns("measured", seen))
    still = still.drop(columns=[name for name in still if name.startswith("measured_r")])
    open_problem = require_determined(arms.problem_of(still))
    fit = fit_model(open_problem, [ModelState(np.zeros(len(open_problem.mechanism.parameters)), {})])
    errors = fit.estimate.standard_errors
    assert fit.estimate.rank < len(errors) and np.isfinite(errors).all()
    # what the poses do not determine has the error of its prior
    unseen = np.abs(fit.estimate.null_space).sum(axis=0) > 0.0
    assert (errors[unseen] > 0.1 * fit.estimate.parameters.sd[unseen]).any()
