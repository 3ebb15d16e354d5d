"""Newton on any robot's closed legs in NumPy, all points at once: slow and plain, with the helpers of the package.

T is the platform's twist, S_i a leg's passive screws, e_i what it lacks, P_i the projector off S_i:

    sum P_i T = sum P_i e_i,   dp_i = S_i^+ (T - e_i)

A bar has w w^T / l in place of P_i, w its line and l its length. Lengths in mm, angles in rad; in twists lengths are
counted in 500 mm.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.kinematics.chain import Poses, Twists, Walk, value_of
from rrru.kinematics.closure import Closure
from rrru.kinematics.legs import cross, turn_about
from rrru.kinematics.wrenches import screw

_CHARACTERISTIC_LENGTH_MM = 500.0
_SCALE = np.repeat([_CHARACTERISTIC_LENGTH_MM, 1.0], 3)
_LONGEST_MM, _LONGEST_RAD = 150.0, 0.3


def solve(legs, actuators, start, twists=None):
    """Poses at actuator values (n, K) next to the Poses `start`, under twists (n or 1, sites, 6); NaN where none."""
    actuators, every, n = np.asarray(actuators, dtype=float), Twists(legs, twists), len(actuators)
    position, turn, passive = (np.array(part, dtype=float) for part in (start.position_mm, start.turn, start.passive))
    ranks, left = [6 - (rows.stop - rows.start) for rows in Closure(legs).rows], np.full(n, np.inf)
    turning = np.array([joint.kind == "R" for joint in legs.passive_joints], dtype=bool)
    known = [np.isfinite(part).reshape(n, -1).all(axis=1) for part in (actuators, position, turn, passive)]
    rows = np.flatnonzero(np.all(known, axis=0))
    for _ in range(60):
        if not len(rows):
            break
        here = Poses(position[rows], turn[rows], passive[rows], None, None)
        shift, rotation, change = _step(legs, ranks, actuators[rows], here, every.of(rows))
        moved = np.linalg.norm(shift, axis=1)
        turned = np.maximum(np.linalg.norm(rotation, axis=1), np.abs(change[:, turning]).max(axis=1, initial=0.0))
        slid = np.abs(change[:, ~turning]).max(axis=1, initial=0.0)
        with np.errstate(divide="ignore"):
            share = np.minimum(1.0, np.minimum(_LONGEST_MM / moved, _LONGEST_RAD / turned))[:, None]
        position[rows] += share * shift
        turn[rows] = Rotation.from_rotvec(share * rotation).as_matrix() @ turn[rows]
        passive[rows] += share * change
        left[rows] = np.maximum(np.maximum(moved, slid), _CHARACTERISTIC_LENGTH_MM * turned)
        rows = rows[~(left[rows] < 1e-10)]
    closed = left < 1e-7
    for part in (position, turn, passive):
        part[~closed] = np.nan
    return Poses(position, turn, passive, left, closed)


def walk(legs, leg, actuators, passive, twists):
    """The Walk of a leg at actuator values (n, K) and passive values (n, k) under Twists."""
    turn, place = np.broadcast_to(np.eye(3), (len(actuators), 3, 3)), np.zeros((len(actuators), 3))
    turns, places, axes = [], [], []
    for joint in leg.joints:
        place, turn = place + turn @ joint.shift_mm, turn @ joint.turn
        turns.append(turn)
        twist = twists.values[:, legs.site_numbers[joint.name]]
        place = place + (turn @ twist[:, :3, None])[..., 0]
        turn = turn @ Rotation.from_rotvec(twist[:, 3:]).as_matrix()
        places.append(place)
        axes.append(np.zeros_like(place) if joint.kind == "fixed" else turn @ joint.axis)
        if joint.kind == "R":
            turn = turn @ turn_about(joint.axis, value_of(legs, joint, actuators, passive))
        elif joint.kind == "P":
            place = place + value_of(legs, joint, actuators, passive)[:, None] * axes[-1]
    return Walk(tuple(turns), tuple(places), tuple(axes), turn @ leg.end_turn, place)


def bar_ends(legs, leg, way, poses, actuators, twists):
    """Both ball joints (n, 3) of a leg's bar and its length (n,), at platform poses."""
    bar_site, end_site = (legs.site_numbers[name] for name in leg.bar_sites)
    point = leg.bar.platform_mm - twists.values[:, end_site, :3]
    far = poses.position_mm + np.einsum("nij,nj->ni", poses.turn, np.broadcast_to(point, way.place.shape))
    driven = 0.0 if leg.bar.drive is None else legs.driven(actuators)[:, leg.bar.drive]
    return way.place, far, leg.bar.length_mm + twists.values[:, bar_site, 0] + driven


def _step(legs, ranks, actuators, poses, twists):
    """Shift (n, 3) and rotation (n, 3) of the platform and changes (n, k) of the passive joints."""
    total, pull, chains = 0.0, 0.0, []
    for leg, rank in zip(legs.legs, ranks, strict=True):
        way = walk(legs, leg, actuators, poses.passive, twists)
        if leg.bar:
            near, far, length = bar_ends(legs, leg, way, poses, actuators, twists)
            span = np.linalg.norm(far - near, axis=1)[:, None]
            line = (far - near) / span
            line = np.concatenate([line, cross(near, line)], axis=1) * _SCALE / _CHARACTERISTIC_LENGTH_MM
            stiff = line * _CHARACTERISTIC_LENGTH_MM / span
            total = total + stiff[:, :, None] * line[:, None, :]
            pull = pull + stiff * (length[:, None] - span) / _CHARACTERISTIC_LENGTH_MM
        else:
            u, size, v = np.linalg.svd(_passive_screws(leg, way) / _SCALE[:, None], full_matrices=False)
            u, size, v = u[:, :, :rank], size[:, None, :rank], v[:, :rank]
            lack, off = lack_of(way, poses) / _SCALE, np.eye(6) - u @ u.transpose(0, 2, 1)
            total, pull = total + off, pull + (off @ lack[:, :, None])[:, :, 0]
            chains.append((leg, lack, (v.transpose(0, 2, 1) / size) @ u.transpose(0, 2, 1)))
    scaled = np.linalg.solve(total, pull[:, :, None])[:, :, 0]
    change = np.zeros_like(poses.passive)
    for leg, lack, inverse in chains:
        numbers = [legs.passive_numbers[joint.name] for joint in leg.joints if joint.passive]
        change[:, numbers] = (inverse @ (scaled - lack)[:, :, None])[:, :, 0]
    twist = scaled * _SCALE
    return twist[:, :3] + np.cross(twist[:, 3:], poses.position_mm), twist[:, 3:], change


def _passive_screws(leg, way):
    """Screws (n, 6, k) of a leg's passive joints at the world's origin."""
    every = zip(leg.joints, way.axes, way.places, strict=True)
    screws = [screw(joint, axis, place) for joint, axis, place in every if joint.passive]
    return np.stack(screws, axis=-1) if screws else np.zeros((len(way.place), 6, 0))


def lack_of(way, poses):
    """The small twist (n, 6) at the world's origin from the platform's pose to the end of a chain."""
    off = way.turn @ poses.turn.transpose(0, 2, 1)
    turn = 0.5 * np.stack(
        [off[:, 2, 1] - off[:, 1, 2], off[:, 0, 2] - off[:, 2, 0], off[:, 1, 0] - off[:, 0, 1]], axis=1
    )
    shift = way.place - poses.position_mm - np.cross(turn, poses.position_mm)
    return np.concatenate([shift, turn], axis=1)
