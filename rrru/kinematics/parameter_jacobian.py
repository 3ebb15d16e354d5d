"""Parameter Jacobian: motion of the platform by small twists anywhere in a robot, to first order, for every robot.

A twist d at a site of leg i, drives held, moves the platform by the twist T of

    W_i T = W_i d,   stacked over the legs   A T = b

(`rrru.kinematics.closure`; principle of reciprocal screws: Ball, Theory of Screws, 1900). A point at x moves by v + w x
x. From the same A come the Jacobian by the drives, the wrenches that the legs carry under a load, A^T f = load, and how
near a singularity is. Lengths in mm, angles in rad, forces in N, torques in N mm.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.kinematics import chain_kernel
from rrru.kinematics.chain import Poses, Twists, Walk, active_sites, walks
from rrru.kinematics.closure import ForwardModel
from rrru.kinematics.legs import TOOL, WORLD, Leg, cross
from rrru.kinematics.wrenches import by_group, screw

_EYE = np.eye(3)
# turn (n, 3, 3) and place (n, 3)
Frame = tuple[FloatArray, FloatArray]


class TwistMap:
    """The map at n poses of a Closure, at actuator values (n, K) and finite twists (n or 1, sites, 6).

    tool_mm: the measured points (n or 1, 3) of the platform. NaN where a pose is.
    """

    def __init__(
        self,
        closure: ForwardModel,
        actuators: FloatArray,
        poses: Poses,
        twists: FloatArray | None = None,
        tool_mm: npt.ArrayLike = ((0.0, 0.0, 0.0),),
    ) -> None:
        self.closure, self.poses, self._twists = closure, poses, Twists(closure.legs, twists)
        self._actuators = np.asarray(actuators, dtype=float)
        self._effects: dict[str, FloatArray] = {}
        self.point_mm = poses.point(np.asarray(tool_mm, dtype=float))
        self._ways = walks(closure.legs, self._actuators, poses, self._twists)
        self._wrenches, self.platform = _factors(closure, self._ways, poses, self._actuators, self._twists)

    def __len__(self) -> int:
        return len(self.point_mm)

    @cached_property
    def point(self) -> FloatArray:
        """Motion (n, 3, rows) of the measured point, in the world's frame, per unit of every constraint of A."""
        shift, turn = self.platform[:, :3], self.platform[:, 3:]
        return self._in_world(shift + cross(turn.transpose(0, 2, 1), self.point_mm[:, None]).transpose(0, 2, 1))

    @cached_property
    def turn(self) -> FloatArray:
        """Turn (n, 3, rows) of the platform, in the world's frame, per unit of every constraint of A."""
        return self._in_world(self.platform[:, 3:])

    def _in_world(self, columns: FloatArray) -> FloatArray:
        """Vectors (n, 3, k) of the base's frame as the twist of the world turns them."""
        number = self.closure.legs.site_numbers[WORLD]
        if not self._twists.turn(number):
            return columns
        return np.asarray(Rotation.from_rotvec(self._twists.values[:, number, 3:]).as_matrix() @ columns)

    @cached_property
    def frames(self) -> dict[int, Frame]:
        """Turn (n, 3, 3) and place (n, 3) of the frame at every site except world and tool, by the site's number."""
        return {number: (turn, place) for number, _, turn, place in self._placed}

    @property
    def _legs(self) -> Iterator[tuple[Leg, Walk, FloatArray, slice]]:
        """Of every leg: the leg, its walk, its wrenches and its rows of A."""
        return zip(self.closure.legs.legs, self._ways, self._wrenches, self.closure.rows, strict=True)

    @cached_property
    def _placed(self) -> list[tuple[int, int, FloatArray, FloatArray]]:
        """Of every site of every leg its number, the leg's, its turn (n, 3, 3) and its place (n, 3)."""
        made = ((leg, self._frames(*one[:2])) for leg, one in enumerate(self._legs))
        return [(number, leg, *frame) for leg, own in made for number, frame in own.items()]

    @cached_property
    def _sites(self) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
        """Of every site of every leg: its number and the leg's (S,), and of all their turns and places (S, n, ..).

        A site of several legs is there as often.
        """
        numbers, legs, turns, places = zip(*self._placed, strict=True)
        return np.array(numbers), np.array(legs), np.stack(turns), np.stack(places)

    def _swept(self, motion: FloatArray) -> FloatArray:
        """Motion (n, 3, S, 6) per twist at each of `_sites`, in its frame, from motion (n, 3, rows) per constraint."""
        numbers, legs, turns, places = self._sites
        by_leg = np.stack([motion[:, :, rows] @ wrenches for *_, wrenches, rows in self._legs])
        result = np.empty((*motion.shape[:2], len(numbers), 6))
        chain_kernel.sweep(by_leg, legs, numbers, turns, places, self._twists.values, result)
        return result

    @cached_property
    def _moved(self) -> FloatArray:
        """`_swept` of the measured point."""
        return self._swept(self.point)

    def _frames(self, leg: Leg, way: Walk) -> dict[int, Frame]:
        """Turn (n, 3, 3) and place (n, 3) of every site of a leg, by the site's number."""
        numbers = self.closure.legs.site_numbers
        named = zip(leg.joints, way.turns, way.places, strict=True)
        result = {numbers[joint.name]: (turn, place) for joint, turn, place in named}
        if way.bar:
            bar, end = (numbers[name] for name in leg.bar_sites)
            result |= {bar: (way.bar.frame, way.bar.near), end: (self.poses.turn, way.bar.far)}
        return result

    def _own(self, number: int, turn: FloatArray) -> FloatArray:
        """Axes (n, 3, 3) about which small rotations of a site's vector turn, in space: its finite one is counted."""
        if not self._twists.turn(number):
            return turn
        vector = self._twists.values[:, number, 3:]
        angle = np.linalg.norm(vector, axis=1)[:, None, None]
        skew = cross(vector[:, None, :], _EYE).transpose(0, 2, 1)
        safe = np.maximum(angle, 1e-4)
        first = np.where(angle < 1e-4, 0.5, (1.0 - np.cos(safe)) / safe**2)
        second = np.where(angle < 1e-4, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
        return np.asarray(turn @ (_EYE + first * skew + second * skew @ skew))

    def response(self, site: str) -> FloatArray:
        """Motion (n, 3, 6) of the measured point per twist at a site, in the site's frame."""
        if site == WORLD:
            point = self._in_world(self.point_mm[:, :, None])
            axes = self._own(self.closure.legs.site_numbers[WORLD], _EYE)
            turning = cross(_EYE, point.transpose(0, 2, 1)).transpose(0, 2, 1) @ axes
            return np.concatenate([np.broadcast_to(_EYE, turning.shape), turning], axis=2)
        if site == TOOL:
            turn = self._in_world(self.poses.turn)
            return np.concatenate([turn, np.zeros_like(turn)], axis=2)
        if site in self.closure.legs.reflectors:
            return np.zeros((len(self), 3, 6))
        return self._of_site(site, self._moved)

    def _of_site(self, site: str, swept: FloatArray) -> FloatArray:
        """Motion (n, 3, 6) per twist at a site of legs, of those of all of them."""
        return np.asarray(swept[:, :, self._sites[0] == self.closure.legs.site_numbers[site]].sum(axis=2))

    def effect(self, site: str) -> FloatArray:
        """Change (m, 3, 6) of what is read per twist at a site, in the site's frame: here `response`."""
        return self.response(site)

    def _effect_once(self, site: str) -> FloatArray:
        """`effect`, made once."""
        if site not in self._effects:
            self._effects[site] = self.effect(site)
        return self._effects[site]

    @property
    def rows(self) -> IntArray:
        """Pose (m,) of each row of what is read."""
        return np.arange(len(self))

    def move(self, twists: FloatArray | float) -> FloatArray:
        """Change (m, 3) of what is read, a position in mm, under small twists (n or 1, sites, 6), or 0 for none."""
        rows, numbers, values = self.rows, self.closure.legs.site_numbers, np.asarray(twists, dtype=float)
        result = np.zeros((len(rows), 3))
        if not values.ndim:
            return result
        active = active_sites(values)
        for name in self.closure.legs.sites:
            if active[numbers[name]]:
                twist = np.broadcast_to(values[:, numbers[name]], (len(self), 6))[rows]
                result = result + np.einsum("naj,nj->na", self._effect_once(name), twist)
        return result

    def columns(self, directions: FloatArray) -> FloatArray:
        """Derivative (m, 3, p) of what is read by p parameters with directions (sites, 6, p) at the sites."""
        return self._columns(directions, self._moved, self.response)

    def _columns(self, directions: FloatArray, swept: FloatArray, response: Callable[[str], FloatArray]) -> FloatArray:
        """Derivative (n, 3, p) of what is `_swept` at sites of legs, and at the others has a response (n, 3, 6)."""
        numbers = self._sites[0]
        active: BoolArray = np.any(directions, axis=(1, 2))
        used = active[numbers]
        count, parameters = 6 * np.count_nonzero(used), directions.shape[2]
        along = swept[:, :, used].reshape(3 * len(self), count)
        result = along @ directions[numbers[used]].reshape(count, parameters)
        result = result.reshape(len(self), 3, parameters)
        for name in (WORLD, TOOL, *self.closure.legs.reflectors):
            number = self.closure.legs.site_numbers[name]
            if active[number]:
                result += response(name) @ directions[number]
        return result

    @property
    def drive_counts(self) -> FloatArray:
        """Constraints (n, rows, K) that the actuator values change."""
        return self.closure.legs.per_actuator(self.driven_counts)

    @cached_property
    def driven_counts(self) -> FloatArray:
        """Constraints (n, rows, D) that the driven values change."""
        legs = self.closure.legs
        result = np.zeros((len(self), self.closure.row_count, len(legs.driven_kinds)))
        for leg, way, one, rows in self._legs:
            for joint, axis, place in zip(leg.joints, way.axes, way.places, strict=True):
                if joint.drive is not None:
                    result[:, rows, joint.drive] += np.einsum("nri,ni->nr", one, screw(joint, axis, place))
            if leg.bar and way.bar and leg.bar.drive is not None:
                result[:, rows, leg.bar.drive] += np.einsum("nri,ni->nr", one[..., :3], way.bar.line)
        return result

    def wrenches(self, load: FloatArray) -> FloatArray:
        """Wrenches (legs, n, 6) of the legs on the platform that bear its load (n, 6), a force and its moment."""
        force = -np.einsum("nir,ni->nr", self.platform, load)
        return np.stack([np.einsum("nr,nri->ni", force[:, rows], one) for _, _, one, rows in self._legs])

    def translational_measure(self, lengths_mm: FloatArray) -> FloatArray:
        """Smallest singular value (n,) of the position Jacobian over its largest; 0 where some direction is lost.

        lengths_mm (K,): by which each drive's value is multiplied to be comparable: the characteristic length of drives
        that turn, 1 of those that slide (Angeles, Fundamentals of Robotic Mechanical Systems, section 5.8).
        """
        size = singular_values(self.drive_response / lengths_mm)
        return size[:, -1] / size[:, 0]

    def constraint_measures(self, characteristic_length_mm: float) -> tuple[FloatArray, FloatArray]:
        """Smallest singular value and determinant (n,) of the legs' wrenches about the point, orthonormal by group.

        Moments are divided by the characteristic length. The determinant has a sign where every leg is a bar; it is
        positive elsewhere.
        """
        groups = by_group(self.closure.legs, self._wrenches)
        legs = [
            _orthonormal(_about(one, self.point_mm) / ([1.0] * 3 + [characteristic_length_mm] * 3)) for one in groups
        ]
        rows = np.concatenate(legs, axis=1)
        if rows.shape[1] == 6 and all(leg.bar for leg in self.closure.legs.legs):
            return singular_values(rows)[:, -1], np.linalg.det(rows)
        values = singular_values(rows)
        return values[:, -1], values.prod(axis=1)

    @cached_property
    def drive_response(self) -> FloatArray:
        """Motion (n, 3, K) of the measured point per actuator value."""
        return self.point @ self.drive_counts

    @property
    def drive_effect(self) -> FloatArray:
        """Change (m, 3, K) of what is read per actuator value: here `drive_response`."""
        return self.drive_response


def _factors(
    closure: ForwardModel, ways: Sequence[Walk], poses: Poses, actuators: FloatArray, twists: Twists
) -> tuple[list[FloatArray], FloatArray]:
    """`Closure.wrenches` and `Closure.inverse`, NaN where a pose is not known."""
    if poses.closed.all():
        wrenches = closure.wrenches(ways, poses)
        return wrenches, closure.inverse(wrenches)
    rows, n = np.flatnonzero(poses.closed), len(poses.closed)
    own, known, given = twists.of(rows), poses.of(rows), actuators[rows]
    wrenches = closure.wrenches(walks(closure.legs, given, known, own), known)
    return [_spread(one, rows, n) for one in wrenches], _spread(closure.inverse(wrenches), rows, n)


def _about(wrenches: FloatArray, place: FloatArray) -> FloatArray:
    """Wrenches (n, r, 6) at the origin as wrenches about places (n, 3)."""
    force = wrenches[:, :, :3]
    return np.concatenate([force, wrenches[:, :, 3:] + cross(force, place[:, None, :])], axis=2)


def _orthonormal(rows: FloatArray) -> FloatArray:
    """Rows (n, r, 6) made orthonormal, or of unit length where there is one; NaN where one is not known."""
    if rows.shape[1] == 1:
        return np.asarray(rows / np.linalg.norm(rows, axis=2, keepdims=True))
    known = np.isfinite(rows).all(axis=(1, 2))
    result = np.full(rows.shape, np.nan)
    result[known] = np.linalg.qr(rows[known].transpose(0, 2, 1))[0].transpose(0, 2, 1)
    return result


def singular_values(matrices: FloatArray) -> FloatArray:
    """Singular values (n, k) of matrices, NaN where one is not known."""
    result = np.full((len(matrices), min(matrices.shape[1:])), np.nan)
    known = np.isfinite(matrices).all(axis=(1, 2))
    result[known] = np.linalg.svd(matrices[known], compute_uv=False)
    return result


def _spread(part: FloatArray, rows: IntArray, n: int) -> FloatArray:
    """An array (m, ..) at some rows of one of n rows, else NaN."""
    result = np.full((n, *part.shape[1:]), np.nan)
    result[rows] = part
    return result
