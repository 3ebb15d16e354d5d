"""Changes of a robot's file by small geometric errors of its legs.

A twist at a site is a placement T before the motion of the site's joint. In the file a body's joints S move it from its
placement P in its parent's frame. With all T that act there its placement is

    P X_0 S_1 X_1 .. S_n X_n

with X in the body's own frame. A connect's anchors move with the T before and behind it. No file can represent an
error between two axes of one ball joint. Lengths in mm, angles in rad; placements are (4, 4).
"""

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias, TypeVar

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from rrru.formats.joint_graph import Move, Seam, inverse_placement, placed
from rrru.formats.mjcf_reader import MEASURED_TOOL, Assembly, ends_of
from rrru.formats.structure import Structure
from rrru.kinematics.base_parameters import Candidate
from rrru.kinematics.legs import TOOL, WORLD

_BALL = mujoco.mjtJoint.mjJNT_BALL
_NO_TWIST, _NO_CHANGE = np.zeros(6), (np.eye(4), "")
# smaller changes, in mm and rad, are rounding
SAME = 1e-10

# twists (6,), or (q, 6) of q independent errors, by site
TwistsBySite: TypeAlias = Mapping[str, np.ndarray]
# placements by the number of the item before which they act, each with its site
_ActsAt: TypeAlias = dict[int, tuple[np.ndarray, str]]
Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True)
class Changes:
    """bodies: by number the placements X, one more than it has joints; anchors: by connect's number its points on its
    first and second body (3,); frames: by name places on the platform; lost: what no file can represent, in words.
    """

    bodies: dict[int, tuple[np.ndarray, ...]]
    anchors: dict[int, tuple[np.ndarray, ...]]
    frames: dict[str, np.ndarray]
    lost: tuple[str, ...]


@dataclass(frozen=True)
class Found:
    """Results of a diagnosis that a robot's file may represent.

    twists: (6,) by site; spread: (q, 6) by site, changes of the twists by q independent errors of one standard
    deviation each; reflectors: place (3,) on the platform, before its twist, by the site of each one that was read;
    tool_mm (3,): the measured point; compliance, play (the backlash): by number of the drive (value, standard error),
    in rad/(N mm) or mm/N, and in rad or mm; loads: by drive the largest one, in N mm or N.
    """

    twists: TwistsBySite
    spread: TwistsBySite = field(default_factory=dict)
    reflectors: Mapping[str, np.ndarray] = field(default_factory=dict)
    tool_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    compliance: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    play: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    loads: Mapping[int, float] = field(default_factory=dict)


def changes_of(structure: Structure, found: Found, twists: TwistsBySite) -> Changes:
    """The Changes that twists (6,) by site make in the file of a Structure; found: of its reflectors."""
    assembly = structure.assembly
    lost: list[str] = []
    between, tip = _between(structure, twists, lost)
    bodies: dict[int, tuple[np.ndarray, ...]] = {}
    anchors: dict[int, tuple[np.ndarray, ...]] = {}
    for number in sorted({number for path in assembly.paths for number in path}):
        seam, placements = assembly.seams[number], between.get(number, {})
        if seam.body is None:
            anchors |= _anchors(assembly, seam, placements, lost)
        else:
            bodies[seam.body] = _of_body(assembly, seam, placements, lost)
    if tip is not None:
        bodies[assembly.platform] = (tip,)
    return Changes(bodies, anchors, _frames(found, twists), tuple(dict.fromkeys(lost)))


def held_by(structure: Structure, candidates: Iterable[Candidate]) -> list[str]:
    """Names of the Candidates whose twists the file of a Structure can represent."""
    return [candidate.name for candidate in candidates if not changes_of(structure, Found({}), candidate.twists).lost]


def scatter(
    numbers: Callable[[TwistsBySite], dict[Key, np.ndarray]], twists: TwistsBySite, spread: TwistsBySite
) -> dict[Key, np.ndarray]:
    """Standard errors by key of the results of `numbers` for twists (6,) by site, under the spread (q, 6) by site.

    Those of vectors (3,) are (3,), those of placements (6,): of the shift, and of the turn about the own axes.
    """
    squares: dict[Key, np.ndarray] = {}
    count = max((len(part) for part in spread.values()), default=0)
    for k in range(count):
        steps = ({s: sign * part[k] for s, part in spread.items()} for sign in (-1.0, 1.0))
        low, high = (
            numbers({**twists, **{s: twists.get(s, _NO_TWIST) + d for s, d in step.items()}}) for step in steps
        )
        for key, value in high.items():
            squares[key] = squares.get(key, 0.0) + (0.5 * difference(low[key], value)) ** 2
    return {key: np.sqrt(value) for key, value in squares.items()}


def difference(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Difference of two vectors (3,), or of two placements: shift, and turn about the own axes."""
    if high.ndim == 1:
        return np.asarray(high - low)
    return np.concatenate([high[:3, 3] - low[:3, 3], Rotation.from_matrix(low[:3, :3].T @ high[:3, :3]).as_rotvec()])


def placement_of(twist: np.ndarray) -> np.ndarray:
    """The placement of a twist (6,)."""
    return placed(twist[:3], Rotation.from_rotvec(twist[3:]).as_matrix())


def _frames(found: Found, twists: TwistsBySite) -> dict[str, np.ndarray]:
    """Places on the platform of the tool, where it has moved, and of the reflectors."""
    twist, tool_mm, frames = twists.get(TOOL, _NO_TWIST), np.asarray(found.tool_mm), {}
    tool = placement_of(twist)
    if np.any(twist):
        frames[MEASURED_TOOL] = placed(tool_mm) @ tool
    for name, place in found.reflectors.items():
        at = placed(tool_mm) @ tool @ placed(place - tool_mm)
        frames[name] = placed(twists.get(name, _NO_TWIST)[:3]) @ at
    return frames


def _between(
    structure: Structure, twists: TwistsBySite, lost: list[str]
) -> tuple[dict[int, _ActsAt], np.ndarray | None]:
    """Placements by number of the seam and of its item before which they act, from near to far, each with its site.

    Also the change of the place of a platform that is fixed to the last body of a chain, None where it is not.
    """
    assembly, by_site = structure.assembly, _of_chains(structure, twists)
    first_site = structure.open_legs.legs[0].joints[0].name
    base = placement_of(twists.get(WORLD, _NO_TWIST)) @ by_site.get(first_site, np.eye(4))
    result: dict[int, _ActsAt] = {}
    ends: dict[int, np.ndarray] = {}
    tip = None
    for path, leg in zip(assembly.paths, structure.open_legs.legs, strict=True):
        part = assembly.base
        for number in path:
            seam, at = assembly.seams[number], result.setdefault(number, {})
            forward = part == seam.near
            for k, item in enumerate(seam.items):
                site = structure.chains.sites[item.name] if isinstance(item, Move) else None
                if site is not None and site in by_site:
                    seat = structure.chains.seats[site]
                    acts = seat @ by_site[site] @ inverse_placement(seat)
                    at[k if forward else k + 1] = (acts if forward else inverse_placement(acts)), site
            part = seam.other(part)
        first, last, end = path[0], path[-1], by_site.get(leg.joints[-1].name, np.eye(4))
        _at_end(result, assembly.seams[first], first, assembly.base, base)
        if _is_chain_tip(assembly, last):
            tip = end
        elif np.allclose(ends.setdefault(last, end), end, rtol=0.0, atol=1e-12):
            _at_end(result, assembly.seams[last], last, assembly.platform, inverse_placement(end))
        else:
            lost.append(f"{leg.joints[-1].name}: legs that meet before the platform end at one place")
    return result, tip


def _at_end(result: dict[int, _ActsAt], seam: Seam, number: int, part: int, placement: np.ndarray) -> None:
    """Enter the placement that moves the end of a seam at a part; the placement is in this part's frame."""
    if part == seam.near:
        result[number][0] = placement, ""
    else:
        result[number][len(seam.items)] = inverse_placement(placement), ""


def _is_chain_tip(assembly: Assembly, last: int) -> bool:
    """Whether the platform is a body without joints that one chain ends in, so that its own place can be changed."""
    model, body, seam = assembly.model, assembly.platform, assembly.seams[last]
    if len(assembly.paths) > 1 or model.body_jntnum[body] or seam.body is None or seam.far != assembly.platform:
        return False
    while body and not model.body_jntnum[body]:
        body = int(model.body_parentid[body])
    return body == seam.body


def _of_chains(structure: Structure, twists: TwistsBySite) -> dict[str, np.ndarray]:
    """Placements by site of the chains without bars."""
    result = {name: placement_of(twist) for name, twist in twists.items() if np.any(twist)}
    for number, cut in structure.cuts.items():
        leg, chain = structure.legs.legs[number], structure.open_legs.legs[number]
        seat, (bar, end) = chain.joints[len(leg.joints) - 1], leg.bar_sites
        near, length, far = (twists.get(name, _NO_TWIST) for name in (leg.joints[-1].name, bar, end))
        result[seat.name] = placed(seat.turn.T @ near[:3])
        result[cut.behind] = placed(length[0] * cut.along)
        result[chain.joints[-1].name] = placed(far[:3])
    return result


def _of_body(assembly: Assembly, seam: Seam, between: _ActsAt, lost: list[str]) -> tuple[np.ndarray, ...]:
    """The placements X of a body with joints."""
    model, items = assembly.model, seam.items
    first, result = int(model.body_jntadr[seam.body]), [np.eye(4) for _ in range(int(model.body_jntnum[seam.body]) + 1)]
    joints = [(k, item.joint) for k, item in enumerate(items) if isinstance(item, Move) and item.joint is not None]
    # the value of a ball joint at home is a turn behind its axes
    balls = {k + 1 for k, joint in joints if model.jnt_type[joint] == _BALL and not isinstance(items[k + 1], Move)}
    here, places = np.eye(4), [inverse_placement(seam.placement(0))]
    for k, item in enumerate(items[1:], 1):
        places.append(here @ inverse_placement(seam.placement(k)) if k in balls else here)
        here = here if isinstance(item, Move) or k in balls else here @ item
    places.append(here)
    for k, (placement, site) in sorted(between.items()):
        before, behind = ([joint for at, joint in joints if (at < k) == side] for side in (True, False))
        if before and behind and before[-1] == behind[0]:
            _lose(lost, site, placement)
            continue
        slot = before[-1] - first + 1 if before else 0
        acts = places[k] @ placement @ inverse_placement(places[k])
        result[slot] = acts @ result[slot] if k == 0 else result[slot] @ acts
    return tuple(result)


def _anchors(assembly: Assembly, seam: Seam, between: _ActsAt, lost: list[str]) -> dict[int, tuple[np.ndarray, ...]]:
    """Points (3,) of the connects of a seam on their first and second bodies."""
    moves = [k for k, item in enumerate(seam.items) if isinstance(item, Move)]
    near, far = np.eye(4), np.eye(4)
    for k in range(len(seam.items)):
        if k > moves[-1]:
            far = far @ between.get(k, _NO_CHANGE)[0] @ seam.placement(k)
        elif k <= moves[0]:
            near = near @ between.get(k, _NO_CHANGE)[0] @ (np.eye(4) if k == moves[0] else seam.placement(k))
        elif k in between:
            _lose(lost, between[k][1], between[k][0])
    far = far @ between.get(len(seam.items), _NO_CHANGE)[0]
    moved = {
        seam.near: near @ inverse_placement(seam.placement(0)),
        seam.far: inverse_placement(far) @ seam.placement(moves[-1] + 1) @ seam.placement(-1),
    }
    result = {}
    for number in seam.connects:
        first, at_first, second, at_second = ends_of(assembly.model, number)
        result[number] = tuple(
            (inverse_placement(there) @ moved[part] @ there @ at)[:3, 3]
            for (part, there), at in ((assembly.frames[first], at_first), (assembly.frames[second], at_second))
        )
    return result


def _lose(lost: list[str], site: str, placement: np.ndarray) -> None:
    """Note a shift of one axis of a ball joint against another."""
    if np.abs(placement[:3, 3]).max() > 0.0:
        lost.append(f"{site}: the axes of a ball joint meet in a point")
