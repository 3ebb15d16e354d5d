"""What an effect is: a physical law that knows the motion and says what it changes, and where. mm, rad, N, s."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields

import numpy as np
import numpy.typing as npt

from rrru.parameters import LEGS, Parameter, ParameterSet

# where a displacement may act, along the chain of a leg
PLACES = ("base", "elbow", "knee", "wrist", "cross", "platform")


@dataclass(frozen=True)
class Motion:
    """What the robot does at the n sampled points, as far as an effect may need it; NaN where nobody knows it.

    position_mm (n, 3): commanded positions; drive, drive_rate, drive_acceleration (n, 3): commanded actuator values,
    angles in rad or slider positions in mm, and their derivatives by the time; path_drive (N, 3): the values along
    everything that is driven, path_index (n,): rows of the sampled points in it; time_s (n,): since the campaign's
    start; payload_kg (n,); force_n (n, 3): force with which each leg pushes the platform along force_direction (n, 3
    legs, 3), the forearm's direction, compression positive, and held_force_n (n, 3) the same if friction holds joint 3;
    drive_load (n, 3): torque in N mm or force in N of the loads on each drive, positive in the drive's sense;
    lengths_mm (5,): nominal R, L1, L2, L3, r; L3 is the link that reaches the platform, 0 what a robot does not have.
    """

    position_mm: np.ndarray
    drive: np.ndarray
    drive_rate: np.ndarray
    drive_acceleration: np.ndarray
    path_drive: np.ndarray
    path_index: np.ndarray
    time_s: np.ndarray
    payload_kg: np.ndarray
    force_n: np.ndarray
    held_force_n: np.ndarray
    force_direction: np.ndarray
    drive_load: np.ndarray
    lengths_mm: np.ndarray

    def __len__(self) -> int:
        return len(self.drive)


@dataclass(frozen=True)
class Contribution:
    """What one effect changes at the n points.

    drive (n, 3): added to the actuator values, rad or mm; length_mm (n, 3 legs, 5): added to R, L1, L2, L3, r; joint_mm
    (n, 3 legs, 3): shift of the platform's U-joint centres against the forearms, robot frame; displacement (3 legs, 6
    places, 6): rigid displacements at the places of PLACES, shift in mm and rotation vector in rad, leg frame; frame
    (6,): shift in mm and rotation vector in rad that carry true positions into measured ones.
    """

    drive: np.ndarray | float = 0.0
    length_mm: np.ndarray | float = 0.0
    joint_mm: np.ndarray | float = 0.0
    displacement: np.ndarray | float = 0.0
    frame: np.ndarray | float = 0.0

    def __add__(self, other: "Contribution") -> "Contribution":
        return Contribution(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))


@dataclass(frozen=True)
class Coordinates:
    """How the diagnosis fits a law: c coordinates in which its contribution is linear, or nearly so.

    typical (c,): sizes that a worn or badly assembled robot may have, they set the fit's prior; most (c,): largest
    sizes that the law allows; legs (c,): 1 to 3, or 0 where the coordinate acts on all; positive (c,): whether it
    cannot be negative; shapes: values of the parameters that are no coordinates, each a variant of the law to be tried;
    to_values: coordinates (c,) and a shape to parameter values (p,).
    """

    typical: np.ndarray
    legs: np.ndarray
    positive: np.ndarray
    to_values: Callable[[np.ndarray, Mapping[str, float]], np.ndarray]
    shapes: tuple[Mapping[str, float], ...] = ({},)
    most: np.ndarray | float = np.inf

    def __len__(self) -> int:
        return len(self.typical)


def base_displacement(shift_mm: np.ndarray, turn_rad: np.ndarray) -> np.ndarray:
    """Contribution.displacement (3 legs, 6 places, 6) of shifts and rotation vectors (3, 3) of the feet, leg frame."""
    result = np.zeros((3, len(PLACES), 6))
    result[:, PLACES.index("base"), :3] = shift_mm
    result[:, PLACES.index("base"), 3:] = turn_rad
    return result


def leg_parameters(source: str, *kinds: tuple[str, str, float, float]) -> tuple[Parameter, ...]:
    """Parameters of every leg, those of leg 1 first; kinds: (name, unit, low, high), the leg's number is added."""
    return tuple(
        Parameter(f"{name}{leg}", unit, 0.0, low, high, source, leg) for leg in LEGS for name, unit, low, high in kinds
    )


def plain_coordinates(
    parameters: ParameterSet, typical: npt.ArrayLike, shapes: tuple[Mapping[str, float], ...] = ({},)
) -> Coordinates:
    """Coordinates that are the parameters themselves, but for those that the shapes fix; a low of zero makes positive.

    typical: one size for all coordinates or one each.
    """
    free = [p for p in parameters if p.name not in shapes[0]]

    def to_values(coordinates: np.ndarray, shape: Mapping[str, float]) -> np.ndarray:
        return parameters.vector(dict(shape) | {p.name: value for p, value in zip(free, coordinates, strict=True)})

    return Coordinates(
        typical=np.broadcast_to(np.asarray(typical, dtype=float), len(free)),
        legs=np.array([p.leg for p in free]),
        positive=np.array([p.low >= 0.0 for p in free]),
        to_values=to_values,
        shapes=tuple(shapes),
        most=np.array([max(abs(p.low), abs(p.high)) for p in free]),
    )


@dataclass(frozen=True, eq=False)
class Effect:
    """One physical effect: law(motion, values) gives the Contribution of parameter values (p,) at a Motion's points.

    needs: fields of Motion without which the law says nothing; drives: units of the actuator values ("rad", "mm") of
    the robots that it is written for.
    """

    name: str
    parameters: ParameterSet
    coordinates: Coordinates
    law: Callable[[Motion, np.ndarray], Contribution]
    needs: tuple[str, ...] = ()
    drives: tuple[str, ...] = ("rad", "mm")

    def contribute(self, motion: Motion, values: npt.ArrayLike) -> Contribution:
        """Changes at the points of a motion under parameter values (p,)."""
        return self.law(motion, np.asarray(values, dtype=float))


@dataclass(frozen=True)
class ActiveEffect:
    """An effect together with its parameter values by name; absent values are nominal."""

    effect: Effect
    values: dict = field(default_factory=dict)

    def contribute(self, motion: Motion) -> Contribution:
        """Changes at the points of a motion."""
        return self.effect.contribute(motion, self.effect.parameters.vector(self.values))


def together(effects: Iterable[ActiveEffect], motion: Motion) -> Contribution:
    """Contribution of active effects together at the points of a motion."""
    return sum((effect.contribute(motion) for effect in effects), Contribution())
