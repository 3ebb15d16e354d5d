"""Gross mistakes put into files of random robots: each is named, and files without one are not suspected."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.campaign.ingest.gross_errors import find_gross_error
from rrru.campaign.ingest.mistakes import Mistakes
from rrru.errors import ConfigError, IngestError
from rrru.robots.rrru3 import Rrru3
from tests.campaign.ingest.test_lost_zeros import _arm, _hexapod

_PLACE_MM = (40.0, -25.0, 60.0)
_NOISE_MM, _ERROR_SD = 0.02, {"mm": 0.5, "rad": 1e-3}
_SPEC = IngestSpec("file.csv", frame="register", targets={"ball": _PLACE_MM})


def _made(seed, kind=_arm):
    """A robot with ordinary errors of all its numbers, and its file: a reflector in a frame that nobody knows."""
    generator = np.random.default_rng(seed)
    robot, driven, position = kind(generator)
    sizes = np.array([_ERROR_SD[unit] for unit in robot.parameters.units])
    poses = robot.solve(driven, position, robot.twists(sizes * generator.standard_normal(len(sizes))))
    assert poses.closed.all()
    seen = Rotation.random(random_state=generator).apply(poses.point(np.array(_PLACE_MM)))
    seen = seen + generator.uniform(-2000.0, 2000.0, 3) + _NOISE_MM * generator.standard_normal(seen.shape)
    told = dict(zip(robot.parts.columns, driven.T, strict=True)) | rows.vector_columns("measured", seen)
    return robot, pd.DataFrame(told).assign(trajectory="poses", target="ball")


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
    named["measured columns that are not 1 row late"] = _shifted(frame, 1)
    named["measured columns that are not 2 rows early"] = _shifted(frame, -2)
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


def test_files_without_drive_values_have_none():
    robot, frame = _made(1)
    assert find_gross_error(frame.drop(columns=[*robot.parts.columns]), _SPEC, robot) is None


def test_a_mistake_is_undone_by_what_is_applied():
    mistakes = Mistakes((1, -1, 1), (2, 0, 1))
    drive = np.arange(6.0).reshape(2, 3)
    # the first column is of the third drive
    np.testing.assert_array_equal(mistakes.applied(drive), [[1.0, -2.0, 0.0], [4.0, -5.0, 3.0]])
    assert mistakes.count == 2


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
    # what is advised for exchanged columns of which one is counted in the opposite direction, too
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
    """Measured positions lie about the commanded ones: drive values alone show what is wrong with them."""
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
    assert "extra_columns: ignore" in text.split("remark")[1] and "J1 [rad]: got a column that nobody" not in text
