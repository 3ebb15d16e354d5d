"""A robot as legs, chains of joints: the description of every robot and the input of the general model.

A platform is held by legs. A leg is a chain of joints from the base to the platform; each joint is preceded by a fixed
placement, the link. Universal and ball joints are revolute ones at one place. A leg may end in a bar instead, a link or
cable between two ball joints, which only holds its length. Joints of one name, with all that precedes them, are shared
by legs: the two bars of a Delta's arm share its drive, and chains may part behind a passive joint. Arms on one trunk
are legs that hold no common platform: each has an end effector of its own, see `rrru.kinematics.end_effectors`.

Every small geometric error is a twist (6,) at a site: a shift in mm along the axes of the site's frame, then a rotation
vector in rad. Sites are the frame of every joint, every bar and its end at the platform, the world (the frame of the
measurements), the tool (the measured point) and every reflector on it. The frame of tool and reflectors is the
platform's. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray, IntArray
from rrru.errors import ConfigError

WORLD, TOOL = "world", "tool"
X, Y, Z = np.eye(3)
_NO_SHIFT, _NO_TURN = np.zeros(3), np.eye(3)


@dataclass(frozen=True, eq=False)
class Joint:
    """One joint and the link before it.

    kind: "R" turns about, "P" slides along `axis` (3,), a unit vector; "fixed" only makes a site.
    shift_mm (3,), turn (3, 3): position and rotation matrix of its frame in the moved frame of the joint before it.
    drive: number of its driven value from 0, see `Legs`; None for a passive joint.
    home: value in rad or mm of a passive joint from which searches start.
    """

    name: str
    kind: str = "fixed"
    axis: FloatArray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    shift_mm: FloatArray = field(default_factory=lambda: _NO_SHIFT)
    turn: FloatArray = field(default_factory=lambda: _NO_TURN)
    drive: int | None = None
    home: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in ("R", "P", "fixed"):
            raise ConfigError(f"joint {self.name}: its kind is {self.kind!r}; allowed: R, P, fixed")

    @property
    def passive(self) -> bool:
        """Whether its value follows from the others."""
        return self.kind != "fixed" and self.drive is None


@dataclass(frozen=True, eq=False)
class Bar:
    """A link of length_mm between ball joints, from the last joint's frame to the point platform_mm (3,).

    drive: number of the driven value that adds to its length, None for a link that keeps it.
    """

    length_mm: float
    platform_mm: FloatArray
    drive: int | None = None


@dataclass(frozen=True, eq=False)
class Leg:
    """A chain of joints whose last frame, turned by end_turn (3, 3), is the platform's or carries a bar to it.

    The first joint's frame is where the leg stands, no length of the robot.
    """

    name: str
    joints: tuple[Joint, ...]
    end_turn: FloatArray = field(default_factory=lambda: _NO_TURN)
    bar: Bar | None = None

    @property
    def bar_sites(self) -> tuple[str, ...]:
        """Names of the bar's site, whose x runs along it towards the platform, and of its end, in the platform's frame.

        Empty without a bar.
        """
        return (f"{self.name} bar", f"{self.name} end") if self.bar else ()


class Chain(NamedTuple):
    """A leg with m joints as arrays for compiled code.

    frames (m + 1, 4, 3): the placement before every joint and after the last, rows its axes and its place; motions (m,
    6): the twist of a joint's motion in its frame, shift first; numbers (m, 2): its site, and its column in
    passive values (k,) followed by driven ones (D,), -1 for a fixed joint.
    """

    frames: FloatArray
    motions: FloatArray
    numbers: IntArray


@dataclass(frozen=True, eq=False)
class Legs:
    """All legs of a robot, and the sites and values that they make.

    home_drives (K,), home_mm (3,), home_turn (3, 3): actuator values and the platform's pose at home, in the middle of
        the workspace.
    reflectors: names of the sites of reflectors that the tool carries, none where the tool itself is measured.
    coupling (D, K): driven values of joints and bars per actuator value, where some joints follow others; None where
        driven values are the actuator values.
    end_effectors: names of the targets on each end effector; empty where all legs hold one platform.
    """

    legs: tuple[Leg, ...]
    home_drives: FloatArray
    home_mm: FloatArray = field(default_factory=lambda: _NO_SHIFT)
    home_turn: FloatArray = field(default_factory=lambda: _NO_TURN)
    reflectors: tuple[str, ...] = ()
    coupling: FloatArray | None = None
    end_effectors: tuple[tuple[str, ...], ...] = ()

    def __post_init__(self) -> None:
        owner: dict[str, tuple[Joint, tuple[Joint, ...]]] = {}
        for leg in self.legs:
            for number, joint in enumerate(leg.joints):
                before = leg.joints[:number]
                if owner.setdefault(joint.name, (joint, before)) != (joint, before):
                    raise ConfigError(f"joint {joint.name} of {leg.name}: another leg has it behind other joints")
        if self.coupling is not None and len(self.coupling) != len(self.driven_kinds):
            rows = f"{len(self.coupling)} rows for {len(self.driven_kinds)} driven values"
            raise ConfigError(f"the coupling has {rows}; allowed: one each")

    @property
    def arm_joints(self) -> tuple[str, ...]:
        """Names of the turning joints of an arm (one leg without a bar) or of several arms; else none."""
        if (len(self.legs) > 1 and not self.end_effectors) or self.legs[0].bar:
            return ()
        return tuple(joint.name for joint in self.joints if joint.kind == "R")

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """All joints, each once, in the order of the legs."""
        return tuple({joint.name: joint for leg in self.legs for joint in leg.joints}.values())

    @cached_property
    def passive_joints(self) -> tuple[Joint, ...]:
        """The passive joints: the meaning of every vector of passive values."""
        return tuple(joint for joint in self.joints if joint.passive)

    @cached_property
    def driven_kinds(self) -> tuple[str, ...]:
        """Kind of every driven value, "R" or "P"."""
        kinds = {joint.drive: joint.kind for joint in self.joints if joint.drive is not None}
        kinds |= {leg.bar.drive: "P" for leg in self.legs if leg.bar and leg.bar.drive is not None}
        return tuple(kinds[drive] for drive in sorted(kinds))

    def driven(self, actuators: FloatArray) -> FloatArray:
        """Driven values (n, D) at actuator values (n, K)."""
        return actuators if self.coupling is None else actuators @ self.coupling.T

    def per_actuator(self, columns: FloatArray) -> FloatArray:
        """Columns (.., K) per actuator value from those (.., D) per driven value."""
        return columns if self.coupling is None else columns @ self.coupling

    @cached_property
    def uncoupled(self) -> "Legs":
        """The legs with a drive of its own for every driven value."""
        return replace(self, coupling=None, home_drives=self.driven(self.home_drives))

    @cached_property
    def sites(self) -> tuple[str, ...]:
        """Names of all sites: world, then leg by leg the joints' seats, bar and end, then tool and its reflectors."""
        names = [name for leg in self.legs for name in (*(joint.name for joint in leg.joints), *leg.bar_sites)]
        return (WORLD, *dict.fromkeys(names), TOOL, *self.reflectors)

    @cached_property
    def site_numbers(self) -> dict[str, int]:
        """Number of every site by its name."""
        return {name: number for number, name in enumerate(self.sites)}

    @cached_property
    def passive_numbers(self) -> dict[str, int]:
        """Number of every passive joint by its name."""
        return {joint.name: number for number, joint in enumerate(self.passive_joints)}

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Numbers of the legs of each group: legs that share passive joints, or all legs of several end effectors."""
        if self.end_effectors:
            return (tuple(range(len(self.legs))),)
        result: list[list[int]] = []
        for number, leg in enumerate(self.legs):
            passive = {joint.name for joint in leg.joints if joint.passive}
            # shared joints precede the branching, so the first leg of a group has them as all others do
            near = (group for group in result if passive & {joint.name for joint in self.legs[group[0]].joints})
            group = next(near, None)
            if group is None:
                result.append([number])
            else:
                group.append(number)
        return tuple(map(tuple, result))

    @cached_property
    def chains(self) -> dict[str, Chain]:
        """The Chain of every leg by its name."""
        return {leg.name: self._chain(leg) for leg in self.legs}

    def _chain(self, leg: Leg) -> Chain:
        """The Chain of a leg."""
        frames = [np.vstack([joint.turn.T, joint.shift_mm]) for joint in leg.joints]
        frames.append(np.vstack([leg.end_turn.T, _NO_SHIFT]))
        motions = [np.concatenate([joint.axis * (joint.kind == kind) for kind in "PR"]) for joint in leg.joints]
        numbers = [(self.site_numbers[joint.name], self._column(joint)) for joint in leg.joints]
        return Chain(np.array(frames), np.reshape(motions, (-1, 6)), np.reshape(numbers, (-1, 2)).astype(np.int64))

    def _column(self, joint: Joint) -> int:
        """Column of a joint's value in passive values followed by driven ones, -1 for a fixed joint."""
        if joint.kind == "fixed":
            return -1
        return self.passive_numbers[joint.name] if joint.drive is None else len(self.passive_joints) + joint.drive

    @property
    def parallel(self) -> bool:
        """Whether there are as many legs as driven values: a parallel robot, no arm."""
        return len(self.legs) >= len(self.driven_kinds)

    def longest_mm(self, first: int, travel: FloatArray) -> float:
        """Upper bound in mm of the length of the legs from their joints of this number on to the platform's frame.

        Slides and bars are out as far as they go. travel (K,): largest absolute value of each actuator.
        """
        far = travel if self.coupling is None else np.abs(self.coupling) @ travel
        return float(max(self._length_mm(leg, first, far) for leg in self.legs))

    def _length_mm(self, leg: Leg, first: int, far: FloatArray) -> float:
        """Length of a leg from its joint of this number on, its driven values (D,) as far out as they go."""
        slides = sum(far[joint.drive] for joint in leg.joints if joint.kind == "P" and joint.drive is not None)
        length = sum(np.linalg.norm(joint.shift_mm) for joint in leg.joints[first:]) + slides
        if leg.bar is None:
            return float(length)
        driven = 0.0 if leg.bar.drive is None else far[leg.bar.drive]
        return float(length + leg.bar.length_mm + driven + np.linalg.norm(leg.bar.platform_mm))

    @property
    def home_passive(self) -> FloatArray:
        """Values (k,) of the passive joints from which searches start."""
        return np.array([joint.home for joint in self.passive_joints])


@dataclass(frozen=True, eq=False)
class Drive:
    """One actuator value: its column in tables, its unit ("rad", "mm"), and what it moves.

    site, twist (6,): a change of the value acts as this twist per unit at this site.
    others: twists (6,) per unit by site of further joints that follow it.
    """

    column: str
    unit: str
    site: str
    twist: FloatArray
    others: dict[str, FloatArray] = field(default_factory=dict)

    @property
    def twists(self) -> dict[str, FloatArray]:
        """Twists (6,) per unit by site."""
        return {self.site: self.twist} | self.others


@dataclass(frozen=True, eq=False)
class Parts:
    """Which sites of a robot the effects act on, by legs or drives, from the first to the last.

    drives: of every actuator value.
    feet: sites at which the legs stand on the base, x outwards and y to the side.
    links: by name of a length, by leg the sites whose x axis is along it, several for a leg of several bars.
    members: by leg the sites of the links that push the platform.
    held_from: by leg the site from which the leg acts as one two-force member while friction holds its inner joint;
        empty where no joint can be held.
    followers: joints that follow drives and have no actuator of their own, described as Drives.
    """

    drives: tuple[Drive, ...]
    feet: tuple[str, ...] = ()
    links: dict[str, tuple[tuple[str, ...], ...]] = field(default_factory=dict)
    members: tuple[tuple[str, ...], ...] = ()
    held_from: tuple[str, ...] = ()
    followers: tuple[Drive, ...] = ()

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of every actuator value."""
        return tuple(drive.unit for drive in self.drives)

    @property
    def columns(self) -> list[str]:
        """Columns of the actuator values in tables."""
        return [drive.column for drive in self.drives]


def unit_twist(component: int, factor: float = 1.0) -> FloatArray:
    """The twist (6,) of one component, shift along x, y, z in mm and turn about them in rad."""
    result = np.zeros(6)
    result[component] = factor
    return result


def rigid_motions(place_mm: FloatArray) -> FloatArray:
    """Displacements (n, 3, 6) of places (n, 3) of a body by its small motions: shifts, then turns about the origin."""
    turned = np.cross(np.eye(3)[None], place_mm[:, None]).transpose(0, 2, 1)
    return np.concatenate([np.broadcast_to(np.eye(3), turned.shape), turned], axis=2)


def cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """Cross products (.., 3) of vectors (.., 3); `np.cross` is slower for few vectors, by its checks of the shapes."""
    result = np.empty(np.broadcast_shapes(np.shape(first), np.shape(second)))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        result[..., k] = first[..., i] * second[..., j] - first[..., j] * second[..., i]
    return result


def turn_about(axis: FloatArray, angle_rad: npt.ArrayLike) -> FloatArray:
    """Rotation matrices (..., 3, 3) about a unit axis (3,) by angles (...,)."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = np.asarray(angle_rad, dtype=float)[..., None, None]
    return np.asarray(_NO_TURN + np.sin(angle) * skew + (1.0 - np.cos(angle)) * (skew @ skew))
