"""A pedestal that deflects under the robot's weight: the moment on it, its twist, and reflectors that are on it."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.campaign.ingest.campaign_file import IngestSpec, ingest
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.settings import GapSettings
from rrru.effects.library import find
from rrru.effects.motion import Course, make_motion
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.legs import WORLD
from rrru.kinematics.point_masses import places
from rrru.robots.serial import serial

_QUARTER = 0.5 * np.pi
ARM = serial(
    [
        {"d": 300.0, "alpha": -_QUARTER, "mass_kg": 4.0},
        {"a": 280.0, "theta": -_QUARTER, "mass_kg": 5.0, "com_mm": (-140.0, 0.0, 0.0)},
        {"a": 70.0, "alpha": -_QUARTER, "mass_kg": 3.0},
        {"d": 300.0, "alpha": _QUARTER, "mass_kg": 2.0},
        {"alpha": -_QUARTER, "mass_kg": 0.5},
        {"d": 80.0, "mass_kg": 1.0},
    ],
    np.tile([-1.2, 1.2], (6, 1)),
    np.array([0.0, 0.1, 0.2, 0.0, 0.5, 0.0]),
    parameter_set="full",
)
_NOTHING = Masses(0.0, 0.0, 0.0)
_VALUES = {"tilt_x": 2e-9, "tilt_y": 1.5e-9, "shift_x": 8e-7, "shift_y": 1e-6}
_TOOL = {"a": (60.0, 10.0, 90.0), "b": (-50.0, 40.0, 120.0), "c": (0.0, -70.0, 60.0)}
_TABLE = {"t1": (400.0, -300.0, 20.0), "t2": (-200.0, -400.0, 20.0), "t3": (300.0, 350.0, 20.0)}


def _motion(robot, driven, payload_kg=0.0):
    position, still = robot.forward(driven), np.zeros((len(driven), 3))
    index, none, rest = np.arange(len(driven)), np.full(len(driven), np.nan), np.zeros_like(driven)
    course = Course(position, driven, driven, index, none, still, still, none * 0.0 + payload_kg, (rest, rest))
    return make_motion(robot, _NOTHING, replace(course, payload_kg=np.full(len(driven), payload_kg)))


def _driven(count=60):
    low, high = ARM.drive_range.T
    return low + (high - low) * np.random.default_rng(2).random((count, 6))


def test_the_base_bears_the_weight_of_links_and_payload_about_the_origin():
    driven = _driven(5)
    at = places(ARM, driven, ARM.solve(driven, ARM.forward(driven)))
    mass = np.array([point_mass.mass_kg for point_mass in ARM.point_masses])
    weight = mass[:, None] * [0.0, 0.0, -9.80665]
    expected = np.cross(at, weight).sum(axis=1) + np.cross(ARM.forward(driven), [0.0, 0.0, -3.0 * 9.80665])
    np.testing.assert_allclose(_motion(ARM, driven, 3.0).base_moment, expected, rtol=1e-6, atol=1e-3)


def test_it_turns_the_world_about_level_axes_and_shifts_it_as_a_turn_further_down_does():
    motion, effect = _motion(ARM, _driven()), find("pedestal_compliance", ARM)
    twists = effect.contribute(motion, effect.parameters.vector(_VALUES)).twists
    x, y, _ = motion.base_moment.T
    expected = np.stack([1e-6 * y, -8e-7 * x, 0.0 * x, 2e-9 * x, 1.5e-9 * y, 0.0 * x], axis=1)
    np.testing.assert_allclose(twists[:, ARM.legs.site_numbers[WORLD]], expected, rtol=1e-9, atol=1e-15)
    on_wall = replace(ARM, up=(1.0, 0.0, 0.0))
    assert find("pedestal_compliance", on_wall).parameters.names == ("tilt_y", "tilt_z", "shift_y", "shift_z")


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """What ingest makes of a file with reflectors on tool and table, one of which the tracker once took for another."""
    generator, driven = np.random.default_rng(4), _driven(100)
    effect, motion = find("pedestal_compliance", ARM), _motion(ARM, driven)
    twists = effect.contribute(motion, effect.parameters.vector(_VALUES)).twists
    poses = ARM.solve(driven, motion.position_mm)
    frame, shift, parts = Rotation.random(random_state=generator), np.array([2000.0, 300.0, -500.0]), []
    for number, (name, place) in enumerate({**_TOOL, **_TABLE}.items()):
        at = np.tile(np.array(place), (len(driven), 1)) if name in _TABLE else poses.point(np.array(place))
        world = twists[:, 0]
        seen = frame.apply(Rotation.from_rotvec(world[:, 3:]).apply(at) + world[:, :3]) + shift
        columns = dict(zip(ARM.parts.columns, driven.T, strict=True)) | rows.vector_columns(
            "measured", seen + 0.01 * generator.standard_normal(seen.shape)
        )
        parts.append(
            pd.DataFrame({"trajectory": "poses", "target": name, "order": np.arange(100) * 9 + number, **columns})
        )
    table = pd.concat(parts).sort_values("order").drop(columns="order").reset_index(drop=True)
    measured = [f"measured_{axis}_mm" for axis in "xyz"]
    table.loc[6 * 30 + 4, measured] = table.loc[6 * 30 + 3, measured].to_numpy(dtype=float) + 0.01
    path = tmp_path_factory.mktemp("pedestal") / "mine.csv"
    table.to_csv(path, index=False)
    return ingest(IngestSpec(str(path), frame="register", world_targets=tuple(_TABLE)), ARM)


def test_reflectors_beside_the_robot_are_found_and_one_taken_for_another_is_named(found):
    table = found.measurements
    assert (table["target_on"] == np.where(table["target"].isin([*_TABLE]), "world", "platform")).all()
    assert table.loc[table["status"] == "outlier", "point"].tolist() == [185]
    assert "row 186: t2 lies 608 mm away, where t1 is" in found.notes
    places = table.groupby("target")[["target_x_mm", "target_y_mm", "target_z_mm"]].first()
    off = [places.loc[name] - places.loc["t1"] - np.subtract(_TABLE[name], _TABLE["t1"]) for name in _TABLE]
    assert np.abs(off).max() < 0.1
    assert len(rows.at_tool(table, ARM)) == 300


def test_the_diagnosis_names_the_pedestal(found):
    table = found.measurements
    robot = ARM.with_measurement_config(rows.measurement_config(table, (), True))
    used = table[rows.usable(table)]
    robot = robot.with_identifiable_parameters(rows.actuators(used, robot), rows.command(used), rows.readings(used))
    names = ("drive_compliance", "encoder_eccentricity", "pedestal_compliance")
    result = diagnose(table, MeasuredRobot(robot, _NOTHING, 0.01), GapSettings(names, draws=10), details=False)
    assert result.verdict["effects"] == "pedestal_compliance" and result.verdict["where"] == "world"
    (values,) = result.state.effects.values()
    np.testing.assert_allclose(values, [*_VALUES.values()], rtol=0.15)
