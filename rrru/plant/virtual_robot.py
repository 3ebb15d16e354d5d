"""The virtual robot: nominal controller in front, full spatial closure with its effects behind, a tracker beside."""

from dataclasses import dataclass, field

import numpy as np

from rrru.campaign.measurements import actuator_columns, vector_columns
from rrru.effects.library import active_effects
from rrru.effects.motion import Course, make_motion
from rrru.effects.protocol import PLACES, together
from rrru.errors import ConfigError
from rrru.plant.spatial import SpatialGeometry
from rrru.plant.tracker import measure
from rrru.robots.dynamics import Masses
from rrru.robots.rrru3 import Rrru3


class DrivenRobot:
    """What virtual robots share: they drive plans and are measured.

    They add mechanism, deviations (names of the mechanism's parameters to true values), active effects, masses and
    `positions`; non_repeatability_mm: radius of the ball in which the platform lies at random, see `non_repeatability`.
    """

    def run(self, plan, noise_mm, generator, controller=None):
        """Drive a plan; returns (measurements, truth) as frames.

        controller: positions (n, 3) in the order driven to actuator values (n, 3), by default the nominal inverse
        kinematics. `measurements` fits the schema of that name with the commanded positions of the plan and the values
        that the controller sent; `truth` holds the exact position in the tracker's frame and the platform's rotation.
        Noise is drawn for every row, solved or not, so that one lost point does not change the others.
        """
        commands, target = plan.commands(self.mechanism), plan.targets()
        motion = self.motion(plan, controller or self.mechanism.inverse)
        position, turned = self.positions(motion, target)
        solved = np.isfinite(position).all(axis=1)
        position = position + self.non_repeatability_mm * non_repeatability(generator, len(target))
        measurements = commands.assign(
            **dict(zip(actuator_columns(self.mechanism.drive_unit), motion.drive.T, strict=True)),
            **vector_columns("measured", measure(position, noise_mm, generator)),
            status=np.where(solved, "ok", "unsolved"),
        )
        truth = commands[["run", "trajectory", "point"]]
        return measurements, truth.assign(**vector_columns("true", position), platform_rotation_rad=turned)

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
        )
        return make_motion(self.mechanism, self.masses, course)


@dataclass(frozen=True)
class VirtualRobot(DrivenRobot):
    """A 3-RRRU whose truth is known.

    deviations: of the published parameters or the tied ones; axis_deviations (3 legs, 6 places, 6): displacements of
    every axis; rotation_limit_rad: a larger platform rotation counts as unsolved.
    """

    mechanism: Rrru3 = field(default_factory=Rrru3)
    deviations: dict = field(default_factory=dict)
    axis_deviations: np.ndarray = field(default_factory=lambda: np.zeros((3, len(PLACES), 6)))
    effects: tuple = ()
    non_repeatability_mm: float = 0.0
    masses: Masses = field(default_factory=Masses)
    rotation_limit_rad: float = 0.05

    @property
    def geometry(self):
        """The chains' lengths and displacements."""
        lengths = np.tile(self.mechanism.lengths_mm, (3, 1))
        lengths[:, 1:4] += self.mechanism.leg_changes(self.deviations)[:, 1:4]
        lengths[:, [0, 4]] += [self.deviations.get("dR", 0.0), self.deviations.get("dr", 0.0)]
        return SpatialGeometry(np.array(self.mechanism.azimuth_rad), lengths, self.axis_deviations)

    def positions(self, motion, target):
        """Platform centres (n, 3) in the tracker's frame and sizes (n,) of its rotation along a motion near targets.

        NaN where the chains do not close near the target or the platform would turn by more than the limit.
        """
        change = together(self.effects, motion)
        passive = self.mechanism.passive_angles(target, self.mechanism.inverse(target))
        drive = motion.drive + self.mechanism.leg_changes(self.deviations)[:, 0]
        solution = self.geometry.solve_under(drive, passive, change)
        turned = np.linalg.norm(solution.rotation_rad, axis=1)
        solved = solution.converged & (turned <= self.rotation_limit_rad)
        return np.where(solved[:, None], solution.position_mm, np.nan), turned


def non_repeatability(generator, count):
    """Points (count, 3) uniform in the unit ball: what clearance does from stop to stop, bounded unlike noise."""
    direction = generator.standard_normal((count, 3))
    radius = generator.random((count, 1)) ** (1.0 / 3.0)
    return radius * direction / np.linalg.norm(direction, axis=1, keepdims=True)


def from_config(mechanism, section):
    """The virtual robot of one `virtual_robots:` entry; raises ConfigError naming the key."""
    known = tuple(dict.fromkeys((*Rrru3.PARAMETER_NAMES["tied"], *Rrru3.PARAMETER_NAMES["published"])))
    for name in section["errors"]:
        if name not in known:
            raise ConfigError(f"virtual robot: unknown error {name!r}; known: {', '.join(known)}")
    return VirtualRobot(
        axis_deviations=_axis_deviations(section["axis_errors"]),
        rotation_limit_rad=section["rotation_limit_rad"],
        **shared_parts(mechanism, section),
    )


def shared_parts(mechanism, section):
    """What an entry of `virtual_robots:` says of any robot, as the fields that all virtual robots have."""
    return {
        "mechanism": mechanism,
        "deviations": {name: float(value) for name, value in section["errors"].items()},
        "effects": active_effects(section["effects"], mechanism.drive_unit),
        "non_repeatability_mm": section.get("wobble_mm", 0.0),
        "masses": Masses(section["platform_mass_kg"], section["forearm_mass_kg"], section["arm_mass_kg"]),
    }


def _axis_deviations(section):
    """Displacements (3, 6 places, 6): normal draws of the stated sizes from the stated seed."""
    generator = np.random.default_rng(section["seed"])
    draw = generator.standard_normal((3, len(PLACES), 6))
    return draw * np.repeat([section["position_mm"], section["angle_rad"]], 3)
