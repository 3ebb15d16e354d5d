"""Legs from the paths of an Assembly, for `rrru.formats.robot_file`: every joint a site of its name in the file.

A leg ends in a bar if its last joints, none passive before them, are two groups of passive turns about axes through one
point, three and two or three of them, and between both nothing or a driven slide along the line from point to point.
Lengths in mm, angles in rad.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rrru.formats.joint_graph import Move, placed
from rrru.formats.mjcf_reader import Assembly
from rrru.kinematics.chain import Twists, Walk, walk
from rrru.kinematics.legs import TOOL, WORLD, Bar, Joint, Leg, Legs, Z, turn_about
from rrru.kinematics.point_masses import PLATFORM
from rrru.kinematics.wrenches import rank_of, screw

# axes meet in a point and a slide goes along a line to within this, in mm and rad
_MEET_MM, _ALONG = 1e-6, 1e-9


@dataclass(frozen=True)
class Place:
    """Where a part is: behind the motion of a joint, by numbers of leg and joint, with a placement (4, 4)."""

    leg: int
    joint: int
    placement: np.ndarray


@dataclass(frozen=True, eq=False)
class Cut:
    """Where a leg was cut to end in a bar: the joint behind the bar, by its name, and the bar's line in its frame."""

    behind: str
    along: np.ndarray


class Chains:
    """The legs of an Assembly as chains of joints.

    driven: MuJoCo's numbers of joints in the order of the driven values; offsets: by joint what is added to its value.

    legs: the chains; assembly; parts: Places by part; sites: of the Moves, by their names; seats: by site the placement
    of the joint's frame in the Move's.
    """

    def __init__(self, assembly: Assembly, driven: Sequence[int], offsets: Mapping[int | None, float]) -> None:
        self.assembly, self._offsets = assembly, offsets
        self._drives: dict[int | None, int] = {joint: number for number, joint in enumerate(driven)}
        names = [f"leg {k}" for k in range(1, len(assembly.paths) + 1)] if len(assembly.paths) > 1 else ["arm"]
        self._taken = {WORLD, TOOL, PLATFORM, *(f"{name} {end}" for name in names for end in ("ball", "bar", "end"))}
        self._made: dict[tuple[tuple[int, ...], int], Joint] = {}
        self.parts: dict[int, Place] = {}
        self.legs: tuple[Leg, ...] = ()
        self.seats: dict[str, np.ndarray] = {}
        self.sites = {name: self._unique(name) for name in assembly.moves}
        base = Joint(self._unique("base"))
        for name, path in zip(names, assembly.paths, strict=True):
            self.legs += (self._leg(name, path, base),)
        self._refuse_shared()

    def _unique(self, name: str) -> str:
        """A name of a site that no other has."""
        number, result = 1, name
        while result in self._taken:
            number += 1
            result = f"{name} {number}"
        self._taken.add(result)
        return result

    def _leg(self, name: str, path: tuple[int, ...], base: Joint) -> Leg:
        """The chain of a path of seams."""
        joints, placement, part = [base], np.eye(4), self.assembly.base
        for number, seam in enumerate(path):
            for k, item in enumerate(self.assembly.seams[seam].items_from(part)):
                if isinstance(item, Move):
                    joint, after = self._joint((path[: number + 1], k), item, placement)
                    joints.append(joint)
                    placement = after
                else:
                    placement = placement @ item
            part = self.assembly.seams[seam].other(part)
            self.parts.setdefault(part, Place(len(self.legs), len(joints) - 1, placement))
        end = Joint(self._unique(f"{name} {PLATFORM}"), "fixed", Z, placement[:3, 3], placement[:3, :3])
        return Leg(name, (*joints, end))

    def _joint(self, key: tuple[tuple[int, ...], int], move: Move, placement: np.ndarray) -> tuple[Joint, np.ndarray]:
        """The Joint of a Move behind a placement, one for all legs that have it, and the placement behind it.

        An axis that is none of its frame's becomes the z of another frame, so that a drive's error is one number.
        """
        turn = np.eye(3)
        if np.abs(move.axis).max() < 1.0 - 1e-12:
            x = np.cross(np.eye(3)[np.abs(move.axis).argmin()], move.axis)
            x /= np.linalg.norm(x)
            turn = np.stack([x, np.cross(move.axis, x), move.axis], axis=1)
        if key not in self._made:
            seat = placed(turn=turn)
            drive = self._drives.get(move.joint)
            axis = move.axis if np.array_equal(turn, np.eye(3)) else Z
            if offset := self._offsets.get(move.joint, 0.0):
                seat = seat @ (placed(turn=turn_about(axis, offset)) if move.kind == "R" else placed(offset * axis))
            frame = placement @ seat
            self.seats[self.sites[move.name]] = seat
            home = 0.0 if drive is not None else move.home
            self._made[key] = Joint(self.sites[move.name], move.kind, axis, frame[:3, 3], frame[:3, :3], drive, home)
        return self._made[key], placed(turn=turn.T)

    def _refuse_shared(self) -> None:
        """Raise ConfigError for joints that several legs have and cannot."""
        owners: dict[str, list[tuple[str, Joint]]] = {}
        for leg in self.legs:
            for joint in leg.joints:
                owners.setdefault(joint.name, []).append((leg.name, joint))
        for name, legs in owners.items():
            by = ", ".join(leg for leg, _ in legs)
            if len({id(joint) for _, joint in legs}) > 1:
                text = f"joint {name} is in {by}, behind different joints; allowed: legs that part once and meet at the"
                raise self.assembly.error(f"{text} platform")


def with_bars(legs: Legs) -> tuple[tuple[Leg, ...], dict[int, Cut]]:
    """The legs of Legs at the home pose, ended in bars where possible, and the Cuts of these by number."""
    actuators, passive = legs.home_drives[None], legs.home_passive[None]
    ways = [walk(legs, leg, actuators, passive, Twists(legs)) for leg in legs.legs]
    alone = {group[0] for group in legs.groups if len(group) == 1}
    drives = legs.driven(actuators)[0]
    pairs = [_with_bar(leg, ways[k], drives) if k in alone else (leg, None) for k, leg in enumerate(legs.legs)]
    return tuple(leg for leg, _ in pairs), {number: cut for number, (_, cut) in enumerate(pairs) if cut}


def _with_bar(leg: Leg, way: Walk, drives: np.ndarray) -> tuple[Leg, Cut | None]:
    """A leg as one that ends in a bar and its Cut, None if it does not; way: its Walk at the driven values `drives`."""
    first = next((k for k, joint in enumerate(leg.joints) if joint.passive), None)
    tail = range(first or 0, len(leg.joints) - 1)
    slides = [k for k in tail if leg.joints[k].kind == "P"]
    turns = [k for k in tail if leg.joints[k].passive and leg.joints[k].kind == "R"]
    if first is None or len(turns) + len(slides) < len(tail) or len(turns) not in (5, 6) or len(slides) > 1:
        return leg, None
    if rank_of(np.stack([screw(leg.joints[k], way.axes[k], way.places[k])[0] for k in turns], axis=1)) != 5:
        return leg, None
    for cut in [sum(k < slides[0] for k in turns)] if slides else (2, 3):
        near, far = (_meeting(way, part) for part in (turns[:cut], turns[cut:]))
        if near is None or far is None:
            continue
        length, drive = np.linalg.norm(far - near), None
        if slides:
            slide, axis = leg.joints[slides[0]], way.axes[slides[0]][0]
            if slide.drive is None or np.linalg.norm(far - near - length * axis) > _ALONG * length:
                return leg, None
            length, drive = length - drives[slide.drive], slide.drive
        at = leg.joints[first]
        offset = way.turns[first][0].T @ (near - way.places[first][0])
        seat = Joint(f"{leg.name} ball", "fixed", Z, at.shift_mm + at.turn @ offset)
        bar = Bar(float(length), way.turn[0].T @ (far - way.place[0]), drive)
        line = (far - near) / np.linalg.norm(far - near)
        behind = Cut(leg.joints[turns[cut]].name, way.turns[turns[cut]][0].T @ line)
        return replace(leg, joints=(*leg.joints[:first], seat), bar=bar), behind
    return leg, None


def _meeting(way: Walk, joints: Sequence[int]) -> np.ndarray | None:
    """The point (3,) in which the axes of two or three joints meet, None if they do not."""
    if len(joints) not in (2, 3):
        return None
    across = [np.eye(3) - np.outer(way.axes[k][0], way.axes[k][0]) for k in joints]
    if np.linalg.cond(sum(across)) > 1e8:
        return None
    point = np.linalg.solve(sum(across), sum(one @ way.places[k][0] for one, k in zip(across, joints, strict=True)))
    off = [one @ (way.places[k][0] - point) for one, k in zip(across, joints, strict=True)]
    return point if np.linalg.norm(off) < _MEET_MM else None
