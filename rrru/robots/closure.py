"""Any robot's legs closed exactly: Newton on the platform's pose and the passive joints, all n points at once.

With the pose T of the platform guessed, leg i ends elsewhere by the small twist e_i. With S_i its passive joints'
screws and W_i the wrenches that they do not feel, W_i S_i = 0, the step obeys

    T - S_i dp_i = e_i   =>   W_i T = W_i e_i,   stacked over the legs   A T = b,   dp_i = S_i^+ (T - e_i)

A bar has one wrench, the unit force along its line, and e_i the length that it lacks. More wrenches than six are met by
least squares. Screws and twists are at the world's origin, the velocity first: (v, w). Lengths in mm, angles in rad.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.errors import ConfigError
from rrru.robots.closure_kernel import ARM_MM
from rrru.robots.closure_tables import closed, tables
from rrru.robots.legs import turn_about

# passive motions that a leg's singular values, lengths counted in the arm, tell from none
_RANK = 1e-7
_SCALE = np.array([ARM_MM, ARM_MM, ARM_MM, 1.0, 1.0, 1.0])


@dataclass(frozen=True)
class Poses:
    """Platform poses at n points: position_mm (n, 3), turn (n, 3, 3), passive values (n, k), closed (n,).

    residual_mm (n,): what the closure lacks, angles counted at an arm of 500 mm.
    """

    position_mm: np.ndarray
    turn: np.ndarray
    passive: np.ndarray
    residual_mm: np.ndarray
    closed: np.ndarray

    def turned_from(self, turn):
        """Rotation vectors (n, 3) of the platform against orientations (n, 3, 3)."""
        off = self.turn @ np.swapaxes(turn, 1, 2)
        result, good = np.full(self.position_mm.shape, np.nan), np.isfinite(off).all(axis=(1, 2))
        result[good] = Rotation.from_matrix(off[good]).as_rotvec()
        return result

    def point(self, tool_mm):
        """Positions (n, 3) of a point (3,) or points (n or 1, 3) of the platform."""
        if not np.any(tool_mm):
            return self.position_mm
        return self.position_mm + (self.turn @ np.asarray(tool_mm)[..., None])[..., 0]

    def of(self, rows):
        """The poses of some rows."""
        return Poses(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class Walk:
    """One leg at n points, by the order of its joints: turns (n, 3, 3) and places (n, 3) of the seats' frames.

    Places are those after the seat's own twist, turns those before; axes (n, 3), None for a fixed joint. turn, place:
    of what follows the last joint, the platform's frame or a bar's first ball joint.
    """

    turns: tuple
    places: tuple
    axes: tuple
    turn: np.ndarray
    place: np.ndarray


class Twists:
    """Finite twists (n or 1, sites, 6) at the sites of Legs, shift first; most are none."""

    def __init__(self, legs, values=None):
        shape = (1, len(legs.sites), 6)
        self.values = np.zeros(shape) if values is None else np.asarray(values, dtype=float).reshape(-1, *shape[1:])
        self.active = frozenset(np.flatnonzero(self.values.any(axis=(0, 2))).tolist())

    @cached_property
    def turns(self):
        """Turns (n or 1, 3, 3) of the twists that turn, by the number of their site."""
        turned = [k for k in self.active if self.values[:, k, 3:].any()]
        return {k: Rotation.from_rotvec(self.values[:, k, 3:]).as_matrix() for k in turned}

    def of(self, rows):
        """The twists of some rows."""
        result, many = object.__new__(Twists), len(self.values) > 1
        result.active, result.values = self.active, self.values[rows] if many else self.values
        result.turns = {k: (turn[rows] if many else turn) for k, turn in self.turns.items()}
        return result


def walk(legs, leg, actuators, passive, twists):
    """The Walk of a leg at actuator values (n, K) and passive values (n, k) under Twists."""
    turn, place = np.broadcast_to(np.eye(3), (len(actuators), 3, 3)), np.zeros((len(actuators), 3))
    turns, places, axes = [], [], []
    for joint in leg.joints:
        place, turn = place + turn @ joint.shift_mm, turn @ joint.turn
        turns.append(turn)
        number = legs.site_numbers[joint.name]
        if number in twists.active:
            place = place + (turn @ twists.values[:, number, :3, None])[..., 0]
            turn = turn @ twists.turns[number] if number in twists.turns else turn
        places.append(place)
        axes.append(None if joint.kind == "fixed" else turn @ joint.axis)
        if joint.kind == "R":
            turn = turn @ turn_about(joint.axis, value_of(legs, joint, actuators, passive))
        elif joint.kind == "P":
            place = place + value_of(legs, joint, actuators, passive)[:, None] * axes[-1]
    return Walk(tuple(turns), tuple(places), tuple(axes), turn @ leg.end_turn, place)


def value_of(legs, joint, actuators, passive):
    """Values (n,) of a joint that moves, at actuator values (n, K) and passive values (n, k)."""
    return passive[:, legs.passive_numbers[joint.name]] if joint.passive else legs.driven(actuators)[:, joint.drive]


def bar_ends(legs, leg, way, poses, actuators, twists):
    """Both ball joints (n, 3) of a leg's bar and its length (n,), at platform poses."""
    bar_site, end_site = (legs.site_numbers[name] for name in leg.bar_sites)
    point = leg.bar.platform_mm - twists.values[:, end_site, :3]
    far = poses.position_mm + np.einsum("nij,nj->ni", poses.turn, np.broadcast_to(point, way.place.shape))
    driven = 0.0 if leg.bar.drive is None else legs.driven(actuators)[:, leg.bar.drive]
    return way.place, far, leg.bar.length_mm + twists.values[:, bar_site, 0] + driven


def passive_screws(leg, way):
    """Screws (n, 6, k) of a leg's passive joints at the world's origin."""
    screws = [
        screw(j, axis, place) for j, axis, place in zip(leg.joints, way.axes, way.places, strict=True) if j.passive
    ]
    return np.stack(screws, axis=-1) if screws else np.zeros((len(way.place), 6, 0))


def screw(joint, axis, place):
    """Screw (n, 6) of a joint with axes (n, 3) through places (n, 3)."""
    turning = joint.kind == "R"
    return np.concatenate([np.cross(place, axis), axis] if turning else [axis, np.zeros_like(axis)], axis=1)


def line_wrench(near, far):
    """Wrench (n, 6) of unit force along the lines from near to far, both (n, 3): force and moment about the origin."""
    line = far - near
    line = line / np.linalg.norm(line, axis=1, keepdims=True)
    return np.concatenate([line, np.cross(near, line)], axis=1)


def frame_along(lines):
    """Right-handed frames (n, 3, 3), columns their axes, whose x points along lines (n, 3)."""
    x = lines / np.linalg.norm(lines, axis=1, keepdims=True)
    helper = np.eye(3)[np.abs(x).argmin(axis=1)]
    y = np.cross(helper, x)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=2)


def wrenches_beside(screws, rank):
    """Wrenches (n, 6 - rank, 6) that passive screws (n, 6, k), `rank` of them independent, do not feel."""
    if not screws.shape[2]:
        return np.broadcast_to(np.eye(6), (len(screws), 6, 6))
    u, _, _ = np.linalg.svd(screws / _SCALE[:, None])
    return u[:, :, rank:].transpose(0, 2, 1) / _SCALE


def rank_of(screws):
    """Number of independent screws (6, k)."""
    return int(np.linalg.matrix_rank(screws / _SCALE[:, None], tol=_RANK)) if screws.shape[1] else 0


def _spare(screws):
    """Which of the joints with screws (6, k) depend on those before them, (k,)."""
    return np.diff([rank_of(screws[:, :count]) for count in range(screws.shape[1] + 1)]) == 0


def walks(legs, actuators, passive, twists):
    """The Walks of all legs."""
    return [walk(legs, leg, actuators, passive, twists) for leg in legs.legs]


def screws_off_home(legs):
    """Passive screws (6, k) of every leg a little off its home values, where joints may stand in line."""
    offset = 0.1 * np.sin(1.0 + np.arange(len(legs.passive_joints)))
    ways = walks(legs, legs.home_drives[None], (legs.home_passive + offset)[None], Twists(legs))
    return [passive_screws(leg, way)[0] for leg, way in zip(legs.legs, ways, strict=True)]


def wrenches_of(legs, ranks, ways, poses, actuators, twists):
    """Wrenches (n, r, 6) of every leg that its passive joints, of these ranks, do not feel."""
    result = []
    for leg, way, rank in zip(legs.legs, ways, ranks, strict=True):
        if leg.bar:
            near, far, _ = bar_ends(legs, leg, way, poses, actuators, twists)
            result.append(line_wrench(near, far)[:, None])
        else:
            result.append(wrenches_beside(passive_screws(leg, way), rank))
    return result


class Closure:
    """The closed legs of a robot; raises ConfigError where they do not hold the platform."""

    def __init__(self, legs):
        self.legs = legs
        screws = screws_off_home(legs)
        self.ranks = [rank_of(one) for one in screws]
        counts = [1 if leg.bar else 6 - rank for leg, rank in zip(legs.legs, self.ranks, strict=True)]
        if sum(counts) < 6:
            raise ConfigError(f"the legs hold the platform by {sum(counts)} constraints; allowed: at least 6")
        self._tables = tables(legs, [spare for one in screws for spare in _spare(one)])
        # of more than six constraints a bar's length counts as what it turns at the arm, as the chains' shifts do
        weights = [1.0 / ARM_MM if leg.bar else 1.0 for leg in legs.legs]
        self._weights = np.repeat(weights, counts)[:, None]
        ends = np.cumsum([0, *counts])
        self.rows = [slice(first, last) for first, last in pairwise(ends)]

    def walks(self, actuators, passive, twists):
        """The Walks of all legs."""
        return walks(self.legs, actuators, passive, twists)

    def wrenches(self, ways, poses, actuators, twists):
        """Wrenches (n, r, 6) of every leg that its passive joints do not feel."""
        return wrenches_of(self.legs, self.ranks, ways, poses, actuators, twists)

    def inverse(self, wrenches):
        """Twists (n, 6, rows) of the platform per constraint, the inverse of the wrenches A of all legs."""
        return _SCALE[:, None] * _inverse(np.concatenate(wrenches, axis=1) * _SCALE * self._weights) * self._weights.T

    def solve(self, actuators, start, twists=None):
        """Poses at actuator values (n, K) next to the Poses `start`, under finite twists (n or 1, sites, 6).

        NaN where Newton does not end.
        """
        all_met = self.rows[-1].stop == 6
        return Poses(*closed(self._tables, self.legs.driven(actuators), start, Twists(self.legs, twists), all_met))


def _inverse(matrices):
    """Inverses of (n, r, 6), those of least squares for r > 6 and where a matrix is singular."""
    if matrices.shape[1] == 6:
        try:
            return np.linalg.inv(matrices)
        except np.linalg.LinAlgError:
            pass
    return np.linalg.pinv(matrices)
