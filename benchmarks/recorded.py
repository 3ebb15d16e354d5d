"""Arms of `data/models/arm6.xml` simulated by MuJoCo, with every control recorded, for `benchmarks.sysid`.

All drives have zero offsets, and either one drive's servo is soft or one gear has backlash.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from rrru.pipeline import setup
from rrru.simulation import mujoco_model
from rrru.simulation.mujoco_robot import MujocoRobot
from rrru.simulation.mujoco_run import Machine

ROOT = Path(__file__).resolve().parents[1]
FILE, PLATFORM, NOISE_MM = ROOT / "data/models/arm6.xml", "tool0", 0.01
NOMINAL = {"name": "arm6", "dimensions": {"mjcf": str(FILE), "platform": PLATFORM}, "parameter_set": "zero"}
AXES = [f"axis{k}" for k in range(1, 7)]
# units of a drive's parameters: mrad, µrad/(N m), mrad
UNIT = {"zero": 1e-3, "soft_servo": 1e-9, "play": 1e-3}
PASSES = ({}, {"reverse": True}, {"trajectories": ["line_1", "spiral"], "payload_kg": 4.0})
# slow enough that inertia is negligible for the diagnosis, which uses the plan's times
_MOTION = {"speed_mm_s": 300.0, "acceleration_mm_s2": 10.0, "dwell_s": 60.0}
# rest before each sequence
_BEFORE_S = 0.1


@dataclass(frozen=True)
class Truth:
    """A robot: zeros (6,) in mrad, its cause, its drive, and its size in that cause's unit."""

    zeros: np.ndarray
    cause: str
    drive: str
    size: float

    @property
    def causes(self):
        """The causes as the plant's input."""
        if self.cause == "play":
            acting = {"play": {self.drive: UNIT["play"] * self.size}}
        else:
            acting = {"actuator_stiffness": {self.drive: 1.0 / (UNIT["soft_servo"] * self.size)}}
        return {"zero_offset": dict(zip(AXES, UNIT["zero"] * self.zeros, strict=True))} | acting


def draw(seed):
    """The Truth of a seed; even ones have a soft drive that carries weight, odd ones backlash in a large joint."""
    generator = np.random.default_rng(seed)
    zeros, even = 2.0 * generator.standard_normal(6), seed % 2 == 0
    drive = str(generator.choice(AXES[1:3] if even else AXES[:3]))
    low, high = (4.0, 12.0) if even else (0.15, 0.6)
    size = float(np.exp(generator.uniform(np.log(low), np.log(high))))
    return Truth(zeros, "soft_servo" if even else "play", drive, size)


@dataclass
class Recorded:
    """Controls (6,) of every step with one payload from rest on, and the steps of the readings.

    start: values of qpos by joint at rest.
    """

    payload_kg: float
    start_s: float
    start: dict
    controls: list = field(default_factory=list)
    read: list = field(default_factory=list)

    def rest(self, time_s, controls):
        """Fill up the steps until a time with controls that did not change."""
        steps = round((time_s - self.start_s + _BEFORE_S) / mujoco_model.STEP_S)
        self.controls += [controls] * (steps - len(self.controls))


class Recorder(Machine):
    """Records the controls of every step, from the first point on, and the times of readings."""

    sequences = ()

    def _recorded(self):
        """A new Recorded of the robot in its current state."""
        start = {name: self.data.joint(name).qpos.copy() for name in self.edit.home}
        return Recorded(self.payload_kg, self.data.time, start)

    def _now(self):
        """The current controls without the zero offsets, which the controller does not know."""
        return self.data.ctrl[self.actuators] - [self.edit.offsets.get(joint, 0.0) for joint in self.edit.servos]

    def _weigh(self, payload_kg):
        super()._weigh(payload_kg)
        self.payload_kg = payload_kg
        if self.sequences:
            self.sequences.append(self._recorded())

    def _closed(self, where):
        super()._closed(where)
        self.sequences = self.sequences or [self._recorded()]
        sequence = self.sequences[-1]
        sequence.rest(self.data.time, self._now())
        sequence.read.append(len(sequence.controls) - 2)

    def _send(self, controls):
        for row in controls:
            if self.sequences:
                self.sequences[-1].rest(self.data.time, self._now())
            super()._send(row[None])
            if self.sequences:
                self.sequences[-1].controls.append(self._now())


@dataclass(frozen=True)
class RecordedRobot(MujocoRobot):
    """A MujocoRobot that stores its Recorder."""

    recorders: list = field(default_factory=list)

    def machine(self, payload_kg=0.0):
        """The Recorder as the machine of a MujocoRobot."""
        made = super().machine(payload_kg)
        self.recorders[:] = [Recorder(made.edit, made.file)]
        return self.recorders[0]


def campaign(truth, seed, trajectories, passes, name):
    """Measurements of a Truth's robot, and the recorded controls."""
    virtual = {
        "name": name,
        "seed": seed,
        "robot": {"mujoco": {"causes": truth.causes}},
        "trajectories": trajectories,
        "passes": [{"reverse": False, "payload_kg": 0.0} | campaign_pass for campaign_pass in passes],
        "motion": _MOTION,
        "noise_mm": NOISE_MM,
    }
    driven = setup.virtual_campaign(NOMINAL, virtual)
    plant = driven.robot
    robot = RecordedRobot(plant.mechanism, plant.file, plant.platform, plant.causes)
    frame, _ = replace(driven, robot=robot).run()
    return frame, robot.recorders[0].sequences


def trajectories(x_mm, z_mm):
    """Two lines and a turn of a spiral about a place: short, because every fit simulates them a hundred times."""
    lines = {"start_mm": [x_mm - 90.0, 0.0, z_mm - 40.0], "end_mm": [x_mm + 90.0, 0.0, z_mm + 40.0]}
    spiral = {"centre_mm": [x_mm, 0.0], "radius_mm": [50.0, 90.0], "z_mm": [z_mm - 50.0, z_mm + 50.0]}
    return {
        "lines": lines | {"offsets_y_mm": [-60.0, 60.0], "points": 7},
        "spiral": spiral | {"turns": 1.0, "points": 9},
    }
