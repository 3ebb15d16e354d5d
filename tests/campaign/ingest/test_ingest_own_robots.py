"""Tracker files of robots of one's own: a six-axis arm whose orientation changes along the path."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.campaign.ingest.sheet import TURNS
from rrru.errors import IngestError
from rrru.robots.catalogue import make_mechanism
from tests.places import ROOT

MEASURED = [f"measured_{axis}_mm" for axis in "xyz"]
ARM = make_mechanism("arm", {"urdf": str(ROOT / "data/models/arm6.urdf")}, parameter_set="zero")


def _file():
    """Rows of a file whose drive values turn the tool by half a radian and more between the ends of the path."""
    share = np.linspace(0.0, 1.0, 40)
    drives = ARM.legs.home_drives + np.outer(share, [0.2, 0.15, -0.1, 0.3, 0.4, 0.6])
    command = ARM.forward(drives)
    measured = command + np.random.default_rng(2).normal(0.0, 0.02, command.shape)
    frame = pd.DataFrame(drives, columns=ARM.parts.columns).assign(trajectory="swing")
    return frame.assign(**rows.vector_columns("command", command), **rows.vector_columns("measured", measured))


def _ingested(frame, folder, **options):
    """What ingest makes of rows."""
    frame.to_csv(folder / "arm.csv", index=False)
    return ingest(IngestSpec(str(folder / "arm.csv"), **options), ARM)


def test_drive_values_are_taken_as_they_are_where_positions_do_not_tell_them(tmp_path):
    """The tool turns along the path, which the inverse at the home orientation does not represent."""
    frame = _file()
    assert np.abs(ARM.inverse(rows.command(frame)) - frame[ARM.parts.columns].to_numpy()).max() > 0.1
    found = _ingested(frame, tmp_path).measurements
    assert np.abs(rows.actuators(found, ARM) - frame[ARM.parts.columns].to_numpy()).max() < 1e-12
    assert (found["status"] == "ok").all()


def test_commanded_poses_are_in_reach_as_they_are_turned(tmp_path):
    """Positions that the arm reaches as commanded, and not turned as at home."""
    draw = np.random.default_rng(1)
    drives = ARM.legs.home_drives + draw.uniform(-1.2, 1.2, (150, 6))
    poses = ARM.solve(drives, ARM.forward(drives))
    command, turn = ARM.measured(poses, ARM.twists()), poses.turn
    met = np.isfinite(ARM.inverse(command, turn=turn)).all(axis=1)
    apart = met & np.isnan(ARM.inverse(command)).any(axis=1)
    assert apart.sum() > 5
    frame = pd.DataFrame(Rotation.from_matrix(turn[met]).as_rotvec(), columns=TURNS["command"]).assign(
        trajectory="poses"
    )
    measured = command[met] + draw.normal(0.0, 0.02, command[met].shape)
    columns = rows.vector_columns("command", command[met]) | rows.vector_columns("measured", measured)
    found = _ingested(frame.assign(**columns), tmp_path).measurements
    off = ARM.forward(rows.actuators(found, ARM)) - command[met]
    assert len(found) == met.sum() and np.abs(off).max() < 1e-6
    with pytest.raises(IngestError, match="out of reach, with the platform turned as in the home pose"):
        _ingested(frame.assign(**columns).drop(columns=[*TURNS["command"]]), tmp_path)


def test_points_outside_of_a_drive_s_range_are_told_and_used(tmp_path):
    """Of 40 even steps from 0 to 0.6 rad those beyond 0.4 rad; a whole turn changes nothing."""
    ranges, frame = ARM.drive_range.copy(), _file()
    ranges[5] = -0.1, 0.4
    frame["axis6_rad"] += 2.0 * np.pi
    frame.to_csv(tmp_path / "arm.csv", index=False)
    found = ingest(IngestSpec(str(tmp_path / "arm.csv")), replace(ARM, drive_range=ranges))
    count = sum(0.6 * k / 39 > 0.4 for k in range(40))
    expected = f"{count} of 40 points are outside of the range of axis6_rad, -0.1 to 0.4 rad, and are used"
    assert [note for note in found.notes if "range" in note] == [expected]
    assert (found.measurements["status"] == "ok").all()
    assert not any("range" in note for note in _ingested(frame, tmp_path).notes)


def test_degrees_of_an_arm_are_converted_when_declared_and_refused_when_not(tmp_path):
    """Angles in degrees bring the nominal arm elsewhere than commanded."""
    frame = _file()
    degrees = frame.assign(**{name: np.degrees(frame[name]) for name in ARM.parts.columns})
    found = _ingested(degrees, tmp_path, angle_unit="deg").measurements
    assert np.abs(rows.actuators(found, ARM) - frame[ARM.parts.columns].to_numpy()).max() < 1e-9
    with pytest.raises(IngestError, match="angle_unit: deg"):
        _ingested(degrees, tmp_path)


@pytest.mark.parametrize(("factor", "stated", "right"), [(180.0 / np.pi, "rad", "deg"), (1.0, "deg", "rad")])
@pytest.mark.parametrize("length", [1.0, 1e-3])
def test_angles_alone_in_another_unit_than_stated_are_one_problem(factor, stated, right, length, tmp_path):
    """In any unit of the measured positions; commanded positions computed from the angles do not contradict them."""
    frame = _file().drop(columns=[f"command_{axis}_mm" for axis in "xyz"])
    frame[ARM.parts.columns] *= factor
    frame[MEASURED] *= length
    both = f"unit: m and angle_unit: {right}" if length < 1.0 else f"angle_unit: {right}"
    with pytest.raises(IngestError, match=f"allowed: {both}, which leaves") as refused:
        _ingested(frame, tmp_path, angle_unit=stated)
    assert len(refused.value.problems) == 1
    with pytest.raises(IngestError, match="allowed: unit: m, which leaves") if length < 1.0 else nullcontext():
        _ingested(frame, tmp_path, angle_unit=right)


def test_a_column_of_another_robot_is_refused_with_the_names_of_this_one(tmp_path):
    """theta1_rad is no joint of the arm."""
    with pytest.raises(IngestError, match=r"theta1_rad.*an undeclared column"):
        _ingested(_file().assign(theta1_rad=0.0), tmp_path)


def test_a_target_s_own_offset_is_no_second_problem(tmp_path):
    """A reflector 120 mm from the tool, and a repeated point: one problem, without `frame: register` in addition."""
    frame = _file()
    drives = frame[[*ARM.parts.columns]].to_numpy()
    seen = ARM.solve(drives, rows.command(frame)).point(np.array([120.0, 0.0, 0.0]))
    numbered = frame.assign(**rows.vector_columns("measured", seen), target="ball", run=1)
    spoilt = numbered.assign(point=np.arange(1, 41)).drop(columns="point").assign(time_s=np.r_[0:39, 5])
    with pytest.raises(IngestError) as refused:
        _ingested(spoilt, tmp_path, targets={"ball": (120.0, 0.0, 0.0)})
    assert "time" in str(refused.value) and "register" not in str(refused.value)


def test_drive_values_under_another_name_are_one_problem_with_all_that_is_to_be_written(tmp_path):
    """Without commanded positions, which the drive values determine."""
    frame = _file()
    degrees = np.degrees(frame[ARM.parts.columns]).set_axis([f"j{number}_deg" for number in range(1, 7)], axis=1)
    frame = degrees.assign(trajectory="swing", **frame[MEASURED])
    columns = {ours: theirs for ours, theirs in zip(ARM.parts.columns, degrees.columns, strict=True)}
    with pytest.raises(IngestError) as caught:
        _ingested(frame, tmp_path)
    (problem,) = str(caught.value).splitlines()
    pairs = ", ".join(f'{ours}: "{theirs}"' for ours, theirs in columns.items())
    assert problem.endswith(f"allowed: columns: {{{pairs}}} and angle_unit: deg")
    assert len(_ingested(frame, tmp_path, columns=columns, angle_unit="deg").measurements) == len(frame)
