"""The elastic torso: its measured poses, where the folder of real data is there, and its description without them.

Reference residuals: README of the data set, fits by plain least squares of the same 245 poses, on the same 105 others.
"""

import json
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.model_fit import fit_named_effects
from rrru.diagnosis.settings import GapSettings
from rrru.effects.library import NAMES, find
from rrru.errors import ConfigError
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.studies.real.chains import END_EFFECTORS, robot_section

_FOLDER = Path(os.environ.get("RRRU_REAL_DATA", ""), "justin")
_THERE = "RRRU_REAL_DATA" in os.environ and (_FOLDER / "chain.json").is_file()
needs_data = pytest.mark.skipif(not _THERE, reason="RRRU_REAL_DATA names no folder that holds justin/chain.json")
_NO_LOADS = Masses(0.0, 0.0, 0.0)
_NOISE_MM = 3.0
_SPRINGS, _BENDING, _CROSS = "drive_compliance", "link_flexure", "cross_compliance"


# with the whole library the cross compliance has a probability of 0.96 on these rows
_WITHOUT = ("drive_error_function", "transmission_orders", "friction_windup", "encoder_ovality", "read_before_rest")
_WITHOUT += ("base_drift", "thermal_expansion", "pedestal_compliance", "tracker_scale")
_SETTINGS = GapSettings(tuple(name for name in NAMES if name not in _WITHOUT))


@dataclass(frozen=True)
class Torso:
    """Part of the configuration for the robot, and the table of its measurements with `held_out`."""

    nominal: dict
    table: pd.DataFrame

    def of(self, held_out):
        """The rows that are held out, or the others."""
        return self.table[self.table["held_out"] == held_out]

    def robot(self, parameter_set):
        """The robot with what the rows for training tell."""
        return setup.measured_robot(self.nominal, self.of(0), parameter_set)

    def model(self, parameter_set, effects=()):
        """ModelFit of the rows for training, and distances (n,) in mm of the held-out ones."""
        robot = self.robot(parameter_set)
        library = {name: find(name, robot) for name in effects}
        train, test = (make_diagnosis_problem(self.of(k), robot, _NO_LOADS, _NOISE_MM, library) for k in (0, 1))
        fit = fit_named_effects(train, effects, calibrate(train))
        return fit, np.linalg.norm(test.left(fit.state), axis=1)


def _sheet(section, frame):
    """One row per end effector and pose of the data set's table, with the columns of ingest, positions in m."""
    trunk = [row for row in section["dh"] if "name" in row]
    for row in trunk:
        if "drives" in row:
            values = sum(by * frame[f"{drive}_rad"] for drive, by in row["drives"].items())
            frame = frame.assign(**{f"{row['name']}_rad": values})
    arms = [row for hand in END_EFFECTORS for row in section["hands"][hand] if "name" in row]
    drives, parts = [f"{row['name']}_rad" for row in (*trunk, *arms)], []
    for hand in END_EFFECTORS:
        poses = frame[["row", "held_out", *drives]].assign(trajectory="poses", target=hand)
        read = {f"measured_{axis}_mm": frame[f"{hand}_{axis}_m"] for axis in "xyz"}
        parts.append(poses.assign(**read))
    return pd.concat(parts).sort_values("row", kind="stable").reset_index(drop=True)


def _free(section):
    """The robot with drives instead of the joints that follow others."""
    trunk = [
        {"range_deg": [-180.0, 180.0]} | {key: value for key, value in row.items() if key != "drives"}
        if "drives" in row
        else row
        for row in section["dh"]
    ]
    return section | {"dh": trunk}


def _read(folder, follows):
    """The Torso, through a sheet and ingest."""
    section = robot_section(json.loads((_FOLDER / "chain.json").read_text()))
    frame = _sheet(section, pd.read_csv(_FOLDER / "measurements.csv"))
    file = folder / "torso.csv"
    frame.to_csv(file, index=False)
    bounds = {"angle_rad": 0.3, "length_mm": 100.0}
    nominal = {
        "name": "torso",
        "dimensions": section if follows else _free(section),
        "registered": True,
        "bounds": bounds,
    }
    spec = IngestSpec(str(file), unit="m", frame="register", extra_columns="ignore")
    table = ingest(spec, setup.mechanism(nominal)).measurements
    return Torso(nominal, table.assign(held_out=frame["held_out"].to_numpy()))


@pytest.fixture(scope="module")
def torso(tmp_path_factory):
    return _read(tmp_path_factory.mktemp("torso"), follows=True)


@pytest.fixture(scope="module")
def free_torso(tmp_path_factory):
    """The same with the passive joint described as a drive of its own."""
    return _read(tmp_path_factory.mktemp("torso"), follows=False)


@needs_data
def test_every_reading_is_a_row_and_none_is_lost(torso):
    assert len(torso.table) == 700 and (torso.table["status"] == "ok").all()
    assert len(torso.of(1)) == 210


@needs_data
@pytest.mark.parametrize(
    ("parameter_set", "effects", "reference_mm"),
    [
        ("frame", (), 20.98),
        ("zero", (), 18.19),
        ("full", (), 11.41),
        ("full", (_SPRINGS,), 5.05),
        ("full", (_SPRINGS, _BENDING), 3.90),
        ("full", (_SPRINGS, _BENDING, _CROSS), 2.97),
    ],
)
def test_no_model_is_worse_than_the_reference(torso, parameter_set, effects, reference_mm):
    """By more than 2 %; the last ones are far better, as the passive joint passes its load on to the drives."""
    _, off = torso.model(parameter_set, effects)
    assert off.mean() < 1.02 * reference_mm


@needs_data
def test_all_that_positions_tell_is_fitted(torso):
    """76 numbers at the nominal robot: 12 of frames and markers, and those of the joints."""
    assert len(torso.robot("frame").parameters) == 12
    fit, _ = torso.model("full")
    assert len(fit.estimate.values) == fit.estimate.rank == 76


@needs_data
def test_both_arms_have_the_same_springs(torso):
    fit, _ = torso.model("full", (_SPRINGS,))
    columns = [column.removesuffix("_rad") for column in torso.robot("zero").parts.columns]
    size = dict(
        zip(
            columns,
            zip(fit.state.effects[_SPRINGS, 0], fit.estimate.block_errors(_SPRINGS), strict=False),
            strict=False,
        )
    )
    for joint in (0, 1, 2, 3):
        (right, error), (left, other) = size[f"q_right{joint}"], size[f"q_left{joint}"]
        assert right > 3.0 * error and left > 2.0 * other
        assert abs(right - left) < 3.0 * np.hypot(error, other)


@needs_data
def test_a_passive_joint_described_as_a_drive_shows_its_rods_as_cross_compliance(free_torso):
    """The reference's own models: its residuals, no spring at the second joint, and what the third model finds."""
    for effects, reference_mm in (((_SPRINGS,), 5.05), ((_SPRINGS, _BENDING), 3.90)):
        fit, off = free_torso.model("full", effects)
        assert 0.95 * reference_mm < off.mean() < 1.02 * reference_mm
        assert abs(fit.state.effects[_SPRINGS, 0][2]) < 0.1e-6
    fit, off = free_torso.model("full", (_SPRINGS, _CROSS))
    assert off.mean() < 4.1
    robot = free_torso.robot("zero")
    own = dict(zip(robot.parts.columns, fit.state.effects[_SPRINGS, 0], strict=True))
    between = dict(zip(find(_CROSS, robot).parameters.names, fit.state.effects[_CROSS, 0], strict=True))
    for joint in ("q_torso1", "q_torso2"):
        pair = between[f"cross_{joint}_q_follows3"]
        assert pair < -0.15e-6 and abs(pair + own[f"{joint}_rad"]) < 0.1e-6
    assert abs(between["cross_q_torso1_q_torso2"]) < 0.05e-6


@needs_data
def test_the_diagnosis_names_compliance_and_predicts_the_held_out_rows(torso):
    robot = torso.robot("full")
    found = diagnose(torso.of(0), MeasuredRobot(robot, _NO_LOADS, None, "torso"), _SETTINGS)
    sure = found.tables["gap_attribute"].set_index("effect")["probability"]
    assert sure[_SPRINGS] >= 0.95 and sure[_BENDING] >= 0.95
    # the evidence of correlated non-negative coefficients gives 0.11, a product of independent ones gave 0.04
    assert sure[_CROSS] < 0.2 and _CROSS not in found.verdict["effects"]
    assert {_SPRINGS, _BENDING} <= set(found.verdict["effects"].split("+"))
    problem = found.inference.problem
    test = make_diagnosis_problem(torso.of(1), problem.mechanism, _NO_LOADS, problem.noise_mm, problem.library)
    before, after = (
        np.sqrt((test.left(state) ** 2).sum(axis=1).mean()) for state in (found.inference.calibrated, found.state)
    )
    assert np.linalg.norm(test.left(found.state), axis=1).mean() <= 3.0
    shrink = found.tables["gap_shrink"].query("kind == 'held_out' and trajectory == '*'")["rms_mm"].to_numpy()
    # shares of the mean square distance
    assert (shrink[-1] / shrink[0]) ** 2 == pytest.approx((after / before) ** 2, abs=0.05)


_CHAIN = {
    "base_to_torso": np.eye(4).tolist(),
    "torso": [{"d": 0.1, "theta0": 0.0, "a": 0.0, "alpha": 0.0}] * 3,
    "torso_q": ["q_torso0", "q_torso1", "-(q_torso0 + q_torso1)"],
    "torso_to_right": np.eye(4).tolist(),
    "torso_to_left": np.eye(4).tolist(),
    "right": [{"d": 0.2, "theta0": 0.5, "a": 0.3, "alpha": 1.0}] * 2,
    "left": [{"d": 0.2, "theta0": 0.5, "a": 0.3, "alpha": -1.0}] * 2,
    "wrist_to_hand": np.eye(4).tolist(),
    "torso_to_head": [[1.0, 0.0, 0.0, 0.2], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.1], [0.0, 0.0, 0.0, 1.0]],
    "head": [{"d": 0.1, "theta0": 0.0, "a": 0.0, "alpha": 0.0}],
    "masses": {
        "torso": [{"mass_kg": 4.0, "com_m": [0.0, 0.1, 0.0]}] * 3,
        **{hand: [{"mass_kg": 2.0, "com_m": [0.0, 0.0, 0.1]}] * 2 for hand in ("right", "left")},
        "hand": {"mass_kg": 1.0, "com_m": [0.0, 0.0, 0.0]},
        "head": {"mass_kg": 3.0, "com_m": [0.0, 0.05, 0.0]},
    },
}


def test_a_chain_becomes_rows_in_mm_and_degrees():
    section = robot_section(_CHAIN)
    base, first, _, third, head = section["dh"]
    assert base["xyz_mm"] == [0.0, 0.0, 0.0] and section["convention"] == "modified"
    assert first["name"] == "q_torso0" and first["d_mm"] == 100.0 and first["com_mm"] == [0.0, 100.0, 0.0]
    assert third["drives"] == {"q_torso0": -1.0, "q_torso1": -1.0}
    # the head's z is the torso's -y, and its y the torso's z
    np.testing.assert_allclose(head["com_mm"], [200.0, -100.0, 150.0], atol=1e-9)
    assert section["hands"]["left"][1]["alpha_deg"] == pytest.approx(-np.degrees(1.0))


def test_words_that_are_no_value_of_a_joint_are_refused():
    with pytest.raises(ConfigError, match=r"torso_q has 'q_torso0 \* 2'; allowed: a drive, or"):
        robot_section(_CHAIN | {"torso_q": ["q_torso0", "q_torso1", "q_torso0 * 2"]})
