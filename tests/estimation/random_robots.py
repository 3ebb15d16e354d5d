"""Random arms, hexapods, lifting columns and gantries whose frame and targets are unknown, with their true errors.

What is measured comes from the robot under true errors of all its geometric parameters, not of those alone that the
readings can determine. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.kinematics.base_parameters import MeasurementConfig, candidates_of
from rrru.kinematics.legs import TOOL, WORLD
from rrru.kinematics.readings import Readings, orientation, points_read
from rrru.robots.from_dh import from_dh
from rrru.robots.hexapod import hexapod

NOISE_MM, NOISE_RAD = 0.03, 1e-4
KINDS = ("arm", "column", "gantry", "hexapod")
_FRAME_MM, _TARGET_MM = 2000.0, 300.0
# standard deviations of the true errors: lengths, angles, drive zeros
_LENGTH_MM, _ANGLE_RAD, _ZERO = 0.5, 2e-3, {"mm": 1.0, "rad": 5e-3}
_POSES, _TARGETS, _SHARE_TURNED = (60, 140), 3, 0.2
_SIX_AXES = ((-90, 0), (0, 1), (-90, 0), (90, 1), (-90, 0), (0, 1))
_SEVEN_AXES = ((-90, 1), (90, 0), (90, 1), (-90, 0), (-90, 1), (90, 0), (0, 1))
_THREE_AXES = ((90, 0), (0, 1), (0, 1), (90, 1), (-90, 1), (0, 1))


@dataclass(frozen=True)
class RandomCampaign:
    """A robot of unknown frame and targets, what was read of it, and the truth.

    actuators (n, K) and position_mm (n, 3): of every reading, nominal; targets (n,): what was read; measured_mm (n, 3)
    and turn (n, 3, 3), None where none was read, in the instrument's frame; errors: true errors by name; frame (6,):
    twist from the robot's frame to the instrument's; places: true places (3,) on the platform by target.
    """

    kind: str
    robot: object
    actuators: np.ndarray
    position_mm: np.ndarray
    targets: np.ndarray
    measured_mm: np.ndarray
    turn: np.ndarray | None
    errors: dict
    frame: np.ndarray
    places: dict

    @property
    def sheet(self):
        """Table (n) as an instrument's file has it."""
        drives = dict(zip(self.robot.parts.columns, self.actuators.T, strict=True))
        frame = pd.DataFrame({"trajectory": "poses", "target": self.targets} | drives)
        frame = frame.assign(**rows.vector_columns("measured", self.measured_mm))
        return frame if self.turn is None else frame.assign(**rows.turn_columns("measured", self.turn))


def draw_campaign(kind, seed, roughness=1.0, spread=1.0):
    """The RandomCampaign of a kind of robot, one of KINDS, and a seed.

    roughness: factor of all true errors; spread: share of the poses' distances from their middle, so that small ones
    determine the geometry, and what turns alone determines, badly.
    """
    draw = np.random.default_rng([KINDS.index(kind), seed])
    count = int(draw.integers(*_POSES))
    robot, actuators = _ROBOTS[kind](draw, count)
    actuators = actuators.mean(axis=0) + spread * (actuators - actuators.mean(axis=0))
    position = robot.forward(actuators)
    actuators, position = (part[np.isfinite(position).all(axis=1)] for part in (actuators, position))
    names = [f"target{k}" for k in range(1, 1 + draw.integers(1, _TARGETS + 1))]
    places = {name: _direction(draw) * draw.uniform(0.0, _TARGET_MM) for name in names}
    frame = np.concatenate([_direction(draw) * draw.uniform(0.0, _FRAME_MM), Rotation.random(rng=draw).as_rotvec()])
    targets, number = np.tile(names, len(actuators)), np.repeat(np.arange(len(actuators)), len(names))
    errors = {name: roughness * value for name, value in _errors(robot, draw).items()}
    real = robot.with_measurement_config(MeasurementConfig(tuple(rows.sites(pd.Series(names))), frame=True))
    twists = real.twists_of(errors)
    twists[0, real.legs.site_numbers[WORLD]] = frame
    poses = real.solve(actuators[number], position[number], twists)
    place = np.array([places[name] for name in targets])
    seen = Readings(place, rows.sites(pd.Series(targets)).to_numpy(), place)
    in_robot = points_read(real, poses, twists, seen)
    turning = Rotation.from_rotvec(frame[3:])
    measured = turning.apply(in_robot) + frame[:3] + draw.normal(0.0, NOISE_MM, in_robot.shape)
    turn = None
    if draw.random() < _SHARE_TURNED:
        tool = Rotation.random(rng=draw).as_matrix()
        scatter = Rotation.from_rotvec(draw.normal(0.0, NOISE_RAD, in_robot.shape)).as_matrix()
        turn = scatter @ orientation(real, poses, twists) @ tool
    known = np.isfinite(measured).all(axis=1)
    turn = turn if turn is None else turn[known]
    nominal = actuators[number][known], position[number][known], targets[known]
    return RandomCampaign(kind, robot, *nominal, measured[known], turn, errors, frame, places)


def _direction(draw):
    """A random unit vector (3,)."""
    return Rotation.random(rng=draw).as_matrix()[0]


def _errors(robot, draw):
    """True errors by name of all geometric parameters within the robot."""
    result = {}
    for one in candidates_of(robot.legs, robot.parts):
        if not {WORLD, TOOL} & set(one.twists):
            size = _ZERO[one.unit] if one.leg else {"mm": _LENGTH_MM, "rad": _ANGLE_RAD}[one.unit]
            result[one.name] = size * draw.standard_normal()
    return result


def _links(draw, axes, length_mm):
    """DH rows of revolute joints: (twist in degrees, whether the link is long) of each."""
    result = []
    for twist, is_long in axes:
        d, a = draw.uniform(0.0, length_mm, 2) if is_long else draw.uniform(0.0, 0.2 * length_mm, 2)
        lengths = {"d_mm": d} if draw.random() < 0.5 else {"d_mm": d, "a_mm": a}
        width = draw.uniform(90.0, 170.0)
        result.append(
            {"alpha_deg": twist, **lengths, "range_deg": [-width, width], "theta_deg": 90.0 * draw.integers(4)}
        )
    return result


def _of_rows(draw, count, dh, name):
    """Robot of DH rows and actuator values (n, K) all over a part of its range."""
    robot = from_dh(dh, name=name, parameter_set="full")
    low, high = robot.drive_range.T
    share = draw.uniform(0.4, 0.9)
    middle, half = 0.5 * (low + high), 0.5 * share * (high - low)
    return robot, middle + half * draw.uniform(-1.0, 1.0, (count, len(low)))


def _arm(draw, count):
    """An arm of six or seven axes."""
    axes = (_SIX_AXES, _SEVEN_AXES, _THREE_AXES)[draw.integers(3)]
    return _of_rows(draw, count, _links(draw, axes, draw.uniform(200.0, 900.0)), "arm")


def _column(draw, count):
    """A slide of up to two metres that lifts an arm of six axes."""
    stroke = draw.uniform(500.0, 2000.0)
    slide = {"sliding": True, "range_mm": [0.0, stroke], "alpha_deg": draw.choice([0.0, 90.0]), "a_mm": 200.0}
    axes = (_SIX_AXES, _THREE_AXES)[draw.integers(2)]
    return _of_rows(draw, count, [slide, *_links(draw, axes, draw.uniform(200.0, 700.0))], "column")


def _gantry(draw, count):
    """Three slides that carry a wrist of none to three axes."""
    lengths = draw.uniform(300.0, 2000.0, 3)
    slides = [
        {"rpy_deg": [0, 90, 0]},
        {"sliding": True, "alpha_deg": -90, "range_mm": [0, lengths[0]]},
        {"sliding": True, "theta_deg": -90, "alpha_deg": -90, "range_mm": [0, lengths[1]]},
        {"sliding": True, "range_mm": [0, lengths[2]]},
    ]
    wrist = ((-90, 0), (90, 0), (0, 1))[: draw.integers(4)]
    return _of_rows(draw, count, [*slides, *_links(draw, wrist, 200.0)], "gantry")


def _hexapod(draw, count):
    """A hexapod."""
    base_mm, plate_mm, height_mm = draw.uniform(200.0, 700.0), draw.uniform(100.0, 300.0), draw.uniform(350.0, 900.0)
    pair = np.radians(draw.uniform(5.0, 25.0))
    base = np.radians([30.0, 30.0, 150.0, 150.0, 270.0, 270.0]) + pair * np.tile([-1.0, 1.0], 3)
    plate = np.radians([-30.0, 90.0, 90.0, 210.0, 210.0, 330.0]) + pair * np.tile([1.0, -1.0], 3)
    circle = [
        size * np.stack([np.cos(at), np.sin(at), 0.0 * at], 1) for size, at in ((base_mm, base), (plate_mm, plate))
    ]
    robot = hexapod(*circle, height_mm, stroke_mm=0.4 * height_mm, parameter_set="full")
    position = robot.legs.home_mm + 0.15 * height_mm * draw.uniform(-1.0, 1.0, (count, 3))
    turn = Rotation.from_rotvec(draw.uniform(-1.0, 1.0, (count, 3)) * draw.uniform(0.05, 0.3)).as_matrix()
    actuators = robot.inverse(position, turn=turn)
    return robot, actuators[np.isfinite(actuators).all(axis=1)]


_ROBOTS = {"arm": _arm, "column": _column, "gantry": _gantry, "hexapod": _hexapod}
