"""Robots with several end effectors: arms that share their first joints, the trunk.

Every arm is a leg from the base to its own end effector; each pose is measured at one of them. A twist moves an end
effector as in the serial arm to it, and a twist at a joint of another arm does not move it. So A of
`rrru.kinematics.parameter_jacobian` is the identity, and the wrenches of all legs except the measured one are zero.
A pose belongs to the end effector whose nominal position is nearest to the position near which the pose is searched.
The masses of all arms load the trunk. Lengths in mm, angles in rad.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import cycle, islice

import numpy as np

from rrru.arrays import FloatArray, IntArray
from rrru.errors import ConfigError
from rrru.kinematics.chain import EndEffectorPoses, PoseGuess, Poses, Twists, Walk, walk
from rrru.kinematics.general_robot import GeneralRobot
from rrru.kinematics.legs import Drive, Joint, Leg, Legs, Parts
from rrru.kinematics.point_masses import PLATFORM, PointMass

_EYE = np.eye(6)
# number of the leg of a pose that is of no known end effector
_NO_LEG = -1
# point masses of two arms' descriptions are the same within this
_SAME_MM = 1e-6


class Ends:
    """Forward model of legs with separate ends, in place of `rrru.kinematics.closure.Closure`."""

    row_count = 6

    def __init__(self, legs: Legs) -> None:
        self.legs, self.rows = legs, [slice(0, 6)] * len(legs.legs)

    def wrenches(self, _ways: Sequence[Walk], poses: Poses) -> list[FloatArray]:
        """Wrenches (n, 6, 6) of every leg: all six where its end effector is read, none elsewhere."""
        leg = _leg_of(poses)
        return [np.where((leg == number)[:, None, None], _EYE, 0.0) for number in range(len(self.legs.legs))]

    def inverse(self, wrenches: Sequence[FloatArray]) -> FloatArray:
        """Twists (n, 6, 6) of the end effector per constraint."""
        return np.broadcast_to(_EYE, wrenches[0].shape)

    def solve(self, actuators: FloatArray, start: PoseGuess, twists: FloatArray | None = None) -> EndEffectorPoses:
        """EndEffectorPoses (n) of the legs of `start` at actuator values (n, K), under twists (n or 1, sites, 6)."""
        return self.at(actuators, _leg_of(start), twists)

    def at(self, actuators: FloatArray, leg: IntArray, twists: FloatArray | None = None) -> EndEffectorPoses:
        """EndEffectorPoses (n) of the ends of legs (n,) at actuator values (n, K), under twists (n or 1, sites, 6)."""
        every = ends(self.legs, np.asarray(actuators, dtype=float), Twists(self.legs, twists))
        rows = np.arange(len(leg))
        position, turn = (np.stack(part)[leg, rows] for part in zip(*every, strict=True))
        known = (leg != _NO_LEG) & np.isfinite(position).all(axis=1) & np.isfinite(turn).all(axis=(1, 2))
        position[~known], turn[~known] = np.nan, np.nan
        none = np.zeros((len(leg), 0))
        return EndEffectorPoses(position, turn, none, np.where(known, 0.0, np.inf), known, leg)


def _leg_of(poses: PoseGuess) -> IntArray:
    """Numbers (n,) of the legs whose ends poses are; raises TypeError for poses of another kind of robot."""
    if not isinstance(poses, EndEffectorPoses):
        raise TypeError(f"the poses are {type(poses).__name__}; allowed: EndEffectorPoses")
    return poses.leg


def ends(legs: Legs, actuators: FloatArray, twists: Twists) -> list[tuple[FloatArray, FloatArray]]:
    """Positions (n, 3) and orientations (n, 3, 3) of the end of every leg."""
    passive = np.zeros((len(actuators), 0))
    return [(way.place, way.turn) for way in (walk(legs, leg, actuators, passive, twists) for leg in legs.legs)]


@dataclass(frozen=True, eq=False)
class MultiArmRobot(GeneralRobot):
    """A GeneralRobot of several end effectors. Its inverse is that of the first one."""

    @cached_property
    def model(self) -> Ends:
        """The ends of the legs."""
        return Ends(self.legs)

    def near(self, position_mm: FloatArray, actuators: FloatArray) -> EndEffectorPoses:
        """EndEffectorPoses (n) with the nominal tools nearest to positions (n, 3), at actuator values (n, K).

        NaN where a position is NaN: it does not determine which end effector the pose is of.
        """
        actuators, position = np.asarray(actuators, dtype=float), np.asarray(position_mm, dtype=float)
        off = np.nan_to_num(self._tools(actuators) - position)
        nearest = np.linalg.norm(off, axis=2).argmin(axis=0)
        return self.model.at(actuators, np.where(np.isfinite(position).all(axis=1), nearest, _NO_LEG))

    def guess(self, actuators: FloatArray, targets: Sequence[str] | None = None) -> FloatArray:
        """Positions (n, 3) of the tools of the end effectors that carry targets (n,), by default of the first one.

        Raises ConfigError for a target that no end effector carries.
        """
        owner = {target: number for number, carried in enumerate(self.legs.end_effectors) for target in carried}
        wanted = [self.legs.end_effectors[0][0]] * len(actuators) if targets is None else list(targets)
        if unknown := [target for target in wanted if target not in owner]:
            allowed = ", ".join(owner)
            text = f"no end effector carries the target {unknown[0]!r}; allowed: {allowed}"
            raise ConfigError(f"robot {self.name}: {text}")
        return self._tools(actuators)[[owner[target] for target in wanted], np.arange(len(wanted))]

    def _tools(self, actuators: FloatArray) -> FloatArray:
        """Nominal positions (legs, n, 3) of the tools of all end effectors at actuator values (n, K)."""
        every = ends(self.legs, np.asarray(actuators, dtype=float), Twists(self.legs))
        return np.stack([place + turn @ np.asarray(self.tool_mm) for place, turn in every])

    def _workspace(self) -> tuple[FloatArray, FloatArray]:
        """Actuator values (n, K) spread over the drives' ranges and positions (n, 3) of the end effectors in turn."""
        actuators, _ = super()._workspace()
        first_targets = cycle(target for target, *_ in self.legs.end_effectors)
        return actuators, self.guess(actuators, list(islice(first_targets, len(actuators))))


def with_hands(
    arms: Mapping[str, GeneralRobot], shared: int, carries: Mapping[str, Sequence[str]] | None = None
) -> MultiArmRobot:
    """The MultiArmRobot of arms by name, robots of one leg of driven joints each.

    shared: number of joints that all arms share, from the base on, the base's frame included; carries: names of the
    targets on each end effector, by default one with the arm's name. Options and shared joints are the first arm's;
    fixed frames of the arms get the arm's name as prefix. Raises ConfigError for joints of two arms with one name.
    """
    first, carries = next(iter(arms.values())), carries or {}
    if unknown := [name for name in carries if name not in arms]:
        raise ConfigError(f"robot {first.name}: targets of {unknown[0]!r}; allowed: {', '.join(arms)}")
    targets = tuple(tuple(carries.get(name, (name,))) for name in arms)
    every = [target for carried in targets for target in carried]
    if len(set(every)) < len(every) or not all(targets):
        allowed = "one or more different names for each end effector"
        raise ConfigError(f"robot {first.name}: targets {', '.join(every)}; allowed: {allowed}")
    arms = {name: _apart(arm, name, shared) for name, arm in arms.items()}
    chains, order = _chains(arms, shared, first.name)
    drives, ranges, home = _drives(arms.values())
    followers = {follower.site: follower for arm in arms.values() for follower in arm.parts.followers}
    coupling = _coupling(arms.values(), order, list(drives))
    options = {option.name: getattr(first, option.name) for option in fields(first)}
    joined = {
        "legs": Legs(chains, home, first.legs.home_mm, first.legs.home_turn, coupling=coupling, end_effectors=targets),
        "parts": Parts(drives=tuple(drives.values()), followers=tuple(followers.values())),
        "drive_range": ranges,
        "assumed": frozenset().union(*(arm.assumed for arm in arms.values())),
        "point_masses": _point_masses([*arms.values()], shared),
        **{name: _limits(arms.values(), name, drives) for name in ("effort_limits", "velocity_limits")},
    }
    return MultiArmRobot(**options | joined)


def _drives(arms: Iterable[GeneralRobot]) -> tuple[dict[str, Drive], FloatArray, FloatArray]:
    """Drives by column of all arms, with the followers in any arm, their ranges (K, 2) and home values (K,)."""
    drives: dict[str, Drive] = {}
    ranges: dict[str, FloatArray] = {}
    homes: dict[str, float] = {}
    for arm in arms:
        for drive, ends, home in zip(arm.parts.drives, arm.drive_range, arm.legs.home_drives, strict=True):
            known = drives.get(drive.column, drive)
            drives[drive.column] = replace(known, others=known.others | drive.others)
            ranges.setdefault(drive.column, ends)
            homes.setdefault(drive.column, home)
    return drives, np.array([*ranges.values()]), np.array([*homes.values()])


def _limits(arms: Iterable[GeneralRobot], name: str, columns: Iterable[str]) -> FloatArray | None:
    """One of `effort_limits` and `velocity_limits` of arms, by the columns of all drives; None where no arm has any."""
    known: dict[str, float] = {}
    for arm in arms:
        if (limits := getattr(arm, name)) is not None:
            known |= dict(zip(arm.parts.columns, limits, strict=True))
    return np.array([known.get(column, np.nan) for column in columns]) if known else None


def shared_joints(arms: Mapping[str, GeneralRobot]) -> int:
    """Number of joints up to which arms by name have the same names, the base's frame among them."""
    chains = zip(*(_names(arm) for arm in arms.values()), strict=False)
    return next((number for number, names in enumerate(chains) if len(set(names)) > 1), 0)


def _point_masses(arms: Sequence[GeneralRobot], shared: int) -> tuple[PointMass, ...]:
    """The point masses of arms; on the trunk only those of all arms, since one arm may count another to its trunk."""
    first, *further = arms
    trunk = set(_names(first)[:shared])
    common = [mass for mass in first.point_masses if mass.joint in trunk and all(_has(arm, mass) for arm in further)]
    return (*common, *(point_mass for arm in arms for point_mass in arm.point_masses if point_mass.joint not in trunk))


def _has(arm: GeneralRobot, point_mass: PointMass) -> bool:
    """Whether an arm has a point mass."""
    alike = (own for own in arm.point_masses if (own.joint, own.mass_kg) == (point_mass.joint, point_mass.mass_kg))
    return any(np.allclose(own.at_mm, point_mass.at_mm, rtol=0.0, atol=_SAME_MM) for own in alike)


def _names(arm: GeneralRobot) -> list[str]:
    """Names of the joints of an arm, its base's frame first."""
    return [joint.name for joint in arm.legs.legs[0].joints]


def _apart(arm: GeneralRobot, arm_name: str, shared: int) -> GeneralRobot:
    """An arm whose fixed frames behind the shared joints have the arm's name as prefix, the end effector's too."""
    (leg,) = arm.legs.legs
    new = {joint.name: f"{arm_name} {joint.name}" for joint in leg.joints[shared:] if joint.kind == "fixed"}
    new[PLATFORM] = new.get(leg.joints[-1].name, leg.joints[-1].name)
    joints = tuple(replace(joint, name=new.get(joint.name, joint.name)) for joint in leg.joints)
    point_masses = tuple(
        replace(point_mass, joint=new.get(point_mass.joint, point_mass.joint)) for point_mass in arm.point_masses
    )
    return replace(
        arm, legs=replace(arm.legs, legs=(replace(leg, name=arm_name, joints=joints),)), point_masses=point_masses
    )


def _chains(arms: Mapping[str, GeneralRobot], shared: int, robot: str) -> tuple[tuple[Leg, ...], list[str]]:
    """The legs of arms, with the first one's shared joints in all of them, and names of the driven joints in order."""
    trunk: list[Joint] = []
    driven: dict[str, int] = {}
    taken: set[str] = set()
    result = []
    for name, arm in arms.items():
        (leg,) = arm.legs.legs
        if leg.bar or arm.legs.passive_joints:
            raise ConfigError(f"robot {robot}: {name} is no chain of driven joints; allowed: arms")
        names = _names(arm)[shared:]
        if again := taken.intersection(names):
            raise ConfigError(f"robot {robot}: two arms have a joint {again.pop()!r}; allowed: names of their own")
        taken.update(names)
        joints = [
            joint if joint.drive is None else replace(joint, drive=driven.setdefault(joint.name, len(driven)))
            for joint in leg.joints
        ]
        trunk = trunk or joints[:shared]
        result.append(replace(leg, joints=(*trunk, *joints[shared:])))
    return tuple(result), list(driven)


def _coupling(arms: Iterable[GeneralRobot], joints: Sequence[str], columns: Sequence[str]) -> FloatArray | None:
    """Driven values (D, K) of joints per drive, from the arms that have the joint; None where they are the same."""
    result = np.zeros((len(joints), len(columns)))
    for arm in arms:
        names = {joint.drive: joint.name for joint in arm.legs.joints if joint.drive is not None}
        matrix = np.eye(len(names)) if arm.legs.coupling is None else arm.legs.coupling
        for (row, number), factor in np.ndenumerate(matrix):
            result[joints.index(names[row]), columns.index(arm.parts.columns[number])] = factor
    same = result.shape[0] == result.shape[1] and np.array_equal(result, np.eye(len(result)))
    return None if same else result
