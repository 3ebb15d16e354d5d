"""Interface of every plant: a nominal controller, the robot that it drives, and a tracker."""

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
import pandas as pd

from rrru.arrays import BoolArray, FloatArray
from rrru.campaign.measurements import turn_columns, vector_columns
from rrru.campaign.plan import Plan
from rrru.effects.motion import Course, make_motion
from rrru.effects.protocol import Motion
from rrru.kinematics.chain import Poses
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.robot import Robot
from rrru.simulation.tracker import Sees, measure

# positions (n, 3) in the order driven to actuator values (n, K)
Controller = Callable[[FloatArray], FloatArray]
# ASSUME a robot that is read at rest waits so long at every point
SETTLE_S = 5.0
ONLY_TOOL = Sees()


class DrivenRobot(ABC):
    """A robot with known ground truth: it drives plans and is measured.

    mechanism: the nominal robot of its controller, masses: of the nominal robot; non_repeatability_mm: radius of the
    ball in which the platform's position is random, see `non_repeatability`; rotation_limit_rad: a platform turned
    further than this from the nominal one counts as unsolved.
    """

    mechanism: Robot
    masses: Masses
    non_repeatability_mm: float
    rotation_limit_rad: float

    @abstractmethod
    def posed(self, motion: Motion, target: FloatArray) -> tuple[Poses, FloatArray]:
        """Poses (n) near targets (n, 3) along a Motion, and twists (n or 1, sites, 6) of all their errors."""

    def run(
        self,
        plan: Plan,
        noise_mm: float,
        generator: np.random.Generator,
        controller: Controller | None = None,
        sees: Sees = ONLY_TOOL,
    ) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Drive a plan; returns (measurements, truth) as frames.

        controller: positions (n, 3) in the order driven to actuator values (n, 3), by default the nominal inverse
        kinematics; sees: what the tracker reads besides the tool's position. `measurements` fits the schema of that
        name with the commanded positions of the plan and the values that the controller sent, `truth` has the exact
        position in the tracker's frame and the platform's rotation, both a row for every reflector at every point.
        Noise is drawn for every row, solved or not, so that one lost point does not change the others.
        """
        commands, target = plan.commands(self.mechanism), plan.targets()
        motion = self.motion(plan, controller or self.mechanism.inverse)
        poses, twists, turned, solved = self._where(motion, target)
        row = sees.rows(len(target))
        lost = non_repeatability(generator, len(target))[row]
        position = np.where(solved[row, None], sees.positions(self.mechanism, poses, twists), np.nan)
        position = position + self.non_repeatability_mm * lost
        measurements = commands.assign(**dict(zip(self.mechanism.parts.columns, motion.drive.T, strict=True)))
        if not sees.only_tool:
            near = self.mechanism.near(target, motion.drive)
            measurements = measurements.assign(**turn_columns("command", near.turn)).iloc[row].reset_index(drop=True)
            measurements["point"] = measurements.groupby("run").cumcount() + 1
        truth = measurements[["run", "trajectory", "point"]]
        measurements = measurements.assign(
            **vector_columns("measured", measure(position, noise_mm, generator)),
            **sees.columns(self.mechanism, poses, twists, generator),
            status=np.where(solved[row], "ok", "unsolved"),
        )
        return measurements, truth.assign(**vector_columns("true", position), platform_rotation_rad=turned[row])

    def motion(self, plan: Plan, controller: Controller) -> Motion:
        """The Motion, input of the effects, of a plan driven through a controller; the nominal mechanism's loads."""
        return make_motion(self.mechanism, self.masses, self.course(plan, controller))

    def course(self, plan: Plan, controller: Controller) -> Course:
        """The Course of a plan driven through a controller."""
        path, index = plan.path()
        along = controller(path)
        return Course(
            position_mm=plan.targets(),
            drive=along[index],
            path_drive=along,
            path_index=index,
            time_s=plan.time_s(),
            velocity_mm_s=np.concatenate([run.velocity_mm_s for run in plan.runs]),
            acceleration_mm_s2=np.concatenate([run.acceleration_mm_s2 for run in plan.runs]),
            payload_kg=np.concatenate([np.full(len(run.points_mm), run.payload_kg) for run in plan.runs]),
            stops=not any(run.velocity_mm_s.any() for run in plan.runs),
        )

    def positions(self, motion: Motion, target: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """Platform centres (n, 3) in the tracker's frame and sizes (n,) of its rotation along a motion near targets.

        target (n, 3): the commanded positions by default. NaN where the legs do not close near the target or the
        platform would turn by more than the limit.
        """
        poses, twists, turned, solved = self._where(motion, motion.position_mm if target is None else target)
        return np.where(solved[:, None], self.mechanism.measured(poses, twists), np.nan), turned

    def _where(self, motion: Motion, target: FloatArray) -> tuple[Poses, FloatArray, FloatArray, BoolArray]:
        """The result of `posed`, sizes (n,) of the platform's rotation, and which poses (n,) count as solved."""
        poses, twists = self.posed(motion, target)
        turned = np.linalg.norm(poses.turned_from(self.mechanism.near(target, motion.drive).turn), axis=1)
        return poses, twists, turned, poses.closed & (turned <= self.rotation_limit_rad)


def non_repeatability(generator: np.random.Generator, count: int) -> FloatArray:
    """Points (count, 3) uniform in the unit ball: an error by clearance from stop to stop, bounded unlike noise."""
    direction = generator.standard_normal((count, 3))
    radius = generator.random((count, 1)) ** (1.0 / 3.0)
    return np.asarray(radius * direction / np.linalg.norm(direction, axis=1, keepdims=True))
