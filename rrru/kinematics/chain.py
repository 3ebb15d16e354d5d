"""Legs followed joint by joint from the base, all n points at once: where their frames and axes are.

Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from rrru.arrays import BoolArray, FloatArray, IntArray, Rows
from rrru.kinematics import chain_kernel
from rrru.kinematics.legs import Joint, Leg, Legs


@dataclass(frozen=True)
class PoseGuess:
    """Platform poses at n points near which the legs may close: position_mm (n, 3), turn (n, 3, 3), passive (n, k)."""

    position_mm: FloatArray
    turn: FloatArray
    passive: FloatArray

    def turned_from(self, turn: FloatArray) -> FloatArray:
        """Rotation vectors (n, 3) of the platform against orientations (n, 3, 3)."""
        off = self.turn @ np.swapaxes(turn, 1, 2)
        result, good = np.full(self.position_mm.shape, np.nan), np.isfinite(off).all(axis=(1, 2))
        result[good] = Rotation.from_matrix(off[good]).as_rotvec()
        return result

    def point(self, tool_mm: npt.ArrayLike) -> FloatArray:
        """Positions (n, 3) of a point (3,) or points (n or 1, 3) of the platform."""
        if not np.any(tool_mm):
            return self.position_mm
        return np.asarray(self.position_mm + (self.turn @ np.asarray(tool_mm)[..., None])[..., 0])

    def of(self, rows: Rows) -> Self:
        """The poses of some rows."""
        return type(self)(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    def where(self, rows: BoolArray, other: "PoseGuess") -> "PoseGuess":
        """The poses where rows (n,) are true, else others."""
        pairs = ((self.position_mm, other.position_mm), (self.turn, other.turn), (self.passive, other.passive))
        return PoseGuess(*(np.where(rows.reshape(-1, *(1,) * (a.ndim - 1)), a, b) for a, b in pairs))


@dataclass(frozen=True)
class Poses(PoseGuess):
    """Platform poses at n points at which the legs close, where closed (n,) is true; else NaN.

    residual_mm (n,): residual of the closure, angles counted at a characteristic length of 500 mm.
    """

    residual_mm: FloatArray
    closed: BoolArray


@dataclass(frozen=True)
class EndEffectorPoses(Poses):
    """Poses of end effectors; leg (n,): number of the leg whose end each is."""

    leg: IntArray


@dataclass(frozen=True)
class BarPose:
    """A leg's bar at n points: its ball joints near and far (n, 3), its frame (n, 3, 3), whose x runs along it.

    lack_mm (n,): by how much it is longer than what it spans.
    """

    near: FloatArray
    far: FloatArray
    frame: FloatArray
    lack_mm: FloatArray

    @property
    def line(self) -> FloatArray:
        """Unit vectors (n, 3) along it."""
        return self.frame[:, :, 0]

    @property
    def span_mm(self) -> FloatArray:
        """Distances (n,) between its ball joints."""
        return np.asarray(np.linalg.norm(self.far - self.near, axis=1))


@dataclass(frozen=True)
class Walk:
    """One leg at n points, by the order of its joints: turns (J, n, 3, 3) and places (J, n, 3) of the seats' frames.

    Places are those after the seat's own twist, turns those before; axes (J, n, 3), none of a fixed joint. turn (n, 3,
    3), place (n, 3): of what follows the last joint, the platform's frame or a bar's first ball joint; bar: the bar
    there, where the platform's pose is known.
    """

    turns: FloatArray
    places: FloatArray
    axes: FloatArray
    turn: FloatArray
    place: FloatArray
    bar: BarPose | None = None


def active_sites(twists: FloatArray) -> BoolArray:
    """At which sites (sites,) twists (n, sites, 6) are not zero everywhere."""
    # one axis after the other takes an eighth of the time that both at once take
    active: BoolArray = np.any(np.any(twists, axis=0), axis=1)
    return active


class Twists:
    """Finite twists, values (n or 1, sites, 6), at the sites of Legs, shift first; active (sites,): most are none."""

    def __init__(self, legs: Legs, values: FloatArray | None = None) -> None:
        shape = (1, len(legs.sites), 6)
        given = np.zeros(shape) if values is None else np.reshape(values, (-1, *shape[1:]))
        self.values = np.require(given, float, ["C", "W"])
        self.active = active_sites(self.values)

    def turn(self, number: int) -> bool:
        """Whether the twist at a site turns."""
        return bool(self.active[number] and self.values[:, number, 3:].any())

    def of(self, rows: Rows) -> "Twists":
        """The twists of some rows."""
        result = object.__new__(Twists)
        result.active, result.values = self.active, self.values[rows] if len(self.values) > 1 else self.values
        return result


def walk(legs: Legs, leg: Leg, actuators: FloatArray, passive: FloatArray, twists: Twists) -> Walk:
    """The Walk of a leg at actuator values (n, K) and passive values (n, k) under Twists.

    Raises ValueError for twists at another number of points.
    """
    chain, n = legs.chains[leg.name], len(actuators)
    if len(twists.values) not in (1, n):
        raise ValueError(f"twists at {len(twists.values)} points; allowed: 1 or {n}")
    values = np.concatenate([passive, legs.driven(actuators)], axis=1)
    turns, places = np.empty((len(chain.frames), n, 3, 3)), np.empty((len(chain.frames), n, 3))
    axes = np.empty((len(leg.joints), n, 3))
    chain_kernel.follow(*chain, values, twists.values, twists.active, turns, places, axes)
    return Walk(turns[:-1], places[:-1], axes, turns[-1], places[-1])


def value_of(legs: Legs, joint: Joint, actuators: FloatArray, passive: FloatArray) -> FloatArray:
    """Values (n,) of a joint that moves, at actuator values (n, K) and passive values (n, k)."""
    if joint.drive is None:
        return passive[:, legs.passive_numbers[joint.name]]
    return legs.driven(actuators)[:, joint.drive]


def bar_pose(legs: Legs, leg: Leg, way: Walk, poses: PoseGuess, actuators: FloatArray, twists: Twists) -> BarPose:
    """The BarPose of a leg at platform poses.

    Raises ValueError for poses of another number of points and for a leg without a bar.
    """
    bar = leg.bar
    if bar is None:
        raise ValueError(f"{leg.name} ends in no bar")
    bar_site, end_site = (legs.site_numbers[name] for name in leg.bar_sites)
    point, n = bar.platform_mm - twists.values[:, end_site, :3], len(way.place)
    if len(poses.position_mm) != n or len(poses.turn) != n:
        raise ValueError(f"poses at {len(poses.position_mm)} points; allowed: {n}")
    # numba compiles anew for arrays of another memory layout
    near, position, turn, end = (
        np.require(part, float, ["C", "W"]) for part in (way.place, poses.position_mm, poses.turn, point)
    )
    far, frame, span = np.empty((n, 3)), np.empty((n, 3, 3)), np.empty(n)
    chain_kernel.reach(near, position, turn, end, far, frame, span)
    driven = 0.0 if bar.drive is None else legs.driven(actuators)[:, bar.drive]
    return BarPose(way.place, far, frame, bar.length_mm + twists.values[:, bar_site, 0] + driven - span)


def walks(legs: Legs, actuators: FloatArray, poses: PoseGuess, twists: Twists) -> list[Walk]:
    """The Walks of all legs at actuator values (n, K) and Poses that fit them under Twists."""
    result = [walk(legs, leg, actuators, poses.passive, twists) for leg in legs.legs]
    return [
        replace(way, bar=bar_pose(legs, leg, way, poses, actuators, twists)) if leg.bar else way
        for leg, way in zip(legs.legs, result, strict=True)
    ]
