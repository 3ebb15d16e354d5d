"""A robot that has no module of its own: legs from a description, everything else by the general model.

Its parameters are directions at sites. The set "frame" has the unknowns of a campaign's readings alone: frame and
reflectors. "zero" has the drives' zero offsets as well. "full" has every identifiable geometric parameter, drives
first, then lengths, then angles. A parameter that is confounded with those before it over the workspace is not
identifiable and left out; `gauge` states which combination replaces it. With a campaign each set is reduced to the
parameters that are identifiable at its poses. Lengths in mm, angles in rad.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.arrays import BoolArray, FloatArray
from rrru.errors import ConfigError
from rrru.kinematics import base_parameters
from rrru.kinematics.base_parameters import (
    LEFT_OF_DATA,
    Candidate,
    MeasurementConfig,
    candidate_components,
    candidates_of,
    choose,
    column_scale,
    direction,
    in_words,
    open_numbers,
)
from rrru.kinematics.chain import PoseGuess, Poses
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.inverse import bar_lengths, drives_from_home, end_of, followed, in_range, near_or_followed
from rrru.kinematics.legs import TOOL, WORLD, Leg, Legs, Parts
from rrru.kinematics.point_masses import DriveMotion, PointMass, base_moment, driven_loads, member_forces, moments
from rrru.kinematics.readings import Readings
from rrru.kinematics.robot import Robot
from rrru.parameters import ParameterSet

SETS = ("frame", "zero", "full")
# poses over which parameters are separable without a campaign, their tilt, and the independent share of a column needed
_POSES, _TILT_RAD, _LEFT = 60, 0.15, 1e-6
# of drive values at which the legs of a robot whose drives depend on each other do not close
_HALVINGS = 6
_SEEN = 1e-6  # share of the largest singular value that others need to count


@dataclass(frozen=True, eq=False)
class GeneralRobot(Robot):
    """A robot of any legs.

    drive_range (K, 2): actuator values between which it works; assumed: columns of the drives without a stated range,
    which may go beyond it; parameter_set: one of SETS; point_masses: point masses of its links; sample: actuator values
    (n, K), positions (n, 3) and Readings at which the set is chosen, by default over the workspace; among: names that
    it is chosen from, by default all; measurement_config: a campaign's MeasurementConfig; effort_limits,
    velocity_limits: of `Robot`.
    """

    name: str
    legs: Legs
    parts: Parts
    drive_range: FloatArray
    characteristic_length_mm: float = 500.0
    parameter_set: str = "zero"
    angle_limit_rad: float = 0.1
    length_limit_mm: float = 30.0
    tool_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    up_stated: bool = True
    point_masses: tuple[PointMass, ...] = ()
    assumed: frozenset[str] = frozenset()
    sample: tuple[FloatArray, FloatArray, Readings | None] | None = None
    among: tuple[str, ...] = ()
    measurement_config: MeasurementConfig = field(default_factory=MeasurementConfig)
    effort_limits: FloatArray | None = None
    velocity_limits: FloatArray | None = None

    TRACKED = RICHEST = "full"
    SEARCHED = ""  # an objective that is not compiled is too slow for a genetic algorithm

    def __post_init__(self) -> None:
        if self.parameter_set not in SETS:
            raise ConfigError(f"{self.name}: parameter_set is {self.parameter_set!r}; allowed: {', '.join(SETS)}")

    @cached_property
    def candidates(self) -> tuple[Candidate, ...]:
        """All Candidates, see `rrru.kinematics.base_parameters`."""
        return candidates_of(self.legs, self.parts, self.measurement_config)

    @cached_property
    def _chosen(self) -> tuple[tuple[Candidate, ...], dict[str, FloatArray]]:
        """Chosen Candidates, and by name the combination of chosen ones (k,) that each other one is confounded with."""
        wanted = self._wanted
        if self.parameter_set != "full" and not self.sample:
            return wanted, {}
        actuators, position, readings = self.sample or (*self._workspace(), None)
        least = LEFT_OF_DATA if self.sample else _LEFT
        at = self.map_of_closed(actuators, position, readings)
        candidates = self.candidates
        columns = at.columns(np.stack([direction(self.legs, candidate) for candidate in candidates], axis=-1))
        sizes = column_scale(candidates, self.characteristic_length_mm)
        names = {candidate.name for candidate in wanted}
        names &= set(self.among or names)
        allowed = [candidate.name in names for candidate in candidates]
        ranks = [candidate.rank for candidate in candidates]
        chosen, combined = choose(columns.reshape(-1, len(sizes)) * sizes, allowed, least, ranks)
        replaced = {
            candidates[number].name: combination * sizes[chosen] / sizes[number]
            for number, combination in combined.items()
        }
        return tuple(candidates[k] for k in chosen), replaced

    @property
    def candidate_components(self) -> BoolArray:
        """Which components (sites, 6) of constant twists its parameters are chosen from."""
        return candidate_components(self.legs, self._wanted)

    @cached_property
    def _wanted(self) -> tuple[Candidate, ...]:
        """The Candidates that the set is chosen from."""
        if self.parameter_set == "full":
            return self.candidates
        drives = [one for one in self.candidates if one.leg] if self.parameter_set == "zero" else ()
        return (*drives, *open_numbers(self.measurement_config))

    def _workspace(self) -> tuple[FloatArray, FloatArray]:
        """Actuator values (n, K) spread over the drives' ranges and positions (n, 3) near those of the tool.

        Values at which the legs do not close are moved half the way home, where needed again and again.
        """
        generator = np.random.default_rng(0)
        if self._bars_only:
            low, high = np.asarray(self.drive_range, dtype=float).T
            position = self.legs.home_mm + 0.3 * (high - low).min() * generator.uniform(-1.0, 1.0, (_POSES, 3))
            turn = Rotation.from_rotvec(_TILT_RAD * generator.uniform(-1.0, 1.0, (_POSES, 3))).as_matrix()
            place = position, turn @ self.legs.home_turn
            actuators = bar_lengths(self.legs, self.drive_range, place, self.twists())
            known = np.isfinite(actuators).all(axis=1)
            return actuators[known], position[known]
        low, high = np.asarray(self.drive_range, dtype=float).T
        actuators = low + (high - low) * generator.random((_POSES, len(low)))
        position = np.tile(self.legs.home_mm, (_POSES, 1))
        for _ in range(_HALVINGS):
            closed = self.solve(actuators, position).closed
            if closed.all():
                break
            actuators[~closed] = 0.5 * (actuators[~closed] + self.legs.home_drives)
        return actuators, position

    @cached_property
    def parameters(self) -> ParameterSet:
        """The parameters of the chosen set, nominally zero."""
        return base_parameters.bounded(self._chosen[0], {"mm": self.length_limit_mm, "rad": self.angle_limit_rad})

    @cached_property
    def gauge(self) -> dict[str, str]:
        """By name of a not identifiable parameter the combination that replaces it, such as "0.71 base1_x - 0.2 dl1".

        "nothing" where it has no effect on the readings.
        """
        return {left: in_words(combination, self.parameters.names) for left, combination in self._chosen[1].items()}

    def confounded_outside(self, name: str) -> tuple[tuple[Candidate, float], ...]:
        """Candidates of frame, tool and reflectors confounded with a parameter, and its size for a unit of each."""
        names, (_, replaced) = self.parameters.names, self._chosen
        outside = self._outside
        known = {candidate.name: candidate for candidate in self.candidates if outside.issuperset(candidate.twists)}
        shares = {left: dict(zip(names, part.tolist(), strict=False)) for left, part in replaced.items()}
        sizes = {left: share.get(name, 0.0) for left, share in shares.items()}
        return tuple((known[left], size) for left, size in sizes.items() if left in known and size)

    @property
    def _outside(self) -> set[str]:
        """Sites that are no part of the robot."""
        return {WORLD, TOOL, *self.legs.reflectors}

    @property
    def stages(self) -> tuple[BoolArray, ...]:
        """Frame, tool and reflectors, and then with them the drives."""
        return base_parameters.stages(self._chosen[0], self._outside)

    @cached_property
    def directions(self) -> FloatArray:
        """Twists (sites, 6, p) that a unit of each parameter makes."""
        columns = [direction(self.legs, candidate)[..., None] for candidate in self._chosen[0]]
        return np.concatenate([np.zeros((len(self.legs.sites), 6, 0)), *columns], axis=-1)

    @property
    def deviation_names(self) -> tuple[str, ...]:
        """Names of the deviations that `twists_of` knows: all Candidates."""
        return tuple(one.name for one in self.candidates)

    def twists_of(self, values: Mapping[str, float]) -> FloatArray:
        """Twists (1, sites, 6) of deviations by name."""
        known = {candidate.name: candidate for candidate in self.candidates}
        twists = [value * direction(self.legs, known[name]) for name, value in values.items()]
        return np.sum(twists, axis=0)[None] if twists else self.twists()

    def identifiable(self, values: dict[str, float]) -> dict[str, float]:
        """Mapping of the parameters from values of any Candidates: others count by what replaces them."""
        result = dict.fromkeys(self.parameters.names, 0.0)
        for name, value in values.items():
            if name in result:
                result[name] += value
            for chosen, share in zip(self._chosen[0], self._chosen[1].get(name, ()), strict=False):
                result[chosen.name] += share * value
        return result

    def with_measurement_config(self, config: MeasurementConfig) -> Self:
        """The robot with a campaign's `rrru.kinematics.base_parameters.MeasurementConfig`."""
        return replace(self, legs=replace(self.legs, reflectors=config.reflectors), measurement_config=config)

    def with_identifiable_parameters(
        self, actuators: FloatArray, position_mm: FloatArray, readings: Readings | None = None
    ) -> Self:
        """The robot with its set reduced to the parameters identifiable at poses of a campaign, (n, K) and (n, 3).

        readings: what was read at these poses, by default positions of the tool. A second reduction, at poses of a part
        of the campaign, chooses among the parameters of the first one.
        """
        among = () if self.sample is None else self.parameters.names
        sample = np.asarray(actuators, dtype=float), np.asarray(position_mm, dtype=float), readings
        return replace(self, sample=sample, among=among)

    @property
    def reach_mm(self) -> float:
        """Upper bound of how far the tool can get from the foot of the leg that takes it farthest."""
        return self._longest_mm(1)

    @property
    def orients(self) -> bool:
        """Whether its drives can orient its platform besides moving it."""
        return self.degrees_of_freedom[1] > 0

    @property
    def size_mm(self) -> float:
        """Upper bound of how far the tool can get from the origin."""
        return self._longest_mm(0)

    farthest_mm = size_mm  # searching for it would take the inverse of many points

    def _longest_mm(self, first: int) -> float:
        """Length of the longest leg from its joint of this number on, slides and bars out, to the tool."""
        travel = np.abs(np.asarray(self.drive_range, dtype=float)).max(axis=1)
        return self.legs.longest_mm(first, travel) + float(np.linalg.norm(self.tool_mm))

    def inverse(
        self,
        position_mm: FloatArray,
        deviations: FloatArray | None = None,
        elbow: str = "out",
        turn: FloatArray | None = None,
    ) -> FloatArray:
        """Actuator values (n, K) for positions (n, 3) of the tool; NaN where Newton from home does not converge.

        Under deviations positions are met as nearly as the drives can. turn (n, 3, 3): the platform's orientation, by
        default the home pose's, where the drives can choose it; of the assemblies there is only the home pose's.
        """
        position, twists = np.asarray(position_mm, dtype=float), self.twists(deviations)
        wanted = np.broadcast_to(self.legs.home_turn, (len(position), 3, 3)) if turn is None else turn
        if self._bars_only:
            place = position - np.einsum("nij,j->ni", wanted, self.tool_mm), wanted
            return bar_lengths(self.legs, self.drive_range, place, twists)
        return drives_from_home(self, (position, wanted), twists, deviations is not None)

    @property
    def strokes(self) -> FloatArray:
        """Widths (K,) of the drives' ranges, NaN where none is stated."""
        stated = [column not in self.assumed for column in self.parts.columns]
        return np.where(stated, np.ptp(np.asarray(self.drive_range, dtype=float), axis=1), np.nan)

    def in_range(self, actuators: FloatArray) -> FloatArray:
        """Actuator values (n, K), those of turning drives by whole turns within their ranges; NaN outside of these."""
        return in_range(self, np.asarray(actuators, dtype=float))

    def unreached(self, values: FloatArray, as_home: bool = True) -> str:
        """What keeps the robot from a point: a drive's range where only some of the values (K,) are NaN.

        as_home: whether its platform was to be turned as in the home pose.
        """
        names = [name for name, lost in zip(self.parts.columns, np.isnan(values), strict=True) if lost]
        where = "out of reach" if len(names) == len(values) else f"out of the range of {', '.join(names)}"
        return where + (", with the platform turned as in the home pose" if self.orients and as_home else "")

    def own_load(
        self, _masses: Masses, motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray
    ) -> FloatArray | float:
        """Loads (n, D) on the driven values, in N mm or N, of the robot's point masses; see
        `rrru.kinematics.point_masses`.
        """
        return driven_loads(self, motion, poses, gravity_mm_s2) if self.point_masses else 0.0

    def own_member_forces(self, motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray) -> FloatArray | float:
        """Forces (n, members) in N of the robot's point masses on its members, compression positive."""
        return member_forces(self, motion, poses, gravity_mm_s2) if self.point_masses else 0.0

    def own_moments(
        self, motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray, at_mm: FloatArray
    ) -> FloatArray | float:
        """Moments (n, J, 3) in N mm of an arm's point masses about the places (n, J, 3) of its turning joints."""
        return moments(self, motion, poses, gravity_mm_s2, at_mm) if self.point_masses else 0.0

    def own_base_moment(self, motion: DriveMotion, poses: Poses, gravity_mm_s2: FloatArray) -> FloatArray | float:
        """Moments (n, 3) in N mm of the robot's point masses about the origin."""
        return base_moment(self, motion, poses, gravity_mm_s2) if self.point_masses else 0.0

    @property
    def workspace_lines(self) -> int:
        """Grid lines over its reach: fewer where every point's inverse takes a search."""
        return super().workspace_lines if self._bars_only else 30

    @property
    def _bars_only(self) -> bool:
        """Whether every drive is a bar's length."""
        bars = [leg.bar.drive for leg in self.legs.legs if leg.bar]
        return None not in bars and len(bars) == len(self.parts.drives) and self.legs.coupling is None

    @cached_property
    def degrees_of_freedom(self) -> tuple[int, int]:
        """Degrees of freedom of the tool's position, and in addition of the platform's orientation, by the drives."""
        actuators, position = (part[:10] for part in self._workspace())
        at = self.map_of_closed(actuators, position)
        position_rank = np.linalg.matrix_rank(at.drive_response, rtol=_SEEN).max()
        turn = self.characteristic_length_mm * at.platform[:, 3:] @ at.drive_counts
        pose_rank = np.linalg.matrix_rank(np.concatenate([at.drive_response, turn], axis=1), rtol=_SEEN).max()
        return int(position_rank), int(pose_rank - position_rank)

    @cached_property
    def _driven_leg(self) -> Leg | None:
        """A leg that is all driven, whose end is the platform's place; None where there is none."""
        legs = (leg for leg in self.legs.legs if not leg.bar and not any(joint.passive for joint in leg.joints))
        return next(legs, None)

    def near(self, position_mm: FloatArray, actuators: FloatArray) -> PoseGuess:
        """Poses near which the legs close: of a leg that is all driven its own end, else upright or followed."""
        actuators = np.asarray(actuators, dtype=float)
        if self._driven_leg:
            return end_of(self.legs, self._driven_leg, actuators)
        return near_or_followed(self, actuators, super().near(position_mm, actuators))

    def guess(self, actuators: FloatArray, targets: Sequence[str] | None = None) -> FloatArray:
        """Positions (n, 3) of the tool at actuator values (n, K): a driven leg's end, or followed from home.

        The home position where they are lost.
        """
        actuators = np.asarray(actuators, dtype=float)
        known = end_of(self.legs, self._driven_leg, actuators) if self._driven_leg else followed(self, actuators)
        position = known.point(self.tool_mm)
        return np.where(np.isfinite(position), position, self.legs.home_mm)
