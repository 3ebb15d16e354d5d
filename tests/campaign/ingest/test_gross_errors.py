"""Gross mistakes put into files of random robots: each is named, and files without one are not suspected."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.campaign.ingest.gross_advice import place_words
from rrru.campaign.ingest.gross_errors import find_gross_error
from rrru.campaign.ingest.mistakes import Mistakes
from rrru.campaign.ingest.spec import MM
from rrru.errors import ConfigError, IngestError
from rrru.robots.catalogue import make_mechanism
from rrru.robots.from_dh import from_dh
from rrru.robots.rrru3 import Rrru3
from tests.campaign.ingest.test_lost_zeros import _arm, _hexapod
from tests.robots import two_arms

_PLACE_MM = (40.0, -25.0, 60.0)
_NOISE_MM, _ERROR_SD = 0.02, {"mm": 0.5, "rad": 1e-3}
_SPEC = IngestSpec("file.csv", frame="register", targets={"ball": _PLACE_MM})


def _made(seed, kind=_arm):
    """A robot with ordinary errors of all its parameters, and its file: a reflector in an unknown frame."""
    generator = np.random.default_rng(seed)
    robot, driven, position = kind(generator)
    sizes = np.array([_ERROR_SD[unit] for unit in robot.parameters.units])
    poses = robot.solve(driven, position, robot.twists(sizes * generator.standard_normal(len(sizes))))
    assert poses.closed.all()
    seen = Rotation.random(random_state=generator).apply(poses.point(np.array(_PLACE_MM)))
    seen = seen + generator.uniform(-2000.0, 2000.0, 3) + _NOISE_MM * generator.standard_normal(seen.shape)
    columns = dict(zip(robot.parts.columns, driven.T, strict=True)) | rows.vector_columns("measured", seen)
    return robot, pd.DataFrame(columns).assign(trajectory="poses", target="ball")


def test_a_coordinate_that_is_zero_but_for_rounding_is_said_to_be_zero():
    """As that of a tool along an axis that no reading determines."""
    place = np.array([90.286, -2.068e-25, -0.25])
    assert place_words({"": place}) == "a tool at (90.286, 0, -0.25) mm (the robot's tool_mm)"


_MOVED = "move their values {} by {} in each run, leave all other columns, and delete its {}"


def test_moving_late_rows_as_advised_leaves_no_mistake():
    robot, frame = _made(0, _arm)
    late = _shifted(frame, 1)
    measured = [f"measured_{axis}_mm" for axis in "xyz"]
    moved = late.assign(**{name: late[name].shift(-1) for name in measured}).iloc[:-1]
    assert find_gross_error(late, _SPEC, robot) is not None and find_gross_error(moved, _SPEC, robot) is None


def _shifted(frame, by):
    """The frame with measured columns that are late by so many rows."""
    measured = rows.measured(frame)
    late = frame.assign(**rows.vector_columns("measured", np.roll(measured, by, axis=0)))
    return late.iloc[by:] if by > 0 else late.iloc[:by]


@pytest.mark.parametrize("kind", [_arm, _hexapod])
@pytest.mark.parametrize("seed", range(2))
def test_every_mistake_is_named(kind, seed):
    robot, frame = _made(seed, kind)
    drives, generator = [*robot.parts.columns], np.random.default_rng(seed + 100)
    k = int(generator.integers(len(drives)))
    named = {f"signs: {{{drives[k]}: -1}}": frame.assign(**{drives[k]: -frame[drives[k]]})}
    one, other = sorted(generator.choice(len(drives), 2, replace=False).tolist())
    order = list(drives)
    order[one], order[other] = drives[other], drives[one]
    exchanged = frame.assign(**{drives[one]: frame[drives[other]], drives[other]: frame[drives[one]]})
    named[f"order: [{', '.join(order)}]"] = exchanged
    named[f"measured columns that are not 1 row late: {_MOVED.format('up', '1 row', 'last row')}"] = _shifted(frame, 1)
    early = _MOVED.format("down", "2 rows", "first 2 rows")
    named[f"measured columns that are not 2 rows early: {early}"] = _shifted(frame, -2)
    mirror = rows.measured(frame) * [1.0, -1.0, 1.0]
    named["a right-handed frame: columns: {measured_x_mm: measured_y_mm, measured_y_mm: measured_x_mm}"] = frame.assign(
        **rows.vector_columns("measured", mirror)
    )
    for advice, spoilt in named.items():
        found = find_gross_error(spoilt, _SPEC, robot)
        assert found is not None and found.advice == advice
        assert found.rms_without_mm < 0.1 * found.rms_mm


@pytest.mark.parametrize("seed", range(4))
def test_a_wrong_place_of_the_target_is_named_with_the_right_one(seed):
    robot, frame = _made(seed)
    wrong = replace(_SPEC, targets={"ball": tuple(np.add(_PLACE_MM, [50.0, 0.0, -10.0]))})
    found = find_gross_error(frame, wrong, robot)
    assert found.advice.startswith("targets: {ball: [")
    place = [float(text) for text in found.advice.removeprefix("targets: {ball: [").removesuffix("]}").split(",")]
    np.testing.assert_allclose(place, _PLACE_MM, atol=3.0)


@pytest.mark.parametrize("late", [1, 3])
def test_rows_late_by_one_or_by_a_stop_of_three_targets_are_named(late):
    generator = np.random.default_rng(7)
    robot, driven, position = _hexapod(generator)
    places = np.array([[60.0, 0.0, 25.0], [-40.0, 50.0, 25.0], [-30.0, -55.0, 25.0]])
    poses = robot.solve(driven, position)
    seen = np.stack([poses.point(place) for place in places], axis=1).reshape(-1, 3)
    seen = seen @ Rotation.random(random_state=generator).as_matrix().T + 0.5 * generator.standard_normal(seen.shape)
    frame = pd.DataFrame(np.repeat(driven, 3, axis=0), columns=robot.parts.columns)
    frame = frame.assign(trajectory="poses", target=np.tile(["a", "b", "c"], len(driven)))
    frame = frame.assign(**rows.vector_columns("measured", seen))
    spec = replace(_SPEC, targets={})
    assert find_gross_error(frame, spec, robot) is None
    found = find_gross_error(_shifted(frame, late), spec, robot)
    assert found is not None and found.mistakes == replace(Mistakes.none(6), shift=late)


def _scara(generator):
    """A SCARA, its drive values and positions: it turns about z only."""
    links = [{"a_mm": 400, "range_deg": [-120, 120]}, {"a_mm": 300, "alpha_deg": 180, "range_deg": [-130, 130]}]
    wrist = [{"sliding": True, "range_mm": [0, 200]}, {"d_mm": 50, "range_deg": [-170, 170]}]
    robot = from_dh([*links, *wrist], name="scara", parameter_set="full")
    low, high = np.asarray(robot.drive_range).T
    driven = low + (high - low) * generator.random((60, 4))
    return robot, driven, robot.guess(driven)


@pytest.mark.parametrize("kind", [_arm, _scara])
def test_one_wrong_place_of_three_is_named_and_the_others_stay(kind):
    """Also for a robot that turns about z only, whose readings do not determine a common height of all targets."""
    generator = np.random.default_rng(11)
    places = {"a": (60.0, 0.0, 40.0), "b": (-50.0, 60.0, 40.0), "c": (-40.0, -70.0, 60.0)}
    robot, driven, position = kind(generator)
    poses, turn = robot.solve(driven, position), Rotation.random(random_state=generator)
    columns = dict(zip(robot.parts.columns, driven.T, strict=True))
    frames = []
    for name, place in places.items():
        seen = turn.apply(poses.point(np.array(place))) + np.array([900.0, -300.0, 200.0])
        seen = seen + _NOISE_MM * generator.standard_normal(seen.shape)
        frames.append(pd.DataFrame(columns | rows.vector_columns("measured", seen)).assign(target=name))
    frame = pd.concat(frames, ignore_index=True).assign(trajectory="poses")
    assert find_gross_error(frame, replace(_SPEC, targets=places), robot) is None
    wrong = places | {"b": (-10.0, 60.0, 40.0)}
    found = find_gross_error(frame, replace(_SPEC, targets=wrong), robot)
    for name, place in places.items():
        text = re.search(rf"{name}: \[([^]]*)\]", found.advice)[1]
        np.testing.assert_allclose([float(number) for number in text.split(",")], place, atol=1.0)


def _rotary_table(places):
    """A machine whose spindle visits places (k, 3) on its rotary table, and its file: 15 angles of the table each."""
    turn, slide = {"range_deg": [-170, 170]}, {"sliding": True, "range_mm": [-300, 300]}
    table = [turn | {"name": "c"}, {"rpy_deg": [0, 90, 0]}, slide | {"alpha_deg": -90, "name": "x"}]
    slides = [slide | {"theta_deg": -90, "alpha_deg": -90, "name": "y"}, slide | {"name": "z"}]
    robot = from_dh([*table, *slides], name="mill")
    drives = np.zeros((15 * len(places), 4))
    drives[:, 0] = np.tile(np.linspace(-2.4, 2.4, 15), len(places))
    home = robot.forward(drives)
    moved = np.stack([robot.forward(drives + np.eye(4)[k]) - home for k in (1, 2, 3)], axis=2)
    drives[:, 1:] = np.linalg.solve(moved, (np.repeat(places, 15, axis=0) - home)[..., None])[..., 0]
    frame = pd.DataFrame(drives, columns=robot.parts.columns).assign(trajectory="poses")
    return robot, frame.assign(**rows.vector_columns("measured", robot.forward(drives)))


def test_a_mistake_that_only_a_turned_instrument_hides_is_not_named_in_the_robot_s_frame():
    """Of a spindle that visits three places on a rotary table, which are in one plane: where the instrument may stand
    anywhere, a table that turns in the opposite sense and a slide that moves so give the same readings.
    """
    robot, frame = _rotary_table(np.array([[120.0, 0.0, 60.0], [-80.0, 90.0, 60.0], [0.0, -120.0, 140.0]]))
    frame, named = frame.assign(c_rad=-frame["c_rad"]), {}
    for of in ("register", "robot"):
        named[of] = find_gross_error(frame, IngestSpec("file.csv", frame=of), robot).advice
    assert "signs: {c_rad: -1}" in named["register"] and " or " in named["register"]
    assert named["robot"] == "signs: {c_rad: -1}"


def test_a_tool_that_stays_at_one_place_on_a_rotary_table_is_no_wrong_unit(tmp_path):
    """An R-test: all drives move, the commanded places spread over rounding and the measured ones over the errors."""
    robot, frame = _rotary_table(np.array([[120.0, 0.0, 60.0]]))
    errors = np.random.default_rng(2).normal(0.0, 0.02, (len(frame), 3))
    frame = frame.assign(**rows.vector_columns("measured", rows.measured(frame) + errors))
    frame.to_csv(tmp_path / "mine.csv", index=False)
    assert len(ingest(IngestSpec(str(tmp_path / "mine.csv")), robot).measurements) == len(frame)


def test_two_mistakes_at_once_are_named():
    robot, frame = _made(7)
    drives = [*robot.parts.columns]
    frame = frame.assign(**{drives[1]: -frame[drives[1]], drives[3]: -frame[drives[3]]})
    assert find_gross_error(frame, _SPEC, robot).advice == f"signs: {{{drives[1]}: -1, {drives[3]}: -1}}"


@pytest.mark.parametrize("kind", [_arm, _hexapod])
def test_right_files_are_not_suspected(kind):
    for seed in range(20, 32):
        robot, frame = _made(seed, kind)
        assert find_gross_error(frame, _SPEC, robot) is None


def test_lost_zeros_are_no_gross_mistake():
    for seed in range(40, 46):
        robot, frame = _made(seed)
        lost = np.random.default_rng(seed).uniform(-0.3, 0.3, len(robot.parts.columns))
        off = frame.assign(**{name: frame[name] + zero for name, zero in zip(robot.parts.columns, lost, strict=True)})
        assert find_gross_error(off, _SPEC, robot) is None


def _commanded(seed):
    """An arm, and its file of commanded poses without drive values."""
    robot, frame = _made(seed)
    driven = frame[[*robot.parts.columns]].to_numpy()
    poses = robot.solve(driven, robot.guess(driven))
    sent = poses.point(np.asarray(robot.tool_mm))
    columns = rows.vector_columns("command", sent) | rows.turn_columns("command", poses.turn)
    return robot, frame.drop(columns=[*robot.parts.columns]).assign(**columns)


@pytest.mark.parametrize("seed", range(3))
def test_mistakes_in_files_of_commanded_poses_are_named(seed):
    robot, frame = _commanded(seed)
    measured = rows.measured(frame)
    assert find_gross_error(frame, _SPEC, robot) is None
    named = {
        "measured columns that are not 1 row late": _shifted(frame, 1),
        "a right-handed frame": frame.assign(**rows.vector_columns("measured", measured[:, [2, 1, 0]])),
        "measured columns in mm, as the commanded ones: they are in m": frame.assign(
            **rows.vector_columns("measured", measured / 1000.0)
        ),
    }
    for advice, spoilt in named.items():
        assert find_gross_error(spoilt, _SPEC, robot).advice.startswith(advice)
    wrong = replace(_SPEC, targets={"ball": tuple(np.add(_PLACE_MM, [50.0, 0.0, -10.0]))})
    assert find_gross_error(frame, wrong, robot).advice.startswith("targets: {ball: [")


@pytest.mark.parametrize(("kind", "unit"), [(_arm, "m"), (_arm, "inch"), (_hexapod, "m"), (_hexapod, "inch")])
def test_units_of_readings_and_of_drive_values_are_named(kind, unit):
    robot, frame = _made(11, kind)
    factor, lengths = MM[unit], "mm" in robot.parts.units
    drives = [*robot.parts.columns]
    read = frame.assign(**rows.vector_columns("measured", rows.measured(frame) / factor))
    both = read.assign(**{name: read[name] / factor for name in drives if lengths})
    assert find_gross_error(both, _SPEC, robot).advice == f"unit: {unit}"
    if lengths:
        assert find_gross_error(read, _SPEC, robot).advice == f"unit: {unit} and drive_unit: mm"
        driven = frame.assign(**{name: frame[name] / factor for name in drives})
        assert find_gross_error(driven, _SPEC, robot).advice == f"drive_unit: {unit}"
    else:
        degrees = frame.assign(**{name: np.degrees(frame[name]) for name in drives})
        assert find_gross_error(degrees, _SPEC, robot).advice == "angle_unit: deg"
        radians = frame.assign(**{name: np.radians(frame[name]) for name in drives})
        assert find_gross_error(radians, replace(_SPEC, angle_unit="deg"), robot).advice == "angle_unit: rad"


@pytest.mark.parametrize("kind", [_arm, _hexapod])
def test_any_order_of_the_drives_is_found(kind):
    for seed in range(3):
        robot, frame = _made(60 + seed, kind)
        drives = [*robot.parts.columns]
        order = np.random.default_rng(seed).permutation(len(drives)).tolist()
        mixed = frame.assign(**{name: frame[drives[k]] for name, k in zip(drives, order, strict=True)})
        wanted = f"order: [{', '.join(drives[k] for k in order)}]"
        assert wanted in find_gross_error(mixed, _SPEC, robot).advice.split(" or ")


def test_the_file_of_another_robot_does_not_fit(tmp_path):
    (_, frame), (other, _) = _made(70), _made(71)
    found = find_gross_error(frame, _SPEC, other)
    assert found.limit_mm is not None and min(found.rms_mm, found.rms_without_mm) > found.limit_mm
    path = tmp_path / "file.csv"
    frame.to_csv(path, index=False)
    with pytest.raises(IngestError, match="the file does not fit the robot"):
        ingest(replace(_SPEC, path=str(path)), other)


def _two_arms(seed):
    """The robot of two arms, and its file of both end effectors' markers with stated places."""
    generator = np.random.default_rng(seed)
    robot = make_mechanism("two_arms", two_arms.section())
    driven = robot.legs.home_drives + generator.uniform(-0.5, 0.5, (40, len(two_arms.DRIVES)))
    every, arms = np.repeat(driven, 2, axis=0), np.tile(["right", "left"], len(driven))
    seen = np.array([two_arms.seen(q, arm, two_arms.MARKERS[arm]) for q, arm in zip(every, arms, strict=True)])
    seen = Rotation.random(random_state=generator).apply(seen) + generator.normal(size=seen.shape)
    frame = pd.DataFrame(every, columns=robot.parts.columns).assign(trajectory="poses", target=arms)
    spec = IngestSpec("file.csv", frame="register", targets=two_arms.MARKERS)
    return robot, frame.assign(**rows.vector_columns("measured", seen)), spec


def test_mistakes_of_robots_with_two_hands_are_named():
    robot, frame, spec = _two_arms(3)
    drives = [*robot.parts.columns]
    assert find_gross_error(frame, spec, robot) is None
    turned = frame.assign(**{drives[4]: -frame[drives[4]]})
    assert find_gross_error(turned, spec, robot).advice == f"signs: {{{drives[4]}: -1}}"
    swapped = frame.assign(**{drives[3]: frame[drives[7]], drives[7]: frame[drives[3]]})
    order = [*drives[:3], drives[7], *drives[4:7], drives[3], *drives[8:]]
    assert find_gross_error(swapped, spec, robot).advice == f"order: [{', '.join(order)}]"
    assert find_gross_error(frame.drop(columns="target"), spec, robot) is None


def test_exchanged_targets_of_two_hands_are_named(tmp_path):
    robot, frame, spec = _two_arms(3)
    exchanged = frame["target"].map({"left": "right", "right": "left"})
    path = tmp_path / "file.csv"
    frame.assign(target=exchanged).to_csv(path, index=False)
    with pytest.raises(IngestError) as refused:
        ingest(replace(spec, path=str(path), targets={}), robot)
    (problem,) = refused.value.problems
    assert problem["column"] == "target"
    assert problem["allowed"].startswith("right and left exchanged, in this column or in `carries`, which leaves ")


def test_what_the_message_says_of_a_left_handed_frame_mends_it(tmp_path):
    robot, frame = _made(4)
    path = tmp_path / "file.csv"
    frame.assign(measured_x_mm=frame["measured_z_mm"], measured_z_mm=frame["measured_x_mm"]).to_csv(path, index=False)
    with pytest.raises(IngestError) as refused:
        ingest(replace(_SPEC, path=str(path)), robot)
    text = re.search(r"columns: \{(.*?)\}", str(refused.value))[1]
    exchanged = dict(pair.split(": ") for pair in text.split(", "))
    ingest(replace(_SPEC, path=str(path), columns=exchanged), robot)


def test_a_mistake_is_undone_by_what_is_applied():
    mistakes = Mistakes((1, -1, 1), (2, 0, 1))
    drive = np.arange(6.0).reshape(2, 3)
    # the first column is of the third drive
    np.testing.assert_array_equal(mistakes.applied(drive), [[1.0, -2.0, 0.0], [4.0, -5.0, 3.0]])
    assert mistakes.count == 2


def test_an_arm_in_degrees_is_not_said_to_have_no_pose_alone(tmp_path):
    robot, frame = _made(3)
    path = tmp_path / "file.csv"
    drives = [*robot.parts.columns]
    frame.assign(**np.degrees(frame[drives])).to_csv(path, index=False)
    with pytest.raises(IngestError) as refused:
        ingest(replace(_SPEC, path=str(path)), robot)
    (problem,) = refused.value.problems
    assert problem["value"].startswith("values far outside of the drives' ranges, or ")
    assert problem["allowed"].startswith("angle_unit: deg, ")


def test_what_the_message_says_mends_the_file(tmp_path):
    robot, frame = _made(3)
    drives = [*robot.parts.columns]
    exchanged = frame.assign(**{drives[4]: -frame[drives[5]], drives[5]: frame[drives[4]]})
    path = tmp_path / "file.csv"
    exchanged.to_csv(path, index=False)
    spec = replace(_SPEC, path=str(path))
    with pytest.raises(IngestError) as refused:
        ingest(spec, robot)
    order = (*drives[:4], drives[5], drives[4])
    assert f"order: [{', '.join(order)}] and signs: {{{drives[5]}: -1}}" in str(refused.value)
    table = ingest(replace(spec, order=order, signs={drives[5]: -1}), robot).measurements
    np.testing.assert_allclose(table[drives], frame[drives])


def test_what_to_write_replaces_what_the_configuration_states(tmp_path):
    """A right file with a sign or an exchange stated that it does not have, and a file that needs one more sign."""
    robot, frame = _made(3)
    drives = [*robot.parts.columns]
    path = tmp_path / "file.csv"
    frame.to_csv(path, index=False)
    spec = replace(_SPEC, path=str(path))
    with pytest.raises(IngestError, match="allowed: no `signs`, which leaves"):
        ingest(replace(spec, signs={drives[1]: -1}), robot)
    exchanged = (drives[1], drives[0], *drives[2:])
    with pytest.raises(IngestError, match="allowed: no `order`, which leaves"):
        ingest(replace(spec, order=exchanged), robot)
    frame.assign(**{drives[1]: -frame[drives[1]], drives[4]: -frame[drives[4]]}).to_csv(path, index=False)
    with pytest.raises(IngestError) as refused:
        ingest(replace(spec, signs={drives[1]: -1}), robot)
    assert f"allowed: signs: {{{drives[1]}: -1, {drives[4]}: -1}}, which leaves" in str(refused.value)
    # the advice for exchanged columns of which one is also counted in the opposite direction
    order, turned = Mistakes((1, 1, 1), (1, 0, 2)), Mistakes((-1, 1, 1), (0, 1, 2))
    drive = np.arange(6.0).reshape(2, 3)
    for first, second in ((order, turned), (turned, order)):
        np.testing.assert_array_equal(second.after(first).applied(drive), second.applied(first.applied(drive)))


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"signs": {"q9": -1}}, "signs has 'q9'"),
        ({"signs": {"theta1_rad": 2}}, "signs has theta1_rad: 2; allowed: 1 or -1"),
        ({"order": ("theta1_rad", "theta2_rad")}, "order is theta1_rad, theta2_rad; allowed: each of"),
    ],
)
def test_signs_and_order_are_of_the_robots_drives(wrong, text):
    with pytest.raises(ConfigError, match=text):
        IngestSpec("file.csv", **wrong).check_drives(Rrru3().parts.columns)


def test_drive_values_that_contradict_the_commands_are_named(tmp_path):
    """Measured positions are near the commanded ones: drive values alone show what is wrong with them."""
    robot, frame = _made(5)
    drives = [*robot.parts.columns]
    sent = robot.forward(frame[drives].to_numpy())
    path = tmp_path / "file.csv"
    few = frame.assign(**rows.vector_columns("command", sent), **rows.vector_columns("measured", sent))
    few = few.drop(columns="target").assign(**{drives[2]: -frame[drives[2]]})
    few.to_csv(path, index=False)
    with pytest.raises(IngestError, match=rf"signs: {{{drives[2]}: -1}}"):
        ingest(IngestSpec(str(path)), robot)


def test_columns_that_look_like_the_drives_are_proposed_as_such(tmp_path):
    """`extra_columns: ignore` would drop the joint values."""
    robot, frame = _made(8)
    path, drives = tmp_path / "file.csv", [*robot.parts.columns]
    named = frame.rename(columns={name: f"J{k} [rad]" for k, name in enumerate(drives, 1)})
    named.assign(**rows.vector_columns("command", rows.measured(frame)), remark="").to_csv(path, index=False)
    with pytest.raises(IngestError) as refused:
        ingest(replace(_SPEC, path=str(path)), robot)
    text = str(refused.value)
    assert f'columns: {{{drives[0]}: "J1 [rad]", {drives[1]}: "J2 [rad]"' in text
    assert "extra_columns: ignore" in text.split("remark")[1] and "J1 [rad]: got an undeclared column" not in text
