"""The virtual robot: nominal controller in front, full spatial closure with its effects behind, a tracker beside.
Lengths mm, angles rad.
"""

from dataclasses import dataclass, field

import numpy as np

from rrru.campaign.measurements import actuator_columns
from rrru.effects.effect import PLACES, Contribution
from rrru.effects.library import active_effects
from rrru.effects.motion import make_motion
from rrru.errors import ConfigError
from rrru.plant.spatial import SpatialGeometry
from rrru.plant.tracker import measure
from rrru.robots.dynamics import Masses
from rrru.robots.rrru3 import Rrru3


class DrivenRobot:
    """What virtual robots share: they drive plans and are measured. They add mechanism, non_repeatability_mm, the three masses and
    `positions`.
    """

    def run(self, plan, noise_mm, generator, controller=None):
        """Drive a plan; returns (measurements, truth) as frames.

        controller: positions (n, 3) in the order driven to actuator values (n, 3), by default the nominal inverse
        kinematics. `measurements` fits the schema of that name with the commanded positions of the plan and the values
        that the controller sent; `truth` holds the exact position in the tracker's frame and the platform's rotation.
        Noise is drawn for every row, solved or not, so that one lost point does not change the others.
        """
        controller = controller or self.mechanism.inverse
        commands = plan.commands(self.mechanism)
        target = plan.targets()
        motion = self.motion(plan, controller)
        position, turned = self.positions(motion, target)
        solved = np.isfinite(position).all(axis=1)
        position = position + self.non_repeatability_mm * non_repeatability(generator, len(target))
        measured = measure(position, noise_mm, generator)
        measurements = commands.assign(
            **dict(zip(actuator_columns(self.mechanism.drive_unit), motion.drive.T, strict=True)),
            **{f"measured_{axis}_mm": measured[:, k] for k, axis in enumerate("xyz")},
            status=np.where(solved, "ok", "unsolved"),
        )
        truth = commands[["run", "trajectory", "point"]].assign(
            **{f"true_{axis}_mm": position[:, k] for k, axis in enumerate("xyz")},
            platform_rotation_rad=turned,
        )
        return measurements, truth

    def motion(self, plan, controller):
        """What the effects may know about a plan driven through a controller; the loads are those of the nominal
        mechanism.
        """
        path, index = plan.path()
        along = controller(path)
        return make_motion(
            self.mechanism,
            Masses(self.platform_mass_kg, self.forearm_mass_kg, self.arm_mass_kg),
            plan.targets(),
            along[index],
            along,
            index,
            plan.time_s(),
            np.concatenate([run.velocity_mm_s for run in plan.runs]),
            np.concatenate([run.acceleration_mm_s2 for run in plan.runs]),
            np.concatenate([np.full(len(run.points_mm), run.payload_kg) for run in plan.runs]),
        )


@dataclass(frozen=True)
class VirtualRobot(DrivenRobot):
    """A 3-RRRU whose truth is known.

    deviations: published names of the 14 errors (or the tied ones) to values; axis_deviations (3 legs, 6 places, 6):
    displacements of every axis; effects: active effects; non_repeatability_mm: radius of the ball in which the platform lies at
    random, see `non_repeatability`; masses in kg; rotation_limit_rad: a larger platform rotation counts as unsolved.
    """

    mechanism: Rrru3 = field(default_factory=Rrru3)
    deviations: dict = field(default_factory=dict)
    axis_deviations: np.ndarray = field(default_factory=lambda: np.zeros((3, len(PLACES), 6)))
    effects: tuple = ()
    non_repeatability_mm: float = 0.0
    platform_mass_kg: float = 3.0
    forearm_mass_kg: float = 1.2
    arm_mass_kg: float = 2.0
    rotation_limit_rad: float = 0.05

    @property
    def drive_errors_rad(self):
        """Constant errors (3,) of the drive angles."""
        return np.array([self.deviations.get(f"dtheta{k}", 0.0) for k in (1, 2, 3)])

    @property
    def geometry(self):
        """The chains' lengths and displacements."""
        robot = self.mechanism
        nominal = (robot.R_mm, robot.L1_mm, robot.L2_mm, robot.L3_mm, robot.r_mm)
        lengths = np.tile(nominal, (3, 1))
        for leg in range(3):
            for link in (1, 2, 3):
                lengths[leg, link] += self.deviations.get(f"dL{leg + 1}{link}", self.deviations.get(f"dL{link}", 0.0))
            lengths[leg, 0] += self.deviations.get("dR", 0.0)
            lengths[leg, 4] += self.deviations.get("dr", 0.0)
        return SpatialGeometry(np.array(robot.azimuth_rad), lengths, self.axis_deviations)

    def positions(self, motion, target):
        """Platform centres (n, 3) in the tracker's frame and the sizes (n,) of its rotation at the points of a motion
        near `target` (n, 3).

        NaN where the chains do not close near the target or the platform would turn by more than the limit.
        """
        change = sum((effect.contribute(motion) for effect in self.effects), Contribution())
        passive = self.mechanism.passive_angles(target, self.mechanism.inverse(target))
        solution = self.geometry.solve_under(motion.drive + self.drive_errors_rad, passive, change)
        turned = np.linalg.norm(solution.rotation_rad, axis=1)
        solved = solution.converged & (turned <= self.rotation_limit_rad)
        return np.where(solved[:, None], solution.position_mm, np.nan), turned


def non_repeatability(generator, count):
    """Points (count, 3) uniform in the unit ball: what clearance lets the platform do from stop to stop, bounded unlike
    instrument noise.
    """
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
        mechanism=mechanism,
        deviations={name: float(value) for name, value in section["errors"].items()},
        axis_deviations=_deviations(section["axis_errors"]),
        effects=active_effects(section["effects"]),
        non_repeatability_mm=section["wobble_mm"],
        platform_mass_kg=section["platform_mass_kg"],
        forearm_mass_kg=section["forearm_mass_kg"],
        arm_mass_kg=section["arm_mass_kg"],
        rotation_limit_rad=section["rotation_limit_rad"],
    )


def _deviations(section):
    """Displacements (3, 6 places, 6): normal draws of the stated sizes from the stated seed."""
    generator = np.random.default_rng(section["seed"])
    draw = generator.standard_normal((3, len(PLACES), 6))
    return draw * np.repeat([section["position_mm"], section["angle_rad"]], 3)
