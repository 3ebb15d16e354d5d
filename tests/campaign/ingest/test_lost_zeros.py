"""Files of robots whose drives have lost their zeros, in an instrument's own frame: ingest, calibration, words."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from rrru.calibration.calibrate import calibrate
from rrru.calibration.campaign_fit import select
from rrru.campaign import measurements as rows
from rrru.campaign.ingest import zero_offsets
from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.diagnosis.result_notes import zero_notes
from rrru.robots.hexapod import hexapod
from rrru.robots.rrru3 import Rrru3
from rrru.robots.serial import serial
from rrru.studies.blind_validation.sentences.mistakes import read, right_file
from tests.schemas import check_measurements

_NOISE_MM = 0.02
_QUARTER = 0.5 * np.pi
_TURNED, _BACK = {"alpha": _QUARTER}, {"alpha": -_QUARTER}
_ROWS = (
    [
        {"d": 300.0} | _BACK,
        {"a": 280.0, "theta": -_QUARTER},
        {"a": 70.0} | _BACK,
        {"d": 300.0} | _TURNED,
        _BACK,
        {"d": 80.0},
    ],
    [{"d": 150.0} | _TURNED, {"a": -400.0}, {"a": -380.0}, {"d": 130.0} | _TURNED, {"d": 100.0} | _BACK, {"d": 90.0}],
)


def _arm(generator):
    """One of two kinds of arms with links of random lengths, actuator values (n, 6) and positions (n, 3)."""
    every = [
        {key: value * generator.uniform(0.8, 1.2) if key in ("a", "d") else value for key, value in row.items()}
        for row in _ROWS[generator.integers(2)]
    ]
    arm = serial(every, np.tile([-1.5, 1.5], (6, 1)), np.full(6, 0.3), parameter_set="full")
    driven = generator.uniform(-1.5, 1.5, (50, 6))
    return arm, driven, arm.forward(driven)


def _hexapod(generator):
    """A hexapod, actuator values (n, 6) and positions (n, 3)."""
    angles = np.radians([10.0, 110.0, 130.0, 230.0, 250.0, 350.0])
    base, plate = (
        np.stack([size * np.cos(at), size * np.sin(at), 0.0 * at], axis=1)
        for size, at in ((400.0, angles), (220.0, angles + np.radians([30.0, -30.0] * 3)))
    )
    robot = hexapod(base, plate, 500.0, parameter_set="full")
    place = robot.legs.home_mm + generator.uniform(-60.0, 60.0, (60, 3))
    turn = Rotation.from_rotvec(generator.uniform(-0.25, 0.25, (60, 3))).as_matrix()
    driven = robot.inverse(place, turn=turn)
    known = np.isfinite(driven).all(axis=1)
    return robot, driven[known], place[known]


def _file(folder, made, generator, zeros):
    """A file of a robot with zero offsets (K,): three reflectors at unknown places, in an unknown frame."""
    robot, driven, position = made
    poses = robot.solve(driven + zeros, position)
    assert poses.closed.all()
    frame, shift = Rotation.random(random_state=generator), generator.uniform(-3000.0, 3000.0, 3)
    parts = []
    for name in ("a", "b", "c"):
        seen = frame.apply(poses.point(generator.uniform(-100.0, 100.0, 3))) + shift
        seen += _NOISE_MM * generator.standard_normal(seen.shape)
        columns = dict(zip(robot.parts.columns, driven.T, strict=True))
        columns |= rows.vector_columns("command", position) | rows.vector_columns("measured", seen)
        parts.append(pd.DataFrame({"trajectory": "poses", "target": name, "stop": np.arange(len(seen)), **columns}))
    table = pd.concat(parts).sort_values(["stop", "target"]).drop(columns="stop")
    table.to_csv(folder / "mine.csv", index=False)
    return ingest(IngestSpec(str(folder / "mine.csv"), frame="register"), robot)


def _calibrated(found, robot):
    robot = robot.with_measurement_config(rows.measurement_config(found.measurements, (), True))
    return calibrate(residuals := select(found.measurements, robot, ["*"])), residuals.mechanism


def _two_far_off(generator, most, farthest):
    """Lost zeros (6,): up to `most`, two of them up to `farthest`."""
    zeros = generator.uniform(-most, most, 6)
    zeros[generator.choice(6, 2, replace=False)] = generator.uniform(-farthest, farthest, 2)
    return zeros


@pytest.mark.parametrize("seed", range(8))
def test_lost_zeros_of_arms_are_found_with_frame_and_reflectors(seed, tmp_path):
    generator = np.random.default_rng(seed)
    made = _arm(generator)
    zeros = _two_far_off(generator, 0.06, 0.35)
    found = _file(tmp_path, made, generator, zeros)
    check_measurements(made[0], found.measurements)
    assert (found.measurements["status"] == "ok").all()
    fit, robot = _calibrated(found, made[0])
    assert fit.rms_mm < 1.2 * np.sqrt(3.0) * _NOISE_MM and not fit.at_bound.any()
    # the first drive's zero offset is confounded with the frame, the last one's with the reflectors
    values = dict(zip(fit.parameters.names, fit.deviations.tolist(), strict=True))
    for k in (2, 3, 4, 5):
        assert values[f"dq{k}"] == pytest.approx(zeros[k - 1], abs=2e-3)
    noted = " ".join(zero_notes(fit.estimate, robot))
    for k in (2, 3, 4, 5):
        assert (f"joint {k}: zero, or the part that it moves, is off by " in noted) == (abs(values[f"dq{k}"]) > 5e-3)
    if np.abs(zeros[1:5]).max() > 0.05:
        assert any("drives are lost" in note for note in found.notes)


@pytest.mark.parametrize("seed", range(3))
def test_lost_lengths_of_hexapods_are_found_with_frame_and_reflectors(seed, tmp_path):
    generator = np.random.default_rng(seed)
    made = _hexapod(generator)
    zeros = _two_far_off(generator, 20.0, 60.0)
    fit, robot = _calibrated(_file(tmp_path, made, generator, zeros), made[0])
    assert fit.rms_mm < 1.2 * np.sqrt(3.0) * _NOISE_MM and not fit.at_bound.any()
    noted = list(zero_notes(fit.estimate, robot))
    assert any(note.startswith("leg ") and " mm (95 %: " in note for note in noted)
    # an uncertain zero offset gets no note
    unsure, sure = (replace(fit.estimate, covariance=np.diag((share * fit.deviations) ** 2)) for share in (0.3, 0.2))
    assert not list(zero_notes(unsure, robot))
    assert [note.partition(":")[0] for note in zero_notes(sure, robot)] == [note.partition(":")[0] for note in noted]


@pytest.mark.parametrize("degrees", [0.3, 0.7, 3.0])
def test_a_zero_is_lost_only_where_it_is_off_by_more_than_marks_are_read(degrees, tmp_path):
    """One zero of an arm; a smaller one is a number of the calibration like any other."""
    generator = np.random.default_rng(5)
    zeros = np.zeros(6)
    zeros[2] = np.radians(degrees)
    made = _arm(generator)
    found = _file(tmp_path, made, generator, zeros)
    (noted,) = [note for note in found.notes if "lost" in note] or [""]
    assert noted.startswith(
        f"the zero of 1 drive is lost, by {degrees:.0f} degrees at joint 3" if degrees > 1.0 else ""
    )
    assert bool(noted) == (degrees > 1.0)
    fit, _ = _calibrated(found, made[0])
    values = dict(zip(fit.parameters.names, fit.deviations.tolist(), strict=True))
    assert values["dq3"] == pytest.approx(zeros[2], abs=2e-3)


def test_a_tool_off_by_a_millimetre_next_to_the_last_axis_is_no_lost_zero(tmp_path):
    """A zero off by 7 degrees moves the tool as far; that of a joint with a long link is lost next to it."""
    generator = np.random.default_rng(3)
    arm = replace(_arm(generator)[0], tool_mm=(8.0, 0.0, 0.0))
    driven, off = generator.uniform(-1.5, 1.5, (50, 6)), np.zeros(6)
    for off[2] in (0.0, np.radians(3.0)):
        seen = replace(arm, tool_mm=(8.0, 1.0, 0.0)).forward(driven + off)
        seen = Rotation.from_rotvec([0.4, -1.0, 0.3]).apply(seen) + np.array([900.0, -2000.0, 300.0])
        columns = dict(zip(arm.parts.columns, driven.T, strict=True)) | rows.vector_columns("measured", seen)
        file = tmp_path / "mine.csv"
        pd.DataFrame({"trajectory": "poses"} | columns).to_csv(file, index=False)
        noted = [note for note in ingest(IngestSpec(str(file), frame="register"), arm).notes if "lost" in note]
        assert [note.partition(":")[0] for note in noted] == [
            "the zero of 1 drive is lost, by 3 degrees at joint 3"
        ] * bool(off[2])


def test_zeros_that_are_known_are_left_alone(tmp_path):
    generator = np.random.default_rng(5)
    made = _arm(generator)
    found = _file(tmp_path, made, generator, np.zeros(6))
    assert not any("lost" in note for note in found.notes)
    fit, robot = _calibrated(found, made[0])
    assert not list(zero_notes(fit.estimate, robot))


@pytest.mark.parametrize("number", [18, 178, 198, 558, 777, 838])
def test_a_base_that_is_off_by_some_mm_is_no_wrong_place_of_a_target(number, tmp_path):
    """Deltas of another simulator: the platform never turns, so that a shift of the base is one of all targets."""
    own, handed = right_file(number, 902417, 300)
    assert own.name.startswith("delta")
    assert read(own, handed, tmp_path)[0] == "accepted"


def test_a_zero_without_which_a_stop_has_no_pose_is_not_small():
    """A frame was fitted to that stop's missing pose: "SVD did not converge", on a right file of a hexapod."""
    robot = Rrru3()
    position = np.array([[0.0, 0.0, 900.0], [190.23, 550.86, 1030.32]])
    zeros = np.array([1e-4, 0.0, 0.15])
    drive = robot.inverse(position) - zeros
    assert robot.solve(drive + zeros, position).closed.all()
    assert robot.solve(drive + zeros * [1.0, 0.0, 0.0], position).closed.tolist() == [True, False]

    def frames(poses):
        assert np.isfinite(poses.position_mm).all()
        return zero_offsets.Framed(poses.position_mm, poses.position_mm, np.zeros_like(position), ())

    far = zero_offsets._far_off(robot, (drive, position), frames, zeros)
    assert far[:2].tolist() == [0.0, 0.0] and far[2] == pytest.approx(0.15 / np.radians(1.0))
