"""The virtual robot: nominal controller in front, exact closure with its effects behind, a tracker beside."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from rrru.campaign.measurements import turn_columns, vector_columns
from rrru.effects.library import active_effects
from rrru.effects.motion import Course, make_motion
from rrru.effects.protocol import together
from rrru.errors import ConfigError
from rrru.plant.tracker import Sees, measure
from rrru.robots.dynamics import Masses
from rrru.robots.robot import Robot
from rrru.robots.rrru3 import Rrru3

_ONLY_TOOL = Sees()


@dataclass(frozen=True)
class VirtualRobot:
    """A robot whose truth is known: it drives plans and is measured.

    mechanism: the robot that its controller believes in; deviations: names of any of its parameters to true values;
    axis_deviations (sites, 6): displacements of its axes at the robot's sites, or 0; effects: those that act;
    non_repeatability_mm: radius of the ball in which the platform lies at random, see `non_repeatability`;
    rotation_limit_rad: a platform turned further than this from where the nominal one stands counts as unsolved.
    """

    mechanism: Robot = field(default_factory=Rrru3)
    deviations: dict = field(default_factory=dict)
    axis_deviations: np.ndarray | float = 0.0
    effects: tuple = ()
    non_repeatability_mm: float = 0.0
    masses: Masses = field(default_factory=Masses)
    rotation_limit_rad: float = 0.05

    def run(self, plan, noise_mm, generator, controller=None, sees=_ONLY_TOOL):
        """Drive a plan; returns (measurements, truth) as frames.

        controller: positions (n, 3) in the order driven to actuator values (n, 3), by default the nominal inverse
        kinematics; sees: what the tracker reads beside the tool's position. `measurements` fits the schema of that name
        with the commanded positions of the plan and the values that the controller sent, `truth` holds the exact
        position in the tracker's frame and the platform's rotation, both a row for every reflector at every point.
        Noise is drawn for every row, solved or not, so that one lost point does not change the others.
        """
        commands, target = plan.commands(self.mechanism), plan.targets()
        motion = self.motion(plan, controller or self.mechanism.inverse)
        poses, twists, turned = self._posed(motion, target)
        solved, row = poses.closed & (turned <= self.rotation_limit_rad), sees.rows(len(target))
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

    def motion(self, plan, controller):
        """What the effects may know about a plan driven through a controller; the nominal mechanism's loads."""
        path, index = plan.path()
        along = controller(path)
        course = Course(
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
        return make_motion(self.mechanism, self.masses, course)

    @cached_property
    def twists(self):
        """Twists (1, sites, 6) of its deviations and axes."""
        return self.mechanism.twists_of(self.deviations) + self.axis_deviations

    def positions(self, motion, target=None):
        """Platform centres (n, 3) in the tracker's frame and sizes (n,) of its rotation along a motion near targets.

        target (n, 3): the commanded positions by default. NaN where the legs do not close near the target or the
        platform would turn by more than the limit.
        """
        poses, twists, turned = self._posed(motion, motion.position_mm if target is None else target)
        solved = poses.closed & (turned <= self.rotation_limit_rad)
        return np.where(solved[:, None], self.mechanism.measured(poses, twists), np.nan), turned

    def _posed(self, motion, target):
        """Poses (n) near targets (n, 3), twists of all that is off, and sizes (n,) of the platform's rotation."""
        twists, near = self.twists + together(self.effects, motion).twists, self.mechanism.near(target, motion.drive)
        poses = self.mechanism.model.solve(motion.drive, near, twists)
        return poses, twists, np.linalg.norm(poses.turned_from(near.turn), axis=1)


def non_repeatability(generator, count):
    """Points (count, 3) uniform in the unit ball: what clearance does from stop to stop, bounded unlike noise."""
    direction = generator.standard_normal((count, 3))
    radius = generator.random((count, 1)) ** (1.0 / 3.0)
    return radius * direction / np.linalg.norm(direction, axis=1, keepdims=True)


def from_config(mechanism, section):
    """The virtual robot of one `virtual_robots:` entry; raises ConfigError naming the key."""
    known = mechanism.deviation_names
    for name in section["errors"]:
        if name not in known:
            raise ConfigError(f"virtual robot: unknown error {name!r}; known: {', '.join(known)}")
    return VirtualRobot(
        mechanism=mechanism,
        deviations={name: float(value) for name, value in section["errors"].items()},
        axis_deviations=_axis_deviations(mechanism, section["axis_errors"]) if "axis_errors" in section else 0.0,
        effects=active_effects(section["effects"], mechanism),
        non_repeatability_mm=section.get("wobble_mm", 0.0),
        masses=Masses(section["platform_mass_kg"], section["forearm_mass_kg"], section["arm_mass_kg"]),
        rotation_limit_rad=section.get("rotation_limit_rad", VirtualRobot.rotation_limit_rad),
    )


def _axis_deviations(mechanism, section):
    """Displacements (sites, 6): normal draws of the stated sizes from the stated seed at the seats of all axes."""
    numbers = mechanism.legs.site_numbers
    result = np.zeros((len(numbers), 6))
    draw = np.random.default_rng(section["seed"]).standard_normal((len(mechanism.seats), 6))
    result[[numbers[site] for site in mechanism.seats]] = draw * np.repeat(
        [section["position_mm"], section["angle_rad"]], 3
    )
    return result
