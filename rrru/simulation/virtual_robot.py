"""The virtual robot: a nominal controller, and a plant of exact loop closure with effects."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from rrru.arrays import FloatArray
from rrru.campaign.plan import Plan
from rrru.effects.library import active_effects
from rrru.effects.motion import make_motion, standing
from rrru.effects.protocol import ActiveEffect, Motion, bears_load, together
from rrru.errors import ConfigError
from rrru.kinematics.chain import Poses
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.robot import Robot
from rrru.robots.rrru3 import Rrru3
from rrru.simulation.driven import Controller, DrivenRobot

# fixed-point iterations between loads and the deflected pose: enough for a deflection of a millimetre
_DEFLECTION_ITERATIONS = 3


@dataclass(frozen=True)
class VirtualRobot(DrivenRobot):
    """A robot with known ground truth: it drives plans and is measured.

    mechanism: the nominal robot of its controller; deviations: names of any of its parameters to true values;
    axis_deviations (sites, 6): displacements of its axes at the robot's sites, or 0; effects: those that act;
    non_repeatability_mm: radius of the ball in which the platform's position is random, see `non_repeatability`;
    rotation_limit_rad: a platform turned further than this from the nominal one counts as unsolved.
    """

    mechanism: Robot = field(default_factory=Rrru3)
    deviations: dict[str, float] = field(default_factory=dict)
    axis_deviations: FloatArray | float = 0.0
    effects: tuple[ActiveEffect, ...] = ()
    non_repeatability_mm: float = 0.0
    masses: Masses = field(default_factory=Masses)
    rotation_limit_rad: float = 0.05

    @cached_property
    def twists(self) -> FloatArray:
        """Twists (1, sites, 6) of its deviations and axes."""
        return self.mechanism.twists_of(self.deviations) + self.axis_deviations

    def motion(self, plan: Plan, controller: Controller) -> Motion:
        """The Motion of a plan, input of the effects; the loads are those at the true pose, with errors and deflection.

        For a platform that cannot rotate they are those at the commanded positions: a millimetre changes them by less
        than a percent. For other platforms it changes them by several percent.
        """
        course = self.course(plan, controller)
        motion, sent = make_motion(self.mechanism, self.masses, course), (course.drive, course.position_mm)
        if self.mechanism.orients and any(bears_load(active.effect) for active in self.effects):
            for _ in range(_DEFLECTION_ITERATIONS):
                at = standing(self.mechanism, sent, self.posed(motion, course.position_mm))
                motion = make_motion(self.mechanism, self.masses, course, at)
        return motion

    def posed(self, motion: Motion, target: FloatArray) -> tuple[Poses, FloatArray]:
        """Poses (n) near targets (n, 3), and twists (n, sites, 6) of all errors."""
        twists, near = self.twists + together(self.effects, motion).twists, self.mechanism.near(target, motion.drive)
        return self.mechanism.model.solve(motion.drive, near, twists), twists


def from_config(mechanism: Robot, section: Mapping[str, Any]) -> VirtualRobot:
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


def _axis_deviations(mechanism: Robot, section: Mapping[str, Any]) -> FloatArray:
    """Displacements (sites, 6): normal draws of the stated sizes from the stated seed at the seats of all axes."""
    numbers = mechanism.legs.site_numbers
    result = np.zeros((len(numbers), 6))
    draw = np.random.default_rng(section["seed"]).standard_normal((len(mechanism.seats), 6))
    result[[numbers[site] for site in mechanism.seats]] = draw * np.repeat(
        [section["position_mm"], section["angle_rad"]], 3
    )
    return result
