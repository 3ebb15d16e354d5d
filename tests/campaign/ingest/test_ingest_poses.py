"""Files of poses and of several reflectors, with joints alone, in an instrument's own frame; refusals."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from rrru.calibration.calibrate import calibrate
from rrru.calibration.campaign_fit import select
from rrru.calibration.campaign_noise import campaign_noise
from rrru.campaign import measurements as rows
from rrru.campaign.ingest import geometry
from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.campaign.ingest.problems import Problems
from rrru.campaign.ingest.sheet import Sheet
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.errors import IngestError
from rrru.kinematics.base_parameters import direction
from rrru.kinematics.readings import Readings
from rrru.robots.catalogue import make_mechanism
from rrru.robots.from_dh import from_dh
from rrru.robots.hexapod import hexapod
from rrru.robots.rrru3 import Rrru3
from tests.places import ROOT
from tests.schemas import check_measurements

_SPOTS = {"a": np.array([60.0, 10.0, 90.0]), "b": np.array([-50.0, 40.0, 120.0]), "c": np.array([0.0, -70.0, 60.0])}
# from the robot's frame to the instrument's, and from the platform to what is read as its orientation
_FRAME, _SHIFT = Rotation.from_rotvec([0.3, -0.5, 2.0]), np.array([1500.0, -300.0, 700.0])
_TURN = Rotation.from_rotvec([0.2, 1.0, -0.4])
_NOISE_MM, _NOISE_RAD = 0.02, 1e-4
_POINTS = ["measured_x_mm", "measured_y_mm", "measured_z_mm"]
_QUATERNION = [f"measured_q{part}" for part in "xyzw"]


@pytest.fixture(scope="module")
def arm():
    """The example arm with the full set of parameters."""
    return make_mechanism("arm", {"urdf": str(ROOT / "data/models/arm6.urdf")}, parameter_set="full")


@pytest.fixture(scope="module")
def driven(arm):
    """Actuator values (150, 6) of poses in no order."""
    generator = np.random.default_rng(4)
    return arm.legs.home_drives + 0.8 * generator.uniform(-1.0, 1.0, (150, 6))


def _truth(arm):
    """Deviations of a few numbers by name."""
    names = ("daxis2", "daxis3", "axis3_z", "axis4_rz", "axis5_rx")
    units = {one.name: one.unit for one in arm.candidates}
    return {name: 5e-4 * k if units[name] == "rad" else 0.3 for k, name in enumerate(names, 1)}


def _file(arm, driven, truth=None, registered=True, noise=1.0, twists=0.0):
    """What a tracker writes of poses: joints and readings of reflector a, by quaternions; twists: what else is off."""
    generator = np.random.default_rng(6)
    own = arm.twists_of(truth or {}) + twists
    poses, count = arm.solve(driven, np.tile(arm.legs.home_mm, (len(driven), 1)), own), len(driven)
    frame, shift, turn = (_FRAME, _SHIFT, _TURN) if registered else (Rotation.identity(), 0.0, Rotation.identity())
    point = frame.apply(poses.point(_SPOTS["a"])) + shift + noise * _NOISE_MM * generator.normal(size=(count, 3))
    shaken = Rotation.from_rotvec(noise * _NOISE_RAD * generator.normal(size=(count, 3)))
    read = (shaken * frame * Rotation.from_matrix(poses.turn) * turn).as_quat()
    joints = dict(zip(arm.parts.columns, driven.T, strict=True))
    readings = dict(zip([*_POINTS, *_QUATERNION], [*point.T, *read.T], strict=True))
    target = {} if registered else {"target": "a"}
    return pd.DataFrame({"trajectory": "poses", **target, **joints, **readings})


def _taken(folder, table, robot, **options):
    path = folder / "mine.csv"
    table.to_csv(path, index=False)
    return ingest(IngestSpec(str(path), **options), robot)


def _as_read(robot, found, registered=True, known=()):
    """The robot whose parameters hold what the readings leave open."""
    table = found.measurements
    robot = robot.with_measurement_config(rows.measurement_config(table, known, registered))
    readings = rows.readings(table, robot.characteristic_length_mm)
    return robot.with_identifiable_parameters(rows.actuators(table, robot), rows.command(table), readings)


def test_poses_of_joints_alone_are_brought_into_the_robots_frame(arm, driven, tmp_path):
    """Without noise and deviations everything is found exactly: frame, reflector, orientation, commands."""
    found = _taken(tmp_path, _file(arm, driven, noise=0.0), arm, frame="register")
    table = check_measurements(arm, found.measurements)
    poses = arm.solve(driven, np.tile(arm.legs.home_mm, (len(driven), 1)))
    np.testing.assert_allclose(rows.measured(table), poses.point(_SPOTS["a"]), atol=1e-6)
    np.testing.assert_allclose(rows.turns(table, "measured"), poses.turn, atol=1e-9)
    np.testing.assert_allclose(rows.turns(table, "command"), poses.turn, atol=1e-9)
    np.testing.assert_allclose(rows.command(table), poses.point(np.asarray(arm.tool_mm)), atol=1e-9)
    np.testing.assert_allclose(rows.vectors(table, "target"), np.tile(_SPOTS["a"], (len(table), 1)), atol=1e-6)
    assert table["run"].eq(1).all() and any("follow no path" in note for note in found.notes)


@pytest.mark.parametrize("frame", ["register", "robot"])
@pytest.mark.parametrize("commanded", [False, True])
@pytest.mark.parametrize("blank", [1, 100, 150])
def test_blank_drive_values_are_named_once_and_no_message_has_a_nan(arm, driven, frame, commanded, blank, tmp_path):
    table = _file(arm, driven, noise=0.0)
    if commanded:
        tool = arm.solve(driven, np.tile(arm.legs.home_mm, (len(driven), 1))).point(np.asarray(arm.tool_mm))
        table = table.assign(**rows.vector_columns("command", tool))
    table.loc[: blank - 1, arm.parts.columns[2]] = np.nan
    with pytest.raises(IngestError) as caught:
        _taken(tmp_path, table, arm, frame=frame)
    assert not re.search(r"\b(nan|inf)\b", str(caught.value))
    if frame == "robot":
        # measured positions in another frame are named, too
        return
    # the line that counts them has no column
    assert {problem["column"] for problem in caught.value.problems} - {None} == {arm.parts.columns[2]}


def test_drive_values_without_a_pose_are_counted_where_there_are_commands(arm, driven, tmp_path, monkeypatch):
    tool = arm.solve(driven, np.tile(arm.legs.home_mm, (len(driven), 1))).point(np.asarray(arm.tool_mm))
    sheet = Sheet(None, arm, Problems("file"), {}, pd.DataFrame(dict(zip(arm.parts.columns, driven.T, strict=True))))
    sheet = replace(sheet, frame=sheet.frame.assign(**rows.vector_columns("command", tool)))
    nowhere = np.where(np.arange(len(driven))[:, None] < 100, np.nan, tool)
    monkeypatch.setattr(type(arm), "forward", lambda *_, **__: nowhere)
    geometry.check_commands(sheet)
    with pytest.raises(IngestError, match="at which the nominal robot has no pose in 100 of 150 rows"):
        sheet.problems.refuse()


def test_deviations_are_found_beside_frame_tool_and_noise(arm, driven, tmp_path):
    """A fit of all identifiable parameters: noise estimated, and the robot's own parameters by their errors."""
    truth = _truth(arm)
    found = _taken(tmp_path, _file(arm, driven, truth), arm, frame="register")
    robot = _as_read(arm, found)
    assert len(robot.parameters) == 30  # 4 R + 6, Mooring, Roth and Driels 1991
    noise = campaign_noise(robot, found.measurements, (None, None))
    assert noise.mm == pytest.approx(_NOISE_MM, rel=0.2) and noise.rad == pytest.approx(_NOISE_RAD, rel=0.2)
    residuals = select(found.measurements, robot, ["*"], True, noise.characteristic_length_mm)
    fit = calibrate(residuals, _NOISE_MM)
    assert fit.rms_mm == pytest.approx(np.sqrt(3.0) * _NOISE_MM, rel=0.15)
    assert fit.turn_rms_rad == pytest.approx(np.sqrt(3.0) * _NOISE_RAD, rel=0.15)
    # independent of the choice of parameters: distances between the reflector's places in fresh poses
    fresh = arm.legs.home_drives + 0.5 * np.random.default_rng(8).uniform(-1.0, 1.0, (40, 6))
    guess, place = np.tile(arm.legs.home_mm, (40, 1)), rows.vectors(found.measurements, "target")[:40]
    true = arm.solve(fresh, guess, arm.twists_of(truth)).point(_SPOTS["a"])
    readings, twists = Readings(guess, np.full(40, "reflector tool"), place), robot.twists(fit.deviations)
    model = robot.measured(robot.solve(fresh, guess, twists), twists, readings)
    off = np.abs(_distances(true) - _distances(model))
    assert off.max() < 3.0 * _NOISE_MM and off.mean() < _NOISE_MM


def _distances(points):
    """Distances (n, n) between points (n, 3)."""
    return np.linalg.norm(points[:, None] - points[None], axis=-1)


def test_play_is_named_from_poses_in_no_order(arm, driven, tmp_path):
    motion = _motion(arm, driven)
    from rrru.effects.library import library

    twists = library(arm)["backlash"].contribute(motion, np.full(6, 8e-4)).twists
    found = _taken(tmp_path, _file(arm, driven, _truth(arm), twists=twists), arm, frame="register")
    robot = _as_read(arm, found)
    verdict = diagnose(found.measurements, MeasuredRobot(robot), details=False).verdict
    assert verdict["effects"] == "backlash" and verdict["share_closed"] > 0.8
    assert "frame_misregistration not tested" in verdict["notes"] and verdict["points"] == len(driven)
    # how the arm came to the first stop is unknown
    assert "backlash fitted without 1 of 150 points" in verdict["notes"]


def _motion(arm, driven):
    """The motion of an arm that stops at each pose."""
    from rrru.effects.motion import Course, make_motion
    from rrru.kinematics.dynamics import Masses

    poses, count = arm.solve(driven, np.tile(arm.legs.home_mm, (len(driven), 1))), len(driven)
    place, nothing = poses.point(np.asarray(arm.tool_mm)), np.full((count, 3), np.nan)
    course = Course(place, driven, driven, np.arange(count), np.full(count, np.nan), nothing, nothing, np.zeros(count))
    return make_motion(arm, Masses(0.0, 0.0, 0.0), course)


@pytest.mark.parametrize("registered", [True, False])
@pytest.mark.parametrize("known", [(), ("a", "b")])
def test_reflectors_without_stated_places_are_found(arm, driven, tmp_path, registered, known):
    poses = arm.solve(driven, np.tile(arm.legs.home_mm, (len(driven), 1)))
    frame, shift = (_FRAME, _SHIFT) if registered else (Rotation.identity(), 0.0)
    seen = np.stack([frame.apply(poses.point(place)) + shift for place in _SPOTS.values()], axis=1).reshape(-1, 3)
    joints = pd.DataFrame(dict(zip(arm.parts.columns, driven.T, strict=True)))
    table = joints.loc[joints.index.repeat(3)].reset_index(drop=True)
    table = table.assign(trajectory="poses", target=[*_SPOTS] * len(driven), **dict(zip(_POINTS, seen.T, strict=True)))
    options = {"frame": "register"} if registered else {}
    found = _taken(tmp_path, table, arm, targets={name: tuple(_SPOTS[name]) for name in known}, **options)
    places = found.measurements.groupby("target")[["target_x_mm", "target_y_mm", "target_z_mm"]].agg(["min", "max"])
    for name, place in _SPOTS.items():
        np.testing.assert_allclose(places.loc[name].to_numpy().reshape(3, 2), np.stack([place] * 2, axis=1), atol=1e-5)
    robot = _as_read(arm, found, registered, known)
    assert robot.measurement_config.fitted == tuple(f"reflector {name}" for name in _SPOTS if name not in known)
    fitted = {name for name in robot.parameters.names if name.startswith("reflector")}
    assert not any(f"reflector_{name}_" in one for name in known for one in fitted)


def test_a_rotation_vector_says_the_same_as_a_quaternion(arm, driven, tmp_path):
    table = _file(arm, driven, registered=False)
    vector = Rotation.from_quat(table[_QUATERNION].to_numpy()).as_rotvec()
    other = table.drop(columns=_QUATERNION).assign(**{f"measured_r{x}_rad": vector[:, k] for k, x in enumerate("xyz")})
    one, two = (_taken(tmp_path, each, arm, targets={}).measurements for each in (table, other))
    pd.testing.assert_frame_equal(one, two, rtol=0.0, atol=1e-9)


def _scalar_first(table):
    return table.rename(
        columns=dict(zip(_QUATERNION, ["measured_qy", "measured_qz", "measured_qw", "measured_qx"], strict=True))
    )


def _exchanged(table):
    return table.rename(columns={"measured_qx": "measured_qy", "measured_qy": "measured_qx"})


def _turned_axes(table):
    vector = Rotation.from_quat(table[_QUATERNION].to_numpy()).as_rotvec()
    return table.drop(columns=_QUATERNION).assign(**{f"measured_r{x}_rad": vector[:, k] for k, x in enumerate("yzx")})


def _inverse(table):
    return table.assign(measured_qw=-table["measured_qw"])


def _halved(table):
    vector = 0.5 * Rotation.from_quat(table[_QUATERNION].to_numpy()).as_rotvec()
    return table.drop(columns=_QUATERNION).assign(**{f"measured_r{x}_rad": vector[:, k] for k, x in enumerate("xyz")})


@pytest.mark.parametrize("registered", [True, False])
@pytest.mark.parametrize(
    ("change", "advice"),
    [
        (_scalar_first, r"columns: \{measured_qx: measured_qy, measured_qy: measured_qz, measured_qz: measured_qw"),
        (_exchanged, r"columns: \{measured_qx: measured_qy, measured_qy: measured_qx, measured_qz: measured_qz"),
        (_turned_axes, r"columns: \{measured_rx_rad: measured_ry_rad, measured_ry_rad: measured_rz_rad"),
        (_inverse, "not its inverse leaves"),
        (_halved, "at most 0.1 rad; check unit, sequence and order of their columns$"),
    ],
)
def test_orientations_that_turn_otherwise_than_the_platform_are_refused(
    arm, driven, tmp_path, change, advice, registered
):
    """A noise of some degrees was found in their place, and a cause was named with 0.99."""
    table, options = change(_file(arm, driven, registered=registered)), {} if registered else {"targets": {}}
    stated = {name for name in table if name.startswith(("measured_q", "measured_r"))}
    far = "in the median from those of the platform times a fixed rotation"
    with pytest.raises(IngestError, match=f"{far}.*{advice}") as refused:
        _taken(tmp_path, table, arm, frame="register" if registered else "robot", **options)
    assert set(refused.value.problems[0]["column"].split(", ")) == stated


def test_joints_alone_do_for_a_parallel_robot(tmp_path):
    robot = Rrru3()
    point = np.random.default_rng(1).uniform((-300.0, -300.0, 500.0), (300.0, 300.0, 800.0), (30, 3))
    theta = robot.inverse(point)
    joints = dict(zip(robot.parts.columns, theta.T, strict=True))
    table = pd.DataFrame({"trajectory": "a", **joints, **rows.vector_columns("measured", point + 0.1)})
    found = _taken(tmp_path, table, robot)
    np.testing.assert_allclose(rows.command(found.measurements), point, atol=1e-6)
    assert any("no commanded positions" in note for note in found.notes)


def test_a_command_out_of_reach_is_named_where_orientations_were_measured(tmp_path):
    robot = Rrru3()
    point = np.random.default_rng(1).uniform((-300.0, -300.0, 500.0), (300.0, 300.0, 800.0), (30, 3))
    readings = rows.vector_columns("measured", point + 0.1) | rows.turn_columns(
        "measured", np.tile(np.eye(3), (30, 1, 1))
    )
    point[3] = 0.0, 0.0, 1e4
    table = pd.DataFrame({"trajectory": "a", **rows.vector_columns("command", point), **readings})
    with pytest.raises(
        IngestError, match=r"row 5, .*got \(0, 0, 10000\) mm; allowed: a position that the robot reaches"
    ):
        _taken(tmp_path, table, robot)


def test_an_orientation_that_was_not_measured_is_left_blank(arm, driven, tmp_path):
    table = _file(arm, driven, registered=False)
    table.loc[3:9, _QUATERNION] = np.nan
    found = _taken(tmp_path, table, arm)
    blank = found.measurements["measured_rx_rad"].isna().to_numpy()
    np.testing.assert_array_equal(np.flatnonzero(blank), np.arange(3, 10))
    assert found.measurements["measured_x_mm"].notna().all()


@pytest.mark.parametrize("registered", [True, False])
@pytest.mark.parametrize(("wrong", "degrees"), [(1, 3.0), (4, 2.0), (12, 8.0), (3, 90.0)])
def test_orientations_that_a_camera_got_wrong_are_left_out(arm, driven, tmp_path, wrong, degrees, registered):
    generator = np.random.default_rng([wrong, int(degrees)])
    table = _file(arm, driven, _truth(arm), registered)
    bad = np.sort(generator.choice(len(table), wrong, replace=False))
    axes = generator.normal(size=(wrong, 3))
    turn = Rotation.from_rotvec(np.radians(degrees) * axes / np.linalg.norm(axes, axis=1, keepdims=True))
    table.loc[bad, _QUATERNION] = (turn * Rotation.from_quat(table.loc[bad, _QUATERNION].to_numpy())).as_quat()
    found = _taken(tmp_path, table, arm, frame="register" if registered else "robot")
    np.testing.assert_array_equal(np.flatnonzero(found.measurements["status"] == "outlier"), bad)
    right = found.measurements[found.measurements["status"] == "ok"]
    off = rows.turns(right, "measured") @ rows.turns(right, "command").transpose(0, 2, 1)
    assert np.abs(Rotation.from_matrix(off).as_rotvec().mean(axis=0)).max() < 2e-3


@pytest.mark.parametrize("seed", range(10))
def test_orientations_of_an_arm_that_is_far_off_are_no_outliers(arm, driven, tmp_path, seed):
    """Zeros and axes off by a degree."""
    generator = np.random.default_rng(seed)
    truth = {one.name: 0.02 * generator.normal() for one in arm.candidates if one.unit == "rad"}
    found = _taken(tmp_path, _file(arm, driven, truth), arm, frame="register")
    assert found.measurements["status"].eq("ok").all()


def _longer(table):
    return table.assign(measured_qx=table["measured_qx"] + 0.5)


def _twice(table):
    return table.assign(**{f"measured_r{axis}_rad": 0.1 for axis in "xyz"})


@pytest.mark.parametrize(
    ("change", "options", "text"),
    [
        (_longer, {}, "a quaternion of length"),
        (_twice, {}, "an orientation twice"),
        (lambda table: table.drop(columns="measured_qw"), {}, "a part of an orientation"),
        (lambda table: table.assign(target=""), {}, "the reflector's name"),
        (
            lambda table: table.assign(target="a"),
            {"targets": {"z": (0.0, 0.0, 0.0)}},
            "targets: z",
        ),
        (lambda table: table.drop(columns="axis3_rad"), {}, "some drive angles"),
        (lambda table: table.assign(axis3_rad="wide"), {}, "a finite number"),
        (lambda table: table, {}, "frame: register"),
    ],
)
def test_what_is_no_pose_is_refused(arm, driven, tmp_path, change, options, text):
    with pytest.raises(IngestError, match=text):
        _taken(tmp_path, change(_file(arm, driven)), arm, **options)


@pytest.mark.parametrize("wrong", [1, 8])
def test_joints_that_no_robot_can_take_are_left_out_where_they_are_few(tmp_path, wrong):
    robot = Rrru3()
    point = np.random.default_rng(1).uniform((-300.0, -300.0, 500.0), (300.0, 300.0, 800.0), (30, 3))
    joints = dict(zip(robot.parts.columns, robot.inverse(point).T, strict=True))
    joints["theta1_rad"][7 : 7 + wrong] += 1.6
    table = pd.DataFrame({"trajectory": "a", **joints, **rows.vector_columns("measured", point)})
    if wrong == 1:
        taken = _taken(tmp_path, table, robot)
        assert len(taken.measurements) == 29
        assert any("left out" in note and note.endswith("1 of 30 rows, row 9") for note in taken.notes)
    else:
        with pytest.raises(IngestError, match="no pose in more than a tenth of the rows"):
            _taken(tmp_path, table, robot)


def test_candidates_of_reflectors_are_shifts_of_the_platforms_frame(arm):
    """A reflector's parameter moves that reflector and nothing else."""
    from rrru.kinematics.base_parameters import MeasurementConfig

    robot = arm.with_measurement_config(MeasurementConfig(("reflector a", "reflector b"), ("reflector b",)))
    own = [one for one in robot.candidates if one.name.startswith("reflector")]
    assert [one.name for one in own] == ["reflector_b_x", "reflector_b_y", "reflector_b_z"]
    twist = direction(robot.legs, own[1])
    assert twist[robot.legs.site_numbers["reflector b"]].tolist() == [0, 1, 0, 0, 0, 0] and np.count_nonzero(twist) == 1


def _seen_by_a_tracker(robot, driven, places, errors, generator):
    """A file of reflectors at places by name, read in an unknown frame; errors: of the robot, by name."""
    guess = robot.guess(driven)
    poses = robot.solve(driven, guess, robot.twists_of(errors))
    assert poses.closed.all()
    seen = np.stack([_FRAME.apply(poses.point(np.asarray(place))) + _SHIFT for place in places.values()], axis=1)
    seen = seen.reshape(-1, 3) + 0.01 * generator.standard_normal((len(driven) * len(places), 3))
    joints = pd.DataFrame(dict(zip(robot.parts.columns, driven.T, strict=True)))
    table = joints.loc[joints.index.repeat(len(places))].reset_index(drop=True)
    table = table.assign(trajectory="poses", target=[*places] * len(driven))
    return table.assign(**dict(zip(_POINTS, seen.T, strict=True)))


@pytest.mark.parametrize("seed", range(3))
def test_a_place_is_stated_as_far_as_the_readings_determine_it(tmp_path, seed):
    """A SCARA turns about z alone: at any height of its reflectors the tracker may stand so that all agrees."""
    generator = np.random.default_rng(seed)
    links = ({"a_mm": 325.0, "range_deg": [-120, 120]}, {"a_mm": 225.0, "alpha_deg": 180, "range_deg": [-130, 130]})
    wrist = ({"sliding": True, "range_mm": [0, 150]}, {"range_deg": [-170, 170]})
    robot = from_dh([*links, *wrist], name="scara")
    low, high = robot.drive_range.T
    driven = low + (high - low) * generator.random((60, 4))
    places = {"one": (40.0, 10.0, -35.0), "two": (-60.0, 25.0, -80.0)}
    errors = {"dq1": 2e-3, "dq2": -1e-3}
    notes = _taken(
        tmp_path, _seen_by_a_tracker(robot, driven, places, errors, generator), robot, frame="register"
    ).notes
    for name, place in places.items():
        (note,) = (one for one in notes if one.startswith(f"reflector {name} "))
        found = re.fullmatch(rf"reflector {name} found at \((.*), (.*), \?\) mm .*, to about (.*) mm, (.*)", note)
        assert found and "along z is not separately identifiable from the instrument's" in found[4]
        off = np.hypot(float(found[1]) - place[0], float(found[2]) - place[1])
        assert off < 3.0 * float(found[3]) < 10.0
    known = {"targets": {"one": places["one"]}}
    notes = _taken(
        tmp_path, _seen_by_a_tracker(robot, driven, places, errors, generator), robot, frame="register", **known
    ).notes
    (note,) = (one for one in notes if one.startswith("reflector "))
    numbers = re.fullmatch(r"reflector two found at \((.*), (.*), (.*)\) mm on the platform, to about (.*) mm", note)
    off = np.linalg.norm(np.array(numbers.groups()[:3], dtype=float) - places["two"])
    assert off < 3.0 * float(numbers[4]) < 10.0


# a zero offset of 9 mrad is so large that it is found with the frame, when the file is read
@pytest.mark.parametrize("found_one", [0.0, 9e-3])
def test_the_zero_of_the_last_drive_is_in_the_precision_of_a_place(tmp_path, found_one):
    """A zero offset of the axis that carries the platform turns all reflectors about it."""
    generator = np.random.default_rng(7)
    links = ({"a_mm": 325.0, "range_deg": [-120, 120]}, {"a_mm": 225.0, "alpha_deg": 90, "range_deg": [-130, 130]})
    wrist = ({"a_mm": 60.0, "alpha_deg": -90, "range_deg": [-100, 100]}, {"range_deg": [-170, 170]})
    robot = from_dh([*links, *wrist], name="arm")
    low, high = robot.drive_range.T
    driven = low + (high - low) * generator.random((60, 4))
    places = {"one": (40.0, 10.0, -35.0), "two": (-60.0, 25.0, -80.0)}
    table = _seen_by_a_tracker(robot, driven, places, {"dq2": found_one, "dq4": 4e-3}, generator)
    for note in _taken(tmp_path, table, robot, frame="register").notes:
        if found := re.fullmatch(
            r"reflector (\w+) found at \((.*), (.*), (.*)\) mm on the platform, to about (.*) mm", note
        ):
            place, about = np.array(found.groups()[1:4], dtype=float), float(found[5])
            off = np.linalg.norm(place - places.pop(found[1]))
            assert 4e-3 * 30.0 < off < about < 2.0
    assert not places


@pytest.mark.parametrize("seed", range(4))
def test_what_zeros_of_several_drives_move_all_places_by_is_in_their_precision(tmp_path, seed):
    """Errors of the legs of a hexapod move its platform nearly alike in all poses, so that the residual hides them."""
    generator, pairs = np.random.default_rng(seed), np.repeat([0.0, 120.0, 240.0], 2)
    foot, head = (np.radians(pairs + np.tile([-1.0, 1.0], 3) * apart) for apart in (17.0, 44.0))
    foot, head = (np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1) for angle in (foot, head))
    robot = hexapod(250.0 * foot, 170.0 * head, 450.0, 80.0)
    driven = robot.inverse(np.array([[0.0, 0.0, 450.0]])) + generator.uniform(-40.0, 40.0, (60, 6))
    zeros = {f"dl{k}": generator.normal(0.0, 0.4) for k in range(1, 7)}
    places = {"one": (60.0, 0.0, 40.0), "two": (-50.0, 60.0, 40.0)}
    table = _seen_by_a_tracker(robot, driven, places, zeros, generator)
    seen = _FRAME.inv().apply(table[[*_POINTS]].to_numpy() - _SHIFT)
    table = table.assign(**dict(zip(_POINTS, seen.T, strict=True)))
    for note in _taken(tmp_path, table, robot).notes:
        if found := re.fullmatch(
            r"reflector (\w+) found at \((.*), (.*), (.*)\) mm on the platform, to about (.*) mm", note
        ):
            place, about = np.array(found.groups()[1:4], dtype=float), float(found[5])
            assert np.linalg.norm(place - places.pop(found[1])) < 2.5 * about < 10.0
    assert not places


def test_the_place_on_a_platform_that_never_turns_is_an_assumption(tmp_path):
    robot, generator = Rrru3(), np.random.default_rng(1)
    driven = robot.inverse(generator.uniform((-150.0, -150.0, 550.0), (150.0, 150.0, 700.0), (40, 3)))
    places = {"one": (40.0, 10.0, -35.0), "two": (-60.0, 25.0, -80.0)}
    table = _seen_by_a_tracker(robot, driven, places, {}, generator)
    notes = _taken(tmp_path, table, robot, frame="register").notes
    assumed = [note for note in notes if note.startswith("reflector ")]
    assert len(assumed) == 2 and all("assumed at" in note and "does not determine it" in note for note in assumed)
    assert all("state it in `targets`" in note for note in assumed)


def _scara_of(first_mm, second_mm):
    links = (
        {"a_mm": first_mm, "range_deg": [-120, 120]},
        {"a_mm": second_mm, "alpha_deg": 180, "range_deg": [-130, 130]},
    )
    return from_dh([*links, {"sliding": True, "range_mm": [0, 150]}, {"range_deg": [-170, 170]}], name="scara")


def _in_the_robots_frame(robot, place, generator):
    """A file of a target at a place, read in the robot's frame."""
    low, high = robot.drive_range.T
    driven = low + (high - low) * generator.random((60, len(low)))
    seen = robot.solve(driven, robot.guess(driven)).point(np.asarray(place))
    seen = seen + 0.02 * generator.standard_normal(seen.shape)
    joints = pd.DataFrame(dict(zip(robot.parts.columns, driven.T, strict=True)))
    return joints.assign(trajectory="poses", **dict(zip(_POINTS, seen.T, strict=True)))


def test_a_wrong_height_in_the_robots_frame_is_named(tmp_path):
    """Along z a SCARA's tool, its slide's zero and the frame are one number: it is said which would fit."""
    robot = _scara_of(325.0, 225.0)
    off = 0.03 * robot.size_mm
    table = _in_the_robots_frame(robot, (0.0, 0.0, off), np.random.default_rng(3))
    (note,) = (one for one in _taken(tmp_path, table, robot).notes if "see that unit, frame and rows" in one)
    place = re.search(
        r"; a tool at \((.*), (.*), (.*)\) mm \(the robot's tool_mm\) would fit to less than 20 % of that", note
    )
    np.testing.assert_allclose(np.array(place.groups(), dtype=float), (0.0, 0.0, off), atol=0.02)


def test_places_along_an_axis_that_never_turns_are_next_to_the_tool(tmp_path):
    """Their heights are confounded with that of the tracker, which had been off by some of the tracker's distance."""
    robot, generator = _scara_of(325.0, 225.0), np.random.default_rng(5)
    low, high = robot.drive_range.T
    driven = low + (high - low) * generator.random((60, 4))
    places = {"one": (40.0, 10.0, -35.0), "two": (-60.0, 25.0, 45.0)}
    found = _taken(tmp_path, _seen_by_a_tracker(robot, driven, places, {}, generator), robot, frame="register")
    columns = ["target_x_mm", "target_y_mm", "target_z_mm"]
    place = found.measurements.groupby("target")[columns].first()
    middle = np.mean([*places.values()], axis=0)[2] - robot.tool_mm[2]
    for name, true in places.items():
        np.testing.assert_allclose(place.loc[name], np.array(true) - (0.0, 0.0, middle), atol=0.05)
    # z of the tool points down
    shift = found.registration.translation
    np.testing.assert_allclose(shift - (0.0, 0.0, middle), _FRAME.inv().apply(-_SHIFT), atol=0.5)


@pytest.mark.parametrize("off", [(0.0, 0.0, 50.0), (15.0, -30.0, 40.0)])
def test_a_wrong_place_on_a_platform_that_never_turns_is_named_beside_lost_zeros(off, tmp_path):
    """Zeros of three drives can do much of what a shift does: the shift, which does it all, is what to write."""
    robot, generator, stated = Rrru3(), np.random.default_rng(3), (60.0, 5.0, 30.0)
    true = np.add(stated, off)
    point = np.array([0.0, 0.0, 620.0]) + generator.uniform(-80.0, 80.0, (60, 3))
    driven = robot.inverse(point)
    table = pd.DataFrame(dict(zip(robot.parts.columns, driven.T, strict=True))).assign(trajectory="poses", target="a")
    seen = robot.solve(driven, point).point(true) + 0.02 * generator.standard_normal((60, 3))
    table = table.assign(**dict(zip(_POINTS, seen.T, strict=True)))
    try:
        words = " ".join(_taken(tmp_path, table, robot, targets={"a": stated}).notes)
    except IngestError as error:
        words = str(error)
    place = re.search(r"targets: \{a: \[(.*), (.*), (.*)\]\}", words)
    np.testing.assert_allclose(np.array(place.groups(), dtype=float), true, atol=0.1)


def test_a_robot_that_is_far_off_is_doubted(tmp_path):
    """Links that are 1 % longer than the description says are no gross mistake, but strange enough for a note."""
    robot, longer, generator = _scara_of(325.0, 225.0), _scara_of(330.0, 228.0), np.random.default_rng(3)
    for made, count in ((longer, 1), (robot, 0)):
        table = _in_the_robots_frame(made, (0.0, 0.0, 0.0), generator)
        moved = _FRAME.apply(table[_POINTS].to_numpy()) + _SHIFT
        table = table.assign(**dict(zip(_POINTS, moved.T, strict=True)))
        notes = _taken(tmp_path, table, robot, frame="register").notes
        doubted = [one for one in notes if one.endswith("see that `robot` is right")]
        lost = [one for one in notes if "lost" in one and "if the drives are referenced, `robot` is another one" in one]
        assert len(doubted) + len(lost) >= count and bool(doubted or lost) == bool(count)


def test_a_reflector_that_moves_far_less_than_the_tool_is_no_wrong_unit(arm, driven, tmp_path):
    """An instrument's own frame is the reason, and `frame: register` what to write."""
    poses = arm.solve(driven, np.tile(arm.legs.home_mm, (len(driven), 1)))
    wrist = poses.point(np.zeros(3))
    still = wrist[:1] + 0.2 * (wrist - wrist[:1])
    table = pd.DataFrame(dict(zip(arm.parts.columns, driven.T, strict=True)))
    moved = dict(zip(_POINTS, (_FRAME.apply(still) + _SHIFT).T, strict=True))
    with pytest.raises(IngestError) as error:
        _taken(tmp_path, table.assign(trajectory="poses", target="a", **moved), arm)
    assert "both in the same unit" not in str(error.value)


@pytest.mark.parametrize("moved", [1, 2])
def test_drives_of_a_gantry_in_another_order_are_named_in_the_robots_frame(moved, tmp_path):
    """They do what another frame does, so that a registration would explain them as well."""
    slide = {"sliding": True, "alpha_deg": 90}
    rows_of = ({**slide, "theta_deg": 90, "range_mm": [0, 900]}, {**slide, "theta_deg": 90, "range_mm": [100, 700]})
    robot = from_dh([*rows_of, {"sliding": True, "range_mm": [-50, 350]}], name="gantry")
    table = _in_the_robots_frame(robot, (0.0, 0.0, 0.0), np.random.default_rng(2))
    columns = [*robot.parts.columns]
    with pytest.raises(IngestError) as error:
        _taken(tmp_path, table.rename(columns=dict(zip(columns, np.roll(columns, moved), strict=True))), robot)
    right = ", ".join(np.roll(columns, -moved))
    assert f" or order: [{right}] or frame: register" in str(error.value)
