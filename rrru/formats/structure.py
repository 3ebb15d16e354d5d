"""The legs of an Assembly, closed at home, and which of the file's joints they come from.

`rrru.formats.robot_file` makes a robot of them, the writers find the file's places to change by them.

Lengths in mm, angles in rad.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.formats.chains import Chains, Cut, with_bars
from rrru.formats.couplings import JointCoupling, coupling_matrix
from rrru.formats.joint_graph import Move, inverse_placement, placed
from rrru.formats.mjcf_reader import Assembly
from rrru.kinematics.chain import PoseGuess, Twists, bar_pose, walk
from rrru.kinematics.closure import Closure
from rrru.kinematics.closure_kernel import CHARACTERISTIC_LENGTH_MM
from rrru.kinematics.legs import Legs
from rrru.kinematics.mobility import free_motions

# closure error that a loop may have at the file's home pose, whose numbers are often rounded; assumed
_MAX_OPEN_MM = 1.0
# closure error that may remain after closing it, where redundant joints do not fit each other; assumed
_MAX_REMAINING_MM = 0.01
# steps to legs that meet, of which each leaves what is of second order in their errors
_MEETING_STEPS = 5
# closure error below which it is closed already: rounding
_CLOSED_MM = 1e-9


@dataclass(frozen=True, eq=False)
class Structure:
    """The legs of an Assembly.

    chains: Chains of its joints; open_legs: Legs of these alone.
    cuts: by number of the leg the Cut of a leg that ends in a bar; legs: with these bars, closed at home.
    servos: by driven joint ranges (low, high) of qpos, in m or rad, that its servos allow.
    couplings: JointCoupling by following joint.
    up (3,): unit vector away from the ground.
    """

    assembly: Assembly
    chains: Chains
    open_legs: Legs
    cuts: dict[int, Cut]
    legs: Legs
    servos: Mapping[int, Sequence[np.ndarray]]
    couplings: Mapping[int, JointCoupling]
    up: tuple[float, float, float]

    @property
    def joints(self) -> tuple[int, ...]:
        """MuJoCo's numbers of the driven joints, in the order of the drives, and after them of their followers."""
        return (*self.servos, *self.couplings)

    @property
    def driven(self) -> list[Move]:
        """Moves of the `joints`."""
        moves = self.assembly.moves.values()
        return [next(m for m in moves if m.joint == joint) for joint in self.joints]


def structure_of(
    assembly: Assembly,
    servos: Mapping[int, Sequence[np.ndarray]],
    couplings: Mapping[int, JointCoupling],
    up: tuple[float, float, float] | None = None,
) -> Structure:
    """The Structure of an Assembly.

    servos, couplings, up: as of the Structure, up by default against the file's gravity. Raises ConfigError where the
    legs do not hold the platform or do not close.
    """
    if not assembly.paths:
        raise assembly.error(f"no joints lead from the base to {assembly.body_name(assembly.platform)}; allowed: a leg")
    if not servos:
        raise assembly.error("no actuator drives a joint of the legs; allowed: one or more")
    offsets: dict[int | None, float] = {joint: one.offset for joint, one in couplings.items()}
    chains, home = Chains(assembly, [*servos, *couplings], offsets), inverse_placement(assembly.home_of(assembly.base))
    pose = home @ assembly.home_of(assembly.platform)
    values = np.array([next(m.home for m in assembly.moves.values() if m.joint == joint) for joint in servos])
    open_legs = Legs(chains.legs, values, pose[:3, 3], pose[:3, :3], coupling=coupling_matrix(servos, couplings))
    gravity = home[:3, :3] @ assembly.model.opt.gravity
    if up is None:
        up = tuple(-gravity / np.linalg.norm(gravity)) if gravity.any() else (0.0, 0.0, 1.0)
    with_bar, cuts = with_bars(open_legs)
    legs = _closed(assembly, replace(open_legs, legs=with_bar), up)
    return Structure(assembly, chains, open_legs, cuts, legs, servos, couplings, up)


def meeting_at_home(structure: Structure, twists: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Twists (6,) by site under which legs with redundant joints meet at home, with the platform where it was.

    Small errors of such legs contradict each other, as tilts of the cranks of a planar loop do, and the model meets
    them by least squares: at the pose T of the platform leg i ends at E_i. Moved as a whole by T E_i^-1 it ends there.
    Legs that meet already, legs with bars, whose lengths are measured by what they contradict each other in, and legs
    that share a moving joint stay.
    """
    legs, home, result = structure.legs, structure.legs.home_drives[None], dict(twists)
    first = [next((j.name for j in leg.joints if j.kind != "fixed"), "") for leg in legs.legs]
    if len(set(first)) < len(first) or any(leg.bar for leg in legs.legs):
        return result
    closure = Closure(legs)
    start = PoseGuess(legs.home_mm[None], legs.home_turn[None], legs.home_passive[None])
    for _ in range(_MEETING_STEPS):
        values = Twists(legs, np.stack([result.get(site, np.zeros(6)) for site in legs.sites]))
        poses = closure.solve(home, start, values.values)
        if not poses.closed.all() or _gaps(legs, poses, values).max() <= _MAX_REMAINING_MM:
            break
        platform = placed(poses.position_mm[0], poses.turn[0])
        for leg, site in zip(legs.legs, first, strict=True):
            way, number = walk(legs, leg, home, poses.passive, values), legs.site_numbers[site]
            joint = next(k for k, one in enumerate(leg.joints) if one.name == site)
            twist, turn = values.values[0, number], way.turns[joint, 0]
            seat = placed(way.places[joint, 0] - turn @ twist[:3], turn)
            moved = platform @ inverse_placement(placed(way.place[0], way.turn[0]))
            seated = placed(twist[:3], Rotation.from_rotvec(twist[3:]).as_matrix())
            new = inverse_placement(seat) @ moved @ seat @ seated
            result[site] = np.concatenate([new[:3, 3], Rotation.from_matrix(new[:3, :3]).as_rotvec()])
    return result


def _closed(assembly: Assembly, legs: Legs, up: tuple[float, float, float]) -> Legs:
    """Legs whose home pose closes all loops next to the file's; raises ConfigError where it cannot."""
    start = PoseGuess(legs.home_mm[None], legs.home_turn[None], legs.home_passive[None])
    gaps = _gaps(legs, start, Twists(legs))
    if gaps.max() > _MAX_OPEN_MM:
        joints = ", ".join(assembly.names_along(assembly.paths[gaps.argmax()]))
        text = f"the leg through {joints} misses the platform by {gaps.max():.3f} mm at the home pose"
        raise assembly.error(f"{text}; allowed: up to {_MAX_OPEN_MM:g} mm; a keyframe may set it")
    if free := free_motions(legs, up):
        text = f"body {assembly.body_name(assembly.platform)} is free to {'; '.join(free)} at the home pose"
        raise assembly.error(f"{text}; allowed: legs that hold it with locked drives")
    if gaps.max() < _CLOSED_MM:
        return legs
    poses = Closure(legs).solve(legs.home_drives[None], start)
    left = _gaps(legs, poses, Twists(legs)).max() if poses.closed.all() else gaps.max()
    if left > _MAX_REMAINING_MM:
        raise assembly.error(f"the loops stay open by {left:.3f} mm; allowed: up to {_MAX_REMAINING_MM:g} mm")
    homes = dict(zip((joint.name for joint in legs.passive_joints), poses.passive[0], strict=True))
    chains = tuple(
        replace(leg, joints=tuple(replace(j, home=homes[j.name]) if j.passive else j for j in leg.joints))
        for leg in legs.legs
    )
    return replace(legs, legs=chains, home_mm=poses.position_mm[0], home_turn=poses.turn[0])


def _gaps(legs: Legs, poses: PoseGuess, twists: Twists) -> np.ndarray:
    """Closure error (legs,) in mm of every leg at one pose with drives at home, under Twists.

    Of an end without a bar: its distance, and its angle in rad times CHARACTERISTIC_LENGTH_MM.
    """
    result, actuators = [], legs.home_drives[None]
    for leg in legs.legs:
        way = walk(legs, leg, actuators, poses.passive, twists)
        if leg.bar:
            result.append(abs(bar_pose(legs, leg, way, poses, actuators, twists).lack_mm[0]))
        else:
            off = Rotation.from_matrix(way.turn[0] @ poses.turn[0].T).magnitude()
            result.append(np.linalg.norm(way.place - poses.position_mm) + CHARACTERISTIC_LENGTH_MM * off)
    return np.array(result)
