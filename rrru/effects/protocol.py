"""Effect models: functions of the motion that give the changes of the geometry and where they act. mm, rad, N, s."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.kinematics.dynamics import Loads
from rrru.kinematics.legs import Drive
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_ALONG = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
# fields of a Motion that are loads, and what these are of `rrru.kinematics.dynamics.Loads`
LOADS = {
    "force_n": "member_n",
    "held_force_n": "held_n",
    "drive_load": "drive",
    "follower_load": "followers",
    "across": "across",
    "base_moment": "base",
}
# field of a Motion that determines from which side each drive approaches a reading, where `Motion.approach` is NaN
PATH = "path_drive"
# key of a motion's cache: the last motion with other loads, as many coefficients are stepped under the same ones
_UNDER = "under"


@dataclass(frozen=True)
class Contribution:
    """Contribution of one effect at the n points: twists (n or 1, sites, 6) at the robot's sites, or 0 for nothing.

    A twist is a shift in mm and a rotation vector in rad, in the site's own frame; see `rrru.kinematics.legs`.
    """

    twists: FloatArray | float = 0.0

    def __add__(self, other: "Contribution") -> "Contribution":
        return Contribution(self.twists + other.twists)

    def __sub__(self, other: "Contribution") -> "Contribution":
        return Contribution(self.twists - other.twists)


@dataclass(frozen=True)
class Motion:
    """State of a robot at the n sampled points, as far as an effect may need it; NaN where unknown.

    robot: with its sites and parts; position_mm (n, 3): commanded positions; drive, drive_rate, drive_acceleration (n,
    K): commanded actuator values, angles in rad or lengths in mm, and their derivatives by the time; path_drive (N, K):
    the values along everything that is driven, path_index (n,): rows of the sampled points in it; time_s (n,): since
    the campaign's start; payload_kg (n,); force_n (n, members): force with which each member pushes the platform,
    compression positive, and held_force_n the same if friction holds the legs' inner joints; drive_load (n, K): torque
    in N mm or force in N of the loads on each drive, positive in the drive's sense; follower_load (n, f): on each joint
    that follows drives, likewise; across (n, J, 3): moments in N mm across the axes of an arm's turning joints, in the
    joints' frames; base_moment (n, 3): of all loads on the base, in N mm about the robot's origin; last_move (n, K):
    how far the drives went from the stop before to this one, NaN where the robot does not stop at its points;
    temperature_c (n,): of the robot; load_slopes: derivatives of the loads, see `rrru.kinematics.dynamics`; approach
    (n, K): where the path does not determine from which side a drive approaches a reading, the expected sense of its
    approach (-1 from above, 1 from below, 0 for even odds), NaN where the path determines it.
    """

    robot: Robot
    position_mm: FloatArray
    drive: FloatArray
    drive_rate: FloatArray
    drive_acceleration: FloatArray
    path_drive: FloatArray
    path_index: IntArray
    time_s: FloatArray
    payload_kg: FloatArray
    force_n: FloatArray
    held_force_n: FloatArray
    drive_load: FloatArray
    follower_load: FloatArray
    across: FloatArray
    base_moment: FloatArray
    last_move: FloatArray
    temperature_c: FloatArray
    load_slopes: Callable[[], tuple[Loads, ...]]
    approach: FloatArray | float = np.nan

    def __len__(self) -> int:
        return len(self.drive)

    @cached_property
    def slopes(self) -> tuple[Loads, ...]:
        """The result of `load_slopes`, computed once."""
        return self.load_slopes()

    @cached_property
    def cache(self) -> dict[Any, Any]:
        """Results that effect models compute from this motion alone, so that each is computed once."""
        return {}

    def under(self, extra_kg: float, *lean_rad: float) -> "Motion":
        """The motion with an additional payload and a base that is tilted about its level axes."""
        factors = np.array([extra_kg, *lean_rad, *(extra_kg * lean for lean in lean_rad)])
        if not factors.any():
            return self
        last = self.cache.get(_UNDER)
        if last is None or last[0] != tuple(factors):
            changed = {
                name: getattr(self, name)
                + sum(factor * getattr(slope, attribute) for factor, slope in zip(factors, self.slopes, strict=True))
                for name, attribute in LOADS.items()
            }
            last = self.cache[_UNDER] = tuple(factors), replace(self, **changed)
        loaded: Motion = last[1]
        return loaded

    def with_approach(self, changes: FloatArray, from_below: FloatArray) -> FloatArray:
        """Changes (n, K) of the actuator values with their expected values where the path does not determine them.

        from_below (K,): change of each drive that approaches from below; it has the other sign from above.
        """
        return np.where(np.isnan(self.approach), changes, self.approach * from_below)

    def at_drives(self, changes: FloatArray) -> Contribution:
        """Contribution of changes (n, K) of the actuator values, in their units."""
        return self._at_values(self.robot.parts.drives, changes)

    def at_drive_functions(self, functions: Iterable[FloatArray], values: Iterable[FloatArray]) -> Contribution:
        """Contribution of functions (n, c_k) by drive under values (c_k,) by drive: changes of the actuator values."""
        return self.at_drives(np.stack([f @ own for f, own in zip(functions, values, strict=True)], axis=1))

    def at_followers(self, changes: FloatArray) -> Contribution:
        """Contribution of changes (n, f) of the joints that follow drives, in their units."""
        return self._at_values(self.robot.parts.followers, changes)

    def _at_values(self, drives: Iterable[Drive], changes: FloatArray) -> Contribution:
        """Contribution of changes (n, k) of the values of Drives."""
        numbers = self.robot.legs.site_numbers
        result = np.zeros((len(changes), len(numbers), 6))
        for k, drive in enumerate(drives):
            for site, twist in drive.twists.items():
                # most of a twist's six numbers are zero
                for number in np.flatnonzero(twist):
                    result[:, numbers[site], number] += changes[:, k] * twist[number]
        return Contribution(result)

    def along(self, groups: Iterable[tuple[str, ...]], shifts_mm: FloatArray) -> Contribution:
        """Contribution of shifts (n or 1, groups) in mm along the x of every site of each group."""
        named = [(site, k) for k, group in enumerate(groups) for site in group]
        return self.at({site: np.multiply.outer(shifts_mm[:, k], _ALONG) for site, k in named})

    def at_feet(self, turns_rad: FloatArray, shifts_mm: FloatArray | float = 0.0) -> Contribution:
        """Contribution of rotation vectors (legs, 3) and shifts (legs, 3) of the legs' feet."""
        twists = np.concatenate([np.zeros_like(turns_rad) + shifts_mm, turns_rad], axis=1)
        return self.at(dict(zip(self.robot.parts.feet, twists[:, None], strict=True)))

    def at(self, twists: Mapping[str, FloatArray]) -> Contribution:
        """Contribution of twists (n or 1, 6) by the site's name."""
        numbers = self.robot.legs.site_numbers
        rows = max((len(twist) for twist in twists.values()), default=1)
        result = np.zeros((rows, len(numbers), 6))
        for site, twist in twists.items():
            result[:, numbers[site]] += twist
        return Contribution(result)


EffectModel = Callable[[Motion, FloatArray], Contribution]


@dataclass(frozen=True)
class Search:
    """A continuous hyperparameter of an effect model: waves per turn of a drive, from the lowest to the highest order.

    name: of the hyperparameter; unit: of the drives that have it; value: from the order to the hyperparameter; order:
    the inverse of `value`.
    """

    name: str
    unit: str
    lowest: float
    highest: float
    value: Callable[[float], float]
    order: Callable[[float], float]


@dataclass(frozen=True)
class Coordinates:
    """Parametrization of an effect model: c coordinates in which its contribution is linear, or nearly so.

    typical (c,): prior s.d., the sizes that a worn or badly assembled robot may have; most (c,): upper bounds of the
    sizes; legs (c,): number of the leg or drive from 1 on, 0 where the coordinate acts on all; positive (c,): whether
    it cannot be negative; alike: whether legs are of one design, so that one value may hold for all; common: whether
    something that all drives share, such as a temperature, may give them one value of either sign; shapes: grid of the
    hyperparameters, the parameters that are no coordinates; to_values: from coordinates (c,) and a shape to
    parameter values (p,); weights: prior probabilities of the shapes, None where all are equal; searched: continuous
    hyperparameter in addition to the listed shapes; stated: number of shapes, from the first on, that the user has
    stated; doubt: relative s.d. of a hyperparameter, or s.d. of the order of a searched one; broad: whether the
    coordinates are so many that they are marginalised before the other effects are fitted; spectra: prior s.d. (c,) of
    the coordinates, among which the campaign chooses; of_one: by spectrum, whether only one drive has it; roots: the
    same of coordinates that a campaign resolves, by spectrum and drive (c_k, r_k): root @ root.T is the prior
    covariance; sized: where it has chosen, and `typical` is its choice, the legs that err in this choice; log_prior:
    log prior probability of a choice that was made outside of the fit.
    """

    typical: FloatArray
    legs: IntArray
    positive: BoolArray
    to_values: Callable[[FloatArray, Mapping[str, float]], FloatArray]
    shapes: tuple[Mapping[str, float], ...] = ({},)
    alike: bool = True
    common: bool = False
    most: FloatArray | float = np.inf
    weights: tuple[float, ...] | None = None
    searched: Search | None = None
    stated: int = 0
    doubt: float = 0.3
    broad: bool = False
    spectra: tuple[FloatArray, ...] = ()
    of_one: tuple[bool, ...] = ()
    roots: tuple[tuple[FloatArray, ...], ...] = ()
    sized: tuple[int, ...] = ()
    log_prior: float = 0.0

    def __len__(self) -> int:
        return len(self.typical)


def leg_parameters(source: str, *kinds: tuple[str, str, float, float], count: int = 3) -> tuple[Parameter, ...]:
    """Parameters of each of `count` legs or drives, the first's first; kinds: (name, unit, low, high).

    The leg's number is added to the name.
    """
    legs = range(1, count + 1)
    return tuple(
        Parameter(f"{name}{leg}", unit, 0.0, low, high, source, leg) for leg in legs for name, unit, low, high in kinds
    )


def drive_parameters(
    drives: Iterable[Drive], source: Mapping[str, str], *kinds: tuple[str, Mapping[str, tuple[str, float, float]]]
) -> tuple[Parameter, ...]:
    """Parameters of each Drive; kinds: (name, {drive's unit: (unit, low, high)}); source: by the drive's unit."""
    return tuple(
        Parameter(f"{name}{number}", unit, 0.0, low, high, source[drive.unit], number)
        for number, drive in enumerate(drives, 1)
        for name, by_unit in kinds
        for unit, low, high in (by_unit[drive.unit],)
    )


def of_drives(drives: Iterable[Drive], by_unit: Mapping[str, float]) -> FloatArray:
    """One number (K,) of each Drive by the drive's unit."""
    return np.array([by_unit[drive.unit] for drive in drives])


def plain_coordinates(
    parameters: ParameterSet, typical: npt.ArrayLike, shapes: tuple[Mapping[str, float], ...] = ({},)
) -> Coordinates:
    """Coordinates that are the parameters themselves, except those of the shapes; positive where the low bound is zero.

    typical: one prior s.d. for all coordinates, or one for each.
    """
    free = [p for p in parameters if p.name not in shapes[0]]

    def to_values(coordinates: FloatArray, shape: Mapping[str, float]) -> FloatArray:
        return parameters.vector(dict(shape) | {p.name: value for p, value in zip(free, coordinates, strict=True)})

    return Coordinates(
        typical=np.broadcast_to(np.asarray(typical, dtype=float), len(free)),
        legs=np.array([p.leg for p in free]),
        positive=np.array([p.low >= 0.0 for p in free]),
        to_values=to_values,
        shapes=tuple(shapes),
        most=np.array([max(abs(p.low), abs(p.high)) for p in free]),
    )


class Needing(Protocol):
    """What needs fields of a Motion: an effect, or the discrepancy basis; see `Effect`."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Fields of a Motion without which it contributes nothing."""

    @property
    def switches(self) -> bool:
        """Whether it depends on the sign of a load alone."""


@dataclass(frozen=True, eq=False)
class Effect:
    """One physical effect: effect_model(motion, values) gives the Contribution of parameter values (p,) at a Motion's
    points.

    needs: fields of Motion without which the effect model contributes nothing, "path_drive" where it depends on the
    sense in which a drive approaches a reading; along_drives: where only actuator values change, linearly in the
    coordinates, the functions of each drive in turn, from a Motion to arrays (n, c_k); of_drive_value: whether only
    actuator values change, each by a function of itself; steps: probability that it jumps; with_waves: where harmonic
    orders are searched, from pairs (drive, order) and their log prior to the effect with these orders; waves: these
    pairs; spoils: where the effect is one of the measurement and not of the robot, why a calibration without it is
    wrong; switches: whether the effect depends on the sign of a load alone.
    """

    name: str
    parameters: ParameterSet
    coordinates: Coordinates
    effect_model: EffectModel
    needs: tuple[str, ...] = ()
    spoils: str = ""
    along_drives: Callable[[Motion], list[FloatArray]] | None = None
    of_drive_value: bool = False
    steps: float = 0.0
    with_waves: Callable[[Sequence[tuple[int, float]], float], "Effect"] | None = None
    waves: tuple[tuple[int, float], ...] = ()
    switches: bool = False

    def doubted(self, name: str, value: float) -> float:
        """A value of a hyperparameter, displaced by one standard deviation."""
        search, deviation = self.coordinates.searched, self.coordinates.doubt
        if search is not None:
            return search.value(search.order(value) + deviation)
        stepped = value * (1.0 + deviation)
        return stepped if stepped <= self.parameters[name].high else value * (1.0 - deviation)

    def contribute(self, motion: Motion, values: npt.ArrayLike) -> Contribution:
        """Changes at the points of a motion under parameter values (p,)."""
        return self.effect_model(motion, np.asarray(values, dtype=float))


@dataclass(frozen=True)
class ActiveEffect:
    """An effect together with its parameter values by name; absent values are nominal."""

    effect: Effect
    values: dict[str, float] = field(default_factory=dict)

    def contribute(self, motion: Motion) -> Contribution:
        """Changes at the points of a motion."""
        return self.effect.contribute(motion, self.effect.parameters.vector(self.values))


def lacks_values(effect: Needing, motion: Motion) -> BoolArray:
    """Rows (n,) at which a value that an effect, or the discrepancy basis, needs is NaN."""
    needs = [getattr(motion, need) for need in effect.needs if need != PATH]
    known: BoolArray = np.all([np.ones(len(motion), dtype=bool), *(known_values(values) for values in needs)], axis=0)
    return ~known


def known_values(values: FloatArray) -> BoolArray:
    """Rows (n,) of values (n, ..) that are finite."""
    known: BoolArray = np.all(np.isfinite(values.reshape(len(values), -1)), axis=1)
    return known


def complete_rows(effect: Needing, motion: Motion) -> BoolArray:
    """Rows (n,) at which a motion has all that an effect needs, including the sense in which the drives approach."""
    result = ~lacks_values(effect, motion)
    if PATH in effect.needs:
        result &= np.isnan(np.broadcast_to(motion.approach, motion.drive.shape)).all(axis=1)
    return result


def bears_load(effect: Needing) -> bool:
    """Whether an effect, or the discrepancy basis, depends on the loads."""
    return not LOADS.keys().isdisjoint(effect.needs)


def is_compliance(effect: Effect) -> bool:
    """Whether an effect depends on the loads, or on weights that it has as parameters in their place."""
    return bears_load(effect) or any(is_per_load(parameter.unit) for parameter in effect.parameters)


def is_per_load(unit: str) -> bool:
    """Whether a parameter of this unit is a compliance: per newton, or per torque."""
    return "/N" in unit or "(N" in unit


def is_compliant(effect: Needing) -> bool:
    """Whether an effect, or the discrepancy basis, grows with the loads, so that payload and tilt matter."""
    return bears_load(effect) and not effect.switches


def together(effects: Iterable[ActiveEffect], motion: Motion) -> Contribution:
    """Contribution of active effects together at the points of a motion."""
    return sum((effect.contribute(motion) for effect in effects), Contribution())
