"""A virtual robot that MuJoCo simulates from its MJCF: a simulator independent of this package's effect models.

Its errors have causes that MuJoCo itself models, see `rrru.simulation.mujoco_causes`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.arrays import FloatArray
from rrru.campaign.plan import Plan
from rrru.effects.protocol import Motion
from rrru.errors import ConfigError
from rrru.kinematics.chain import Poses
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.robot import Robot
from rrru.simulation import mujoco_model
from rrru.simulation.driven import ONLY_TOOL, SETTLE_S, Controller, DrivenRobot
from rrru.simulation.mujoco_causes import MOVING, apply
from rrru.simulation.mujoco_run import Machine
from rrru.simulation.tracker import Sees


@dataclass(frozen=True)
class MujocoRobot(DrivenRobot):
    """A robot whose true poses are a simulation of the MJCF that its mechanism was read from.

    file, platform: path of the MJCF and its platform's body.
    causes: {name of a cause: {site: size}}, see `rrru.simulation.mujoco_causes`.
    non_repeatability_mm, rotation_limit_rad: as of DrivenRobot.
    masses: none, as masses and inertias are the file's.
    """

    mechanism: Robot
    file: Path
    platform: str
    causes: dict[str, dict[str, float]] = field(default_factory=dict)
    non_repeatability_mm: float = 0.0
    masses: Masses = field(default_factory=lambda: Masses(0.0, 0.0, 0.0))
    rotation_limit_rad: float = 0.05

    def machine(self, payload_kg: float = 0.0) -> Machine:
        """The Machine of the file with its causes; payload_kg: the largest payload that it will carry.

        Raises ConfigError where a cause or a drive does not fit the file.
        """
        drives = [column.rpartition("_")[0] for column in self.mechanism.parts.columns]
        edit = mujoco_model.read(self.file, self.platform, self.mechanism.tool_mm, drives)
        edit.payload_kg = float(payload_kg)
        apply(edit, self.causes)
        turn = Rotation.from_rotvec(edit.tilt).inv()
        edit.spec.option.gravity = turn.apply(_gravity(edit.nominal.opt.gravity, self.mechanism.up))
        return Machine(edit, self.file)

    @property
    def measured_in_motion(self) -> bool:
        """Whether it is measured in motion; else it rests at every point."""
        return not set(MOVING).isdisjoint(self.causes)

    def run(
        self,
        plan: Plan,
        noise_mm: float,
        generator: np.random.Generator,
        controller: Controller | None = None,
        sees: Sees = ONLY_TOOL,
    ) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Drive a plan, see DrivenRobot; a robot that rests at every point takes SETTLE_S longer at each."""
        driven = plan if self.measured_in_motion else plan.resting(SETTLE_S)
        return super().run(driven, noise_mm, generator, controller, sees)

    def posed(self, motion: Motion, target: FloatArray) -> tuple[Poses, FloatArray]:
        """Poses (n) along a Motion as simulated, with no twists; see Machine.drive for the errors raised."""
        payload = np.nan_to_num(motion.payload_kg)
        position, turn = self.machine(payload.max(initial=0.0)).drive(motion, self.measured_in_motion)
        count, legs = len(position), self.mechanism.legs
        passive = np.broadcast_to(legs.home_passive, (count, len(legs.passive_joints)))
        poses = Poses(position, turn, passive, np.zeros(count), np.ones(count, dtype=bool))
        return poses, np.zeros((count, len(legs.sites), 6))


def from_config(mechanism: Robot, dimensions: Mapping[str, Any], section: Mapping[str, Any]) -> MujocoRobot:
    """The robot of a `virtual_robots:` entry with `mujoco`, of a mechanism that a `robots:` entry with `mjcf` made.

    Raises ConfigError where the entry has effects of this package's models, or the mechanism is from no MJCF.
    """
    if "mjcf" not in dimensions:
        raise ConfigError(
            f"virtual robot: mujoco drives {mechanism.name}, which has no mjcf; allowed: a robot with one"
        )
    present = [key for key in ("errors", "effects") if section.get(key)]
    present += ["axis_errors"] * any(section.get("axis_errors", {}).get(key) for key in ("position_mm", "angle_rad"))
    if present:
        text = f"mujoco and {present[0]} in one entry; allowed: one of them, mujoco has causes"
        raise ConfigError(f"virtual robot: {text}")
    robot = MujocoRobot(
        mechanism,
        Path(dimensions["mjcf"]),
        dimensions["platform"],
        section["mujoco"].get("causes", {}),
        section.get("wobble_mm", 0.0),
        rotation_limit_rad=section.get("rotation_limit_rad", MujocoRobot.rotation_limit_rad),
    )
    # raises ConfigError where the causes do not fit the file
    robot.machine()
    return robot


def _gravity(file_gravity: FloatArray, up: Sequence[float]) -> FloatArray:
    """A file's gravity (3,) in m/s^2, opposite to `up`, which the robot's entry may state otherwise than the file."""
    against = -np.linalg.norm(file_gravity) * np.asarray(up)
    return file_gravity if np.allclose(file_gravity, against) else against
