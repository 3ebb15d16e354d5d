"""Exact loop closure of any robot's legs: Newton on the platform's pose and the passive joints, all n points at once.

At a guessed pose T of the platform, leg i ends elsewhere by the small twist e_i. With S_i its passive joints'
screws and W_i the wrenches reciprocal to them, W_i S_i = 0, the step obeys

    T - S_i dp_i = e_i   =>   W_i T = W_i e_i,   stacked over the legs   A T = b,   dp_i = S_i^+ (T - e_i)

The W_i of legs that share passive joints are blocks of one W (`rrru.kinematics.wrenches`); their equations are added. A
bar has one wrench, the unit force along its line, and e_i its missing length. More than six wrenches are met by
least squares. Bars then share what they contradict each other in as elastic ones of one section and material do: the
stiffness of a bar is in inverse proportion to its length, EA / l, so that its equation is scaled by 1 / sqrt(l). Screws
and twists are at the world's origin, the velocity first: (v, w). The compiled iteration of
`rrru.kinematics.closure_kernel` takes the legs as flat arrays. Lengths in mm, angles in rad.
"""

from collections.abc import Sequence, Set
from typing import Protocol

import numpy as np

from rrru.arrays import BoolArray, FloatArray
from rrru.errors import ConfigError
from rrru.kinematics import closure_kernel
from rrru.kinematics.chain import PoseGuess, Poses, Twists, Walk
from rrru.kinematics.closure_kernel import CHARACTERISTIC_LENGTH_MM, Tables
from rrru.kinematics.legs import Leg, Legs
from rrru.kinematics.wrenches import SCALE, by_group, constraints_of, spare_joints, wrenches_of

# a pose with a larger residual is not closed
_CLOSED_MM = 1e-7


class ForwardModel(Protocol):
    """Legs whose ends are found at actuator values: those of one platform, `Closure`, or separate ones.

    rows: of every leg its rows of A; row_count: of all.
    """

    legs: Legs
    rows: list[slice]
    row_count: int

    def wrenches(self, ways: Sequence[Walk], poses: Poses, /) -> list[FloatArray]:
        """Wrenches (n, r, 6) of every leg that constrain what it carries."""

    def inverse(self, wrenches: Sequence[FloatArray]) -> FloatArray:
        """Twists (n, 6, rows) per constraint."""

    def solve(self, actuators: FloatArray, start: PoseGuess, twists: FloatArray | None = None) -> Poses:
        """Poses at actuator values (n, K) next to `start`, under finite twists (n or 1, sites, 6)."""


class Closure:
    """The closed legs of a robot; raises ConfigError where they do not hold the platform.

    rows: of every leg its rows of A, the same for all legs that share passive joints; row_count: of all.
    """

    def __init__(self, legs: Legs) -> None:
        self.legs, groups = legs, legs.groups
        self._spare = spare_joints(legs)
        counts = constraints_of(legs, self._spare)
        # one leg, whose end is the platform's
        self._driven = len(legs.legs) == 1 and counts == [6] and not legs.passive_joints
        if sum(counts) < 6:
            raise ConfigError(f"the legs hold the platform by {sum(counts)} constraints; allowed: at least 6")
        self._tables = tables(legs, self._spare)
        # with more than six constraints lengths, of bars and of chains' shifts, count in units of the arm
        weights = [1.0 / CHARACTERISTIC_LENGTH_MM if legs.legs[group[0]].bar else 1.0 for group in groups]
        self._weights = np.repeat(weights, counts)[:, None]
        ends = np.cumsum([0, *counts])
        slices = {k: slice(*ends[row : row + 2]) for row, group in enumerate(groups) for k in group}
        self.row_count, self.rows = int(ends[-1]), [slices[k] for k in range(len(legs.legs))]

    def wrenches(self, ways: Sequence[Walk], _poses: Poses) -> list[FloatArray]:
        """Wrenches (n, r, 6) of every leg that are reciprocal to its passive joints, those of redundant bars scaled."""
        found = wrenches_of(self.legs, self._spare, ways)
        if self.row_count > 6:
            for number, way in enumerate(ways):
                if way.bar:
                    found[number] = found[number] * np.sqrt(CHARACTERISTIC_LENGTH_MM / way.bar.span_mm)[:, None, None]
        return found

    def inverse(self, wrenches: Sequence[FloatArray]) -> FloatArray:
        """Twists (n, 6, rows) of the platform per constraint, the inverse of the wrenches A of all legs."""
        if self._driven:
            return np.broadcast_to(np.eye(6), wrenches[0].shape)
        rows = np.concatenate(by_group(self.legs, wrenches), axis=1)
        return np.asarray(SCALE[:, None] * _inverse(rows * SCALE * self._weights) * self._weights.T)

    def solve(self, actuators: FloatArray, start: PoseGuess, twists: FloatArray | None = None) -> Poses:
        """Poses at actuator values (n, K) next to `start`, under finite twists (n or 1, sites, 6).

        NaN where Newton does not converge.
        """
        driven = self.legs.driven(actuators)
        return Poses(*closed(self._tables, driven, start, Twists(self.legs, twists), self.row_count == 6))


def _inverse(matrices: FloatArray) -> FloatArray:
    """Inverses of (n, r, 6), those of least squares for r > 6 and where a matrix is singular."""
    if matrices.shape[1] == 6:
        try:
            return np.asarray(np.linalg.inv(matrices), dtype=float)
        except np.linalg.LinAlgError:
            pass
    return np.asarray(np.linalg.pinv(matrices), dtype=float)


def tables(legs: Legs, spare: Set[str]) -> Tables:
    """Arrays of Legs with m joints, q of them passive, counted once per leg that has them; -1 where there is none.

    slots (m + legs, 3): of every joint, and of what follows a leg's last one, the site, the drive and whether a link
    ends there; frames (m + legs, 4, 3): the placement before it, rows its axes and its place; motions (m + legs, 6):
    the twist of its motion; ends (legs, 7): a leg's first link, its first of the q, one past its last, whether a bar
    ends it, the bar's drive and both sites; bars (legs, 4): length and platform point; screws (q, 7): the twists of the
    passive joints' motions and 1, or 0 for those that keep their value, `spare` their names; values (q,): the number of
    the value of each; turning (k,): whether the joint of a value turns. Raises ConfigError for a passive joint before a
    bar.
    """
    slots, frames, motions, ends, bars, values = [], [], [], [], [], []
    screws: list[list[float]] = []
    for number, leg in enumerate(legs.legs):
        passive, chain = [joint for joint in leg.joints if joint.passive], legs.chains[leg.name]
        if leg.bar and passive:
            raise ConfigError(f"{leg.name}: {len(passive)} of the joints before its bar are passive; allowed: none")
        for joint in leg.joints:
            drive = -1 if joint.kind == "fixed" or joint.drive is None else joint.drive
            slots.append((legs.site_numbers[joint.name], drive, joint.passive))
        slots.append((-1, -1, True))
        frames += [chain.frames]
        motions += [chain.motions, np.zeros((1, 6))]
        first, last = len(screws), len(screws) + len(passive)
        ends.append((first + number, first, last, *_bar_numbers(legs, leg)))
        bars.append(np.r_[leg.bar.length_mm, leg.bar.platform_mm] if leg.bar else np.zeros(4))
        screws += [
            [*motion, joint.name not in spare]
            for joint, motion in zip(leg.joints, chain.motions, strict=True)
            if joint.passive
        ]
        values += [legs.passive_numbers[joint.name] for joint in passive]
    turning = np.array([joint.kind == "R" for joint in legs.passive_joints], dtype=bool)
    parts = (
        np.array(slots),
        np.concatenate(frames),
        np.concatenate(motions),
        np.array(ends),
        np.array(bars),
        np.reshape(screws, (-1, 7)).astype(float),
    )
    return *parts, np.array(values, dtype=np.int64), turning


def _bar_numbers(legs: Legs, leg: Leg) -> tuple[int, int, int, int]:
    """Of a leg whether a bar ends it, its drive and both its sites."""
    if not leg.bar:
        return 0, -1, -1, -1
    bar_site, end_site = (legs.site_numbers[name] for name in leg.bar_sites)
    return 1, -1 if leg.bar.drive is None else leg.bar.drive, bar_site, end_site


def closed(
    tables: Tables, actuators: FloatArray, start: PoseGuess, twists: Twists, all_met: bool
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, BoolArray]:
    """The fields of Poses at actuator values (n, K), next to `start`; NaN where Newton does not converge.

    twists: Twists at n points or one; all_met: whether all constraints can be met, not only by least squares. The
    residual is inf where actuator values or start are unknown. Raises ValueError where shapes do not fit.
    """
    slots, _, _, ends, _, screws, _, turning = tables
    n, k, legs, most = len(actuators), len(turning), len(ends), max(slots[:, 1].max(), ends[:, 4].max())
    if len(twists.values) not in (1, n) or np.ndim(actuators) != 2 or np.shape(actuators)[1] <= most:
        raise ValueError(
            f"actuator values {np.shape(actuators)}, twists at {len(twists.values)} points; allowed: (n, {most + 1}) "
            "actuator values or more, twists at 1 or n points"
        )
    platform = np.concatenate([np.swapaxes(start.turn, 1, 2), np.asarray(start.position_mm)[:, None]], axis=1)
    shapes = np.shape(actuators)[1:], (4, 3), (k,)
    state = [
        np.array(np.broadcast_to(part, (n, *shape)), dtype=float, order="C")
        for part, shape in zip((actuators, platform, start.passive), shapes, strict=True)
    ]
    known = np.isfinite(sum(one.sum(axis=tuple(range(1, one.ndim))) for one in state))
    drives, platform, passive = state
    # links, a frame, screws and equations of one point after the other
    count = len(screws)
    room = np.empty((count + legs, 4, 3)), np.empty((4, 3)), np.empty((count, 6)), np.empty((k + 6, k + 8))
    left, lacks = np.empty(n), np.zeros((n, legs, 6))
    closure_kernel.solve(tables, room, drives, twists.values, twists.active, platform, passive, left, lacks)
    if all_met:
        arms = np.where(ends[:, 3], 1.0, closure_kernel.CHARACTERISTIC_LENGTH_MM)
        left = np.maximum(left, (np.linalg.norm(lacks, axis=2) * arms).max(axis=1))
    left[~known] = np.inf
    good = left < _CLOSED_MM
    platform[~good], passive[~good] = np.nan, np.nan
    return platform[:, 3].copy(), platform[:, :3].transpose(0, 2, 1).copy(), passive, left, good
