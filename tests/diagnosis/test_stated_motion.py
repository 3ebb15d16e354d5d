"""A campaign that states how its robot moved from stop to stop: directions of arrival, backlash, rests and speeds."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.campaign.driven_path import stops
from rrru.campaign.ingest.campaign_file import ingest
from rrru.campaign.ingest.spec import IngestSpec
from rrru.campaign.schemas import measurement_table
from rrru.diagnosis.approach_direction import paths_between_stops, undetermined_senses
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.effects.library import find
from rrru.errors import ConfigError
from rrru.kinematics.dynamics import Masses
from rrru.pipeline.setup import as_measured
from rrru.robots.hexapod import hexapod
from rrru.store import tables
from tests.diagnosis import arms, hexapod_stops
from tests.refusals import refusals
from tests.schemas import check_measurements

_HEXAPOD = hexapod(
    hexapod_stops.BASE, hexapod_stops.PLATFORM, hexapod_stops.HEIGHT_MM, stroke_mm=200.0, parameter_set="full"
)
_WIDTH_MM = 0.1
# drive values of the arm far from its singularities
_MIDDLE = np.array([0.3, 0.2, -0.3, 0.5, 0.9, 0.4])


def _read(folder, frame, motion=None):
    """The measurement table of a file of the hexapod."""
    frame.to_csv(folder / "mine.csv", index=False)
    stated = {"motion": motion} if motion else {}
    section = {"ingest": str(folder / "mine.csv"), "targets": hexapod_stops.PLACES, **stated}
    return ingest(IngestSpec.from_config(section), _HEXAPOD).measurements


def _problem(table, *names):
    library = {name: find(name, _HEXAPOD) for name in names}
    robot = as_measured(_HEXAPOD, table, tuple(hexapod_stops.PLACES))
    return make_diagnosis_problem(table, robot, Masses(), hexapod_stops.NOISE_MM, library)


def _changes(problem, width_mm=_WIDTH_MM):
    """Changes (n, 6) of the legs' lengths by backlash along a problem's motion."""
    robot = problem.mechanism
    sites = [robot.legs.site_numbers[drive.site] for drive in robot.parts.drives]
    return find("backlash", robot).contribute(problem.motion, np.full(6, width_mm)).twists[:, sites, 0]


def _diagnosed(table):
    """The verdict, and the numbers of its backlash."""
    robot = as_measured(_HEXAPOD, table, tuple(hexapod_stops.PLACES))
    found = diagnose(table, MeasuredRobot(robot, noise_mm=hexapod_stops.NOISE_MM), details=False)
    numbers = found.tables["gap_parameters"]
    return found.verdict, numbers[numbers["effect"] == "backlash"]


def _inside(widths):
    return int(((widths["low_95"] <= _WIDTH_MM) & (widths["high_95"] >= _WIDTH_MM)).sum())


# poses in no order are taken for stops with straight drives, poses row by row for a path: each is wrong here
@pytest.mark.parametrize(("order", "between"), [("random", "tool"), ("grid", "drives")])
def test_backlash_has_its_width_where_the_motion_is_stated(tmp_path, order, between):
    frame = hexapod_stops.file_of(order, between, _WIDTH_MM, seed=1)
    guessed, off = _diagnosed(_read(tmp_path, frame))
    assert guessed["effects"] != "backlash" or _inside(off) < 5
    verdict, widths = _diagnosed(_read(tmp_path, frame, {"kind": "stop_and_go", "between": between}))
    assert verdict["effects"] == "backlash" and verdict["probability"] > 0.9
    # six intervals of 95 %: one may miss
    assert len(widths) == 6 and _inside(widths) >= 5
    np.testing.assert_allclose(widths["value"], _WIDTH_MM, atol=0.006)


def test_a_way_that_is_not_stated_leaves_open_where_straight_tool_and_straight_drives_differ(tmp_path):
    """What stays known is right whichever way was taken."""
    frame = hexapod_stops.file_of("random", "tool")
    motion = _problem(_read(tmp_path, frame, "stop_and_go")).motion
    known, shares = np.isnan(motion.approach[::2]), []
    for between in ("drives", "tool"):
        commanded, actual, _ = hexapod_stops.reached("random", between, np.full(6, 1e-6))
        shares.append((commanded - actual) / 0.5e-6)
    sense = np.sign(motion.drive - motion.path_drive[np.maximum(motion.path_index - 1, 0)])[::2]
    assert 0.02 < 1.0 - known[1:].mean() < 0.3 and not known[0].any()
    for share in shares:
        np.testing.assert_allclose(sense[known], share[known], atol=1e-3)
    apart = np.abs(shares[0] - shares[1]) > 1.0
    assert apart[1:].any() and not known[apart].any()


@pytest.mark.parametrize("between", ["drives", "tool"])
def test_senses_of_arrival_are_those_of_the_way_that_is_stated(tmp_path, between):
    frame = hexapod_stops.file_of("grid", between)
    problem = _problem(_read(tmp_path, frame, {"kind": "stop_and_go", "between": between}))
    commanded, actual, _ = hexapod_stops.reached("grid", between, np.full(6, 1e-3))
    expected = np.repeat((commanded - actual) / 0.5e-3, 2, axis=0)
    sense, known = _changes(problem, 1e-3) / -0.5e-3, np.isnan(problem.motion.approach)
    assert not known[:2].any() and known[2:].mean() > 0.99
    assert (np.abs(sense - expected)[known] < 0.02).mean() > 0.995


def test_the_tool_path_of_legs_is_the_closed_form():
    position, turn = hexapod_stops.poses("random", np.random.default_rng(3))
    drive = hexapod_stops.lengths(position, turn)
    (path,), index = paths_between_stops(_HEXAPOD, drive, position, "tool")
    np.testing.assert_array_equal(path[index], drive)
    for k in (0, 40, 90):
        own = path[index[k] : index[k + 1] + 1]
        fine = hexapod_stops.way((position[k], turn[k]), (position[k + 1], turn[k + 1]), "tool")
        # the nearest of 400 steps of the closed form
        near = np.abs(own[1:, None] - fine[None]).max(axis=2).min(axis=1)
        assert near.max() < 0.6 * np.abs(np.diff(fine, axis=0)).max()


def test_the_tool_path_of_an_arm_is_a_straight_line():
    generator = np.random.default_rng(5)
    drive = np.cumsum(0.15 * generator.standard_normal((12, arms.DRIVES)), axis=0) + _MIDDLE
    position = arms.ARM.forward(drive)
    (path,), index = paths_between_stops(arms.ARM, drive, position, "tool")
    np.testing.assert_array_equal(path[index], drive)
    tool, turn = arms.ARM.forward(path), arms.ARM.solve(path, arms.ARM.forward(path)).turn
    for k, (start, end) in enumerate(pairwise(index)):
        way = position[k + 1] - position[k]
        along = (tool[start:end] - position[k]) @ way / (way @ way)
        np.testing.assert_allclose(tool[start:end], position[k] + along[:, None] * way, atol=1e-6)
        whole = Rotation.from_matrix(turn[start].T @ turn[end]).as_rotvec()
        turned = Rotation.from_matrix(turn[start].T @ turn[start:end]).as_rotvec()
        np.testing.assert_allclose(turned, along[:, None] * whole, atol=1e-6)


def test_a_way_on_which_the_robot_cannot_be_leaves_its_stop_open():
    """So do the run's first stop, and a drive that has not moved since; one that stands still later keeps its side."""
    drive = np.array([[0.0, 5.0], [1.0, 5.0], [0.5, 6.0], [0.5, 7.0]])
    (path,), index = paths_between_stops(None, drive, np.zeros((4, 3)), "drives")
    run, widths = np.ones(4), np.full(2, 1e-8)
    expected = np.array([[True, True], [False, True], [False, False], [False, False]])
    np.testing.assert_array_equal(undetermined_senses([path], index, run, widths), expected)
    path[index[2] + 3 : index[2] + 5] = np.nan
    expected[3] = True
    np.testing.assert_array_equal(undetermined_senses([path], index, run, widths), expected)


def test_all_readings_at_a_stop_have_its_senses(tmp_path):
    """Reflectors one after the other, drive values read back at each, a reading twice: the robot did not move."""
    frame, motion = hexapod_stops.file_of("random", "drives"), {"kind": "stop_and_go", "between": "drives"}
    table = _read(tmp_path, frame, motion)
    np.testing.assert_array_equal(stops(table), np.repeat(np.arange(125), 2))
    jitter = 2e-3 * np.random.default_rng(2).standard_normal((len(frame), 6))
    jittered = _read(tmp_path, frame.assign(**(frame[hexapod_stops.DRIVES] + jitter)), motion)
    assert stops(jittered.drop(columns=["motion", "motion_between"])).max() == len(frame) - 1
    alone = _changes(_problem(table[::2]))
    for other in (table, jittered):
        problem = _problem(other)
        np.testing.assert_array_equal(
            problem.motion.path_index, np.repeat(np.arange(125), 2) * problem.motion.path_index[2]
        )
        np.testing.assert_array_equal(_changes(problem)[::2], _changes(problem)[1::2])
        np.testing.assert_allclose(_changes(problem)[::2], alone, atol=8e-3)
        np.testing.assert_array_equal(problem.motion.last_move[::2], problem.motion.last_move[1::2])
    # the tool read twice at each stop, without reflectors
    twice = arms.measure(count=20).loc[np.repeat(np.arange(20), 2)].assign(point=np.arange(1, 41))
    held = make_diagnosis_problem(twice.assign(motion="stop_and_go"), arms.ARM, arms.MASSES, 1.0, {}).motion
    np.testing.assert_array_equal(held.last_move[2::2], held.last_move[3::2])
    assert (held.last_move[2:] != 0.0).any(axis=1).all()


def test_a_robot_that_rests_has_no_speed_and_one_that_does_not_has_one():
    """Whether its points lie along a path or in no order."""
    at = np.linspace(0.0, 1.0, 40)
    drive = np.array([0.0, 0.2, -0.3, 0.0, 0.7, 0.0]) + 0.5 * np.sin(3.0 * at[:, None] + np.arange(6))
    for values in (drive, np.random.default_rng(1).permutation(drive)):
        frame = arms.commands(values).assign(time_s=10.0 * at)
        frame = frame.assign(**rows.vector_columns("measured", rows.command(frame)))
        library = {name: find(name, arms.ARM) for name in ("servo_lag", "read_before_rest")}
        rested, passed = (
            make_diagnosis_problem(frame.assign(motion=kind), arms.ARM, arms.MASSES, 1.0, library)
            for kind in ("stop_and_go", "continuous")
        )
        assert not rested.motion.drive_rate.any() and not rested.motion.drive_acceleration.any()
        assert "the robot rests at every point" in rested.untestable["servo_lag"]
        assert "read_before_rest" in rested.library
        slopes = np.gradient(values, 10.0 * at, axis=0)
        inner = slice(2, -2)
        if values is drive:
            np.testing.assert_allclose(passed.motion.drive_rate[inner], slopes[inner], atol=2e-3)
        assert np.isfinite(passed.motion.drive_rate).all() and "servo_lag" in passed.library
        assert "last_move" in passed.untestable["read_before_rest"]


@refusals("motion", "message")
def test_wrong_values_are_refused_with_those_that_are_allowed(motion, message):
    with pytest.raises(ConfigError, match=f"ingest of a.csv: {message}"):
        IngestSpec.from_config({"ingest": "a.csv", "motion": motion})


def test_what_is_stated_is_in_the_tables_of_the_campaign(tmp_path):
    frame = hexapod_stops.file_of("random", "drives")
    for motion in ("stop_and_go", "continuous", {"kind": "stop_and_go", "between": "tool"}):
        table = check_measurements(_HEXAPOD, _read(tmp_path, frame, motion))
        schema = measurement_table(_HEXAPOD, table.columns)
        path = tmp_path / "measurements.parquet"
        tables.write_all((schema,), {"measurements": table}, {"measurements": str(path)})
        pd.testing.assert_frame_equal(tables.read(str(path)), table)
    assert table["motion"].eq("stop_and_go").all() and table["motion_between"].eq("tool").all()
    assert not {"motion", "motion_between"} & set(_read(tmp_path, frame))


def test_held_out_rows_change_no_sense(tmp_path):
    table = _read(tmp_path, hexapod_stops.file_of("grid", "tool"), {"kind": "stop_and_go", "between": "tool"})
    held = rows.hold_out(table, np.arange(len(table)) % 7 == 0)
    np.testing.assert_array_equal(_problem(held).motion.path_drive, _problem(table).motion.path_drive)
    assert replace(_problem(held), known={}).count < len(table)
