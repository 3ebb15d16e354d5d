"""Interface of every robot for calibration, simulation and diagnosis. Lengths in mm, angles in rad.

The methods here use the general model of the legs. A robot's class adds its legs, parts and parameters, and closed
forms of these methods where they are faster.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np
import numpy.typing as npt

from rrru.arrays import BoolArray, FloatArray
from rrru.errors import UnreachableError
from rrru.kinematics.base_parameters import Candidate, MeasurementConfig
from rrru.kinematics.chain import PoseGuess, Poses
from rrru.kinematics.closure import Closure, ForwardModel
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.legs import Legs, Parts
from rrru.kinematics.measurement_jacobian import ReadingMap
from rrru.kinematics.parameter_jacobian import TwistMap
from rrru.kinematics.point_masses import DriveMotion, PointMass
from rrru.kinematics.readings import Readings, place_on_platform, points_read, turned_by
from rrru.parameters import ParameterSet


class Robot(ABC):
    """The nominal robot of the controller, with small deviations of its parameters.

    name: in configurations and tables.
    parameters: a ParameterSet, the meaning of every vector of deviations (p,).
    legs: `rrru.kinematics.legs.Legs`; parts: its Parts.
    directions (sites, 6, p): the twists that a unit of each parameter makes.
    TRACKED, RICHEST, SEARCHED: names of parameter sets: one that measured positions identify, the largest such one, the
        one that the genetic algorithm searches ("" for none).
    characteristic_length_mm: length that makes angles comparable with lengths.
    size_mm: upper bound of the tool's distance from the origin; farthest_mm: distance of the farthest reachable point
        from there, or size_mm; reach_mm: upper bound of the tool's distance from a leg's foot.
    drive_range (K, 2): lowest and highest actuator values between which it works, None where none is stated.
    up (3,): unit vector away from the ground; up_stated: whether its description states it, else it is assumed.

    Every attribute that code asks a robot for is named in this class, with its default where most robots have it.
    """

    name: str
    parts: Parts
    drive_range: FloatArray | None
    TRACKED: str
    RICHEST: str
    SEARCHED: str
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    up_stated: bool = True
    tool_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    # largest loads (K,) of the drives in N mm or N, and largest rates (K,) in rad/s or mm/s, as the robot's file states
    # them: NaN for a drive without one, None where the file has none
    effort_limits: FloatArray | None = None
    velocity_limits: FloatArray | None = None
    # masses of its links
    point_masses: tuple[PointMass, ...] = ()
    # what a campaign measures in addition to the tool's position, and what is unknown about it
    measurement_config: MeasurementConfig = MeasurementConfig()
    # whether positions and their derivatives have closed forms, which need no solution of the closure
    closed_form = False

    if TYPE_CHECKING:
        # fields of some robots, computed by others: for the type checker read-only, or no class could compute them

        @property
        def parameters(self) -> ParameterSet:
            """The meaning of every vector of deviations (p,)."""

        @property
        def legs(self) -> Legs:
            """Its legs, joints and sites."""

        @property
        def directions(self) -> FloatArray:
            """Twists (sites, 6, p) that a unit of each parameter makes."""

        @property
        def characteristic_length_mm(self) -> float:
            """Characteristic length that makes angles comparable with lengths."""

        @property
        def size_mm(self) -> float:
            """Upper bound of the tool's distance from the origin."""

        @property
        def farthest_mm(self) -> float:
            """Distance of the farthest reachable point from the origin, or size_mm."""

        @property
        def degrees_of_freedom(self) -> tuple[int, int]:
            """Degrees of freedom of position and, in addition, of orientation, of a robot that orients its platform."""

        @property
        def reach_mm(self) -> float:
            """Upper bound of the tool's distance from a leg's foot."""

    else:
        parameters: ParameterSet
        legs: Legs
        directions: FloatArray
        characteristic_length_mm: float
        size_mm: float
        farthest_mm: float
        reach_mm: float

    @abstractmethod
    def inverse(self, position_mm: FloatArray, deviations: FloatArray | None = None, elbow: str = "out") -> FloatArray:
        """Actuator values (n, K) for positions (n, 3) in an assembly ("out", "in"); NaN where out of reach."""

    @abstractmethod
    def identifiable(self, values: dict[str, float]) -> dict[str, float]:
        """Values by name of `parameters`, from values by name of any of `deviation_names`, identifiable or not."""

    @property
    def orients(self) -> bool:
        """Whether its drives can orient its platform in addition to moving it; not those of most robots."""
        return False

    @property
    def workspace_lines(self) -> int:
        """Steps of the table `workspace` over the robot's reach."""
        return 130

    @property
    def strokes(self) -> FloatArray:
        """Widths (K,) of the drives' stated ranges, NaN where none is stated, as for most robots."""
        return np.full(len(self.parts.drives), np.nan)

    def in_range(self, actuators: FloatArray) -> FloatArray:
        """Actuator values (n, K), NaN outside of the drives' stated ranges; for most robots none are stated."""
        return actuators

    def planned(self, position_mm: FloatArray, deviations: FloatArray | None = None) -> FloatArray:
        """Actuator values (n, K) as `inverse` gives them, within the drives' ranges; NaN also outside of these."""
        return self.in_range(self.inverse(position_mm, deviations))

    @property
    def z_down(self) -> bool:
        """Whether z of its frame points to the ground."""
        return bool(self.up[2] < 0.0)

    @cached_property
    def model(self) -> ForwardModel:
        """The legs, closed."""
        return Closure(self.legs)

    def with_measurement_config(self, config: MeasurementConfig) -> "Robot":
        """The robot for a campaign with unknowns in addition to its own parameters, see `MeasurementConfig`."""
        from rrru.kinematics.augmented_robot import AugmentedRobot

        return AugmentedRobot(self, config) if config.reflectors or config.turned or config.frame else self

    def with_identifiable_parameters(
        self, _actuators: FloatArray, _position_mm: FloatArray, _readings: Readings | None = None
    ) -> "Robot":
        """The robot with its parameters reduced to the identifiable ones at poses; most robots have a fixed set."""
        return self

    def widened(self, angle_rad: float, length_mm: float) -> Self:
        """The robot with bounds of its angles and lengths of this size to both sides."""
        # every robot is a dataclass that has these fields, this class is none
        return replace(self, angle_limit_rad=angle_rad, length_limit_mm=length_mm)  # type: ignore[type-var]

    @property
    def seats(self) -> tuple[str, ...]:
        """Sites of all joints that move, whose axes may be off by their assembly."""
        return tuple(joint.name for joint in self.legs.joints if joint.kind != "fixed")

    @property
    def stages(self) -> tuple[BoolArray, ...]:
        """Sets of parameters (p,), fitted one after the other where the nominal robot is too far off for one search."""
        return ()

    @property
    def gauge(self) -> dict[str, str]:
        """By name of a not identifiable parameter the combination that replaces it, in words; empty for a fixed set."""
        return {}

    def confounded_outside(self, name: str) -> tuple[tuple[Candidate, float], ...]:
        """Candidates of frame, tool or reflectors that a parameter is confounded with, and its size for a unit of each.

        Empty for a fixed set.
        """
        return ()

    @property
    def candidate_components(self) -> BoolArray:
        """Which components (sites, 6) of constant twists its parameters are chosen from; none for a fixed set."""
        return np.zeros((len(self.legs.sites), 6), dtype=bool)

    @property
    def deviation_names(self) -> tuple[str, ...]:
        """Names of the deviations that `twists_of` knows."""
        return self.parameters.names

    def twists_of(self, values: Mapping[str, float]) -> FloatArray:
        """Twists (1, sites, 6) of deviations by name, identifiable or not."""
        return self.twists(self.parameters.vector(values))

    def twists(self, deviations: npt.ArrayLike | None = None) -> FloatArray:
        """Twists (1, sites, 6) that deviations (p,) make."""
        if deviations is None:
            return np.zeros((1, len(self.legs.sites), 6))
        return np.asarray((self.directions @ np.asarray(deviations, dtype=float))[None])

    def near(self, position_mm: FloatArray, actuators: FloatArray) -> PoseGuess:
        """Start of the closure at positions (n, 3) and actuator values (n, K): the platform oriented as at home."""
        n = len(position_mm)
        turn = np.broadcast_to(self.legs.home_turn, (n, 3, 3))
        centre = np.asarray(position_mm, dtype=float) - self.legs.home_turn @ np.asarray(self.tool_mm)
        return PoseGuess(centre, turn, self.passive_near(centre, np.asarray(actuators, dtype=float)))

    def passive_near(self, position_mm: FloatArray, actuators: FloatArray) -> FloatArray:
        """Values (n, k) of the passive joints near platform centres (n, 3) and actuator values (n, K)."""
        return np.broadcast_to(self.legs.home_passive, (len(position_mm), len(self.legs.passive_joints)))

    def solve(self, actuators: FloatArray, position_mm: FloatArray, twists: FloatArray | None = None) -> Poses:
        """Poses at actuator values (n, K) near positions (n, 3), under twists (n or 1, sites, 6) at the sites."""
        return self.model.solve(actuators, self.near(position_mm, actuators), twists)

    def measured(self, poses: Poses, twists: FloatArray, readings: Readings | None = None) -> FloatArray:
        """Positions (n, 3) in the world's frame at Poses that fit twists (n or 1, sites, 6).

        Of the tool, or of the reflectors of `rrru.kinematics.readings.Readings`.
        """
        return into_frame(points_read(self, poses, twists, readings), twists[:, 0])

    def map(
        self, actuators: FloatArray, poses: Poses, twists: FloatArray | None = None, readings: Readings | None = None
    ) -> TwistMap:
        """The TwistMap at actuator values (n, K) and Poses that fit them under twists (n or 1, sites, 6).

        Of the tool, or of Readings at these poses.
        """
        given = self.twists() if twists is None else twists
        place = place_on_platform(self, given, readings)
        if readings is None or readings.tool_positions_only:
            return TwistMap(self.model, actuators, poses, twists, place)
        return ReadingMap(self, actuators, poses, given, place, readings)

    def map_at(self, actuators: FloatArray, position_mm: FloatArray, deviations: FloatArray | None = None) -> TwistMap:
        """The TwistMap under deviations (p,) at actuator values (n, K), near positions (n, 3)."""
        twists = self.twists(deviations)
        return self.map(actuators, self.solve(actuators, position_mm, twists), twists)

    def map_of_closed(
        self, actuators: FloatArray, position_mm: FloatArray, readings: Readings | None = None
    ) -> TwistMap:
        """The nominal TwistMap at those of the actuator values (n, K) at which the legs close near positions (n, 3)."""
        poses = self.solve(actuators, position_mm)
        seen = poses.closed
        return self.map(actuators[seen], poses.of(seen), readings=readings.of(seen) if readings else None)

    def guess(self, actuators: FloatArray, targets: Sequence[str] | None = None) -> FloatArray:
        """Positions (n, 3) from which to search poses at actuator values (n, K): the home position.

        targets (n,): names of the targets read; with several end effectors they determine the one that carries it.
        """
        return np.tile(self.legs.home_mm, (len(actuators), 1))

    def forward(
        self, actuators: FloatArray, deviations: FloatArray | None = None, guess_mm: FloatArray | None = None
    ) -> FloatArray:
        """Positions (n, 3) of the tool at actuator values (n, K); NaN where the legs do not close near guess_mm (n, 3).

        Without a guess near that of `guess`.
        """
        twists = self.twists(deviations)
        guess = self.guess(actuators) if guess_mm is None else guess_mm
        return self.measured(self.solve(actuators, guess, twists), twists)

    def forward_batch(
        self, actuators: FloatArray, deviations: FloatArray, guess_mm: FloatArray | None = None
    ) -> FloatArray:
        """Positions (m, n, 3) at n actuator values under m vectors of deviations (m, p); see `forward`."""
        deviations, count = np.asarray(deviations, dtype=float), len(actuators)
        twists = np.repeat(np.einsum("scp,mp->msc", self.directions, deviations), count, axis=0)
        guess = self.guess(actuators) if guess_mm is None else guess_mm
        every, near = np.tile(actuators, (len(deviations), 1)), np.tile(guess, (len(deviations), 1))
        return self.measured(self.solve(every, near, twists), twists).reshape(len(deviations), count, 3)

    def mean_distance(
        self, actuators: FloatArray, nominal_mm: FloatArray, measured_mm: FloatArray
    ) -> Callable[[FloatArray], FloatArray]:
        """Objective: deviations (m, p) to mean distances (m,) in mm from measured positions (n, 3)."""

        def evaluate(deviations: FloatArray) -> FloatArray:
            off = np.linalg.norm(self.forward_batch(actuators, deviations, nominal_mm) - measured_mm, axis=2)
            return np.where(np.isfinite(off).all(axis=1), off.mean(axis=1), np.inf)

        return evaluate

    def actuator_jacobian(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """Derivative (n, 3, K) of the position by the actuator values."""
        return self.map_at(actuators, position_mm, deviations).drive_response

    def parameter_jacobian(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """Derivative (n, 3, p) of the position by the parameters."""
        return self.map_at(actuators, position_mm, deviations).columns(self.directions)

    def singularities(
        self, position_mm: FloatArray, actuators: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Distance of poses from singularities: translational measure, constraint measure and determinant, each (n,).

        The constraint measure is the smallest singular value of the legs' unit wrenches, lengths counted in the robot's
        characteristic_length_mm, 0 where the platform can move with locked drives; the translational one that of the
        position Jacobian over its largest, angles times characteristic_length_mm, 0 where they cannot move the point in
        some direction.
        """
        at = self.map_at(actuators, position_mm)
        lengths = np.array([1.0 if unit == "mm" else self.characteristic_length_mm for unit in self.parts.units])
        return at.translational_measure(lengths), *at.constraint_measures(self.characteristic_length_mm)

    def own_load(
        self, masses: Masses, motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray
    ) -> FloatArray | float:
        """Loads (n, D) on the driven values, in N mm or N, of all moving masses except the platform's; none here.

        motion: values, rates and accelerations (n, K) of the drives; gravity_mm_s2 (3,): in the robot's frame.
        """
        return 0.0

    def own_member_forces(self, motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray) -> FloatArray | float:
        """Forces (n, members) in N on the members, compression positive, without the platform's load; none here."""
        return 0.0

    def own_moments(
        self, motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray, at_mm: FloatArray
    ) -> FloatArray | float:
        """Moments (n, J, 3) in N mm of an arm's masses, without the platform's, about places at_mm; none here."""
        return 0.0

    def own_base_moment(self, motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray) -> FloatArray | float:
        """Moments (n, 3) in N mm about the origin of all moving masses except the platform's; none here."""
        return 0.0

    def drive_errors(self, twists: FloatArray) -> FloatArray:
        """Changes (n, K) of the actuator values that come closest to twists (n, sites, 6), by least squares."""
        numbers = self.legs.site_numbers
        units = np.zeros((len(self.parts.drives), len(numbers), 6))
        for unit, drive in zip(units, self.parts.drives, strict=True):
            for site, twist in drive.twists.items():
                unit[numbers[site]] = twist
        flat = units.reshape(len(units), -1)
        return np.asarray(np.linalg.solve(flat @ flat.T, flat @ twists.reshape(len(twists), -1).T).T, dtype=float)

    def unreached(self, values: FloatArray, as_home: bool = True) -> str:
        """Why a point whose actuator values (K,) are NaN in part cannot be reached, for a message.

        as_home: whether the platform was to be oriented as at home, which robots say that can orient it.
        """
        return "out of reach of leg " + ", ".join(str(leg + 1) for leg in np.flatnonzero(np.isnan(values)))

    def require_reachable(self, position_mm: FloatArray, deviations: FloatArray | None = None) -> FloatArray:
        """Actuator values as `planned` gives them; raises UnreachableError naming the first point out of reach."""
        values = self.planned(position_mm, deviations)
        bad = np.flatnonzero(np.isnan(values).any(axis=1))
        if bad.size:
            x, y, z = np.asarray(position_mm, dtype=float)[bad[0]]
            raise UnreachableError(
                f"point {bad[0] + 1} at ({x:.3f}, {y:.3f}, {z:.3f}) mm is {self.unreached(values[bad[0]])}; "
                f"{bad.size} of {len(values)} points cannot be reached"
            )
        return values


def into_frame(position_mm: FloatArray, frame: FloatArray) -> FloatArray:
    """Positions (n, 3) rotated and then shifted by twists (n or 1, 6): shift in mm and rotation vector in rad."""
    if not np.any(frame):
        return position_mm
    return turned_by(frame[:, 3:], position_mm) + frame[:, :3]
