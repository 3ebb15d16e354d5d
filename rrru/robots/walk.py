"""Legs followed joint by joint from the base, all n points at once: where their frames and axes are.

Lengths in mm, angles in rad.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.robots.legs import turn_about


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
        return type(self)(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    def where(self, rows, other):
        """Place, orientation and passive values of the poses where rows (n,) are true, else of others."""
        names = ("position_mm", "turn", "passive")
        own = ((getattr(self, name), getattr(other, name)) for name in names)
        return type(self)(*(np.where(rows.reshape(-1, *(1,) * (a.ndim - 1)), a, b) for a, b in own), None, None)


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


def walks(legs, actuators, passive, twists):
    """The Walks of all legs."""
    return [walk(legs, leg, actuators, passive, twists) for leg in legs.legs]
