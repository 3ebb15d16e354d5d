"""What an effect is: a physical law that knows the motion and says what it changes, and where. Lengths mm, angles rad,
forces N, times s.
"""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from rrru.parameters import ParameterSet

LEGS = (1, 2, 3)
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

    def __len__(self):
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

    def __add__(self, other):
        return Contribution(
            self.drive + other.drive,
            self.length_mm + other.length_mm,
            self.joint_mm + other.joint_mm,
            self.displacement + other.displacement,
            self.frame + other.frame,
        )


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
    to_values: object
    shapes: tuple = ({},)
    most: np.ndarray | float = np.inf

    def __len__(self):
        return len(self.typical)


def base_displacement(shift_mm, turn_rad):
    """Contribution.displacement (3 legs, 6 places, 6) of shifts (3, 3) and rotation vectors (3, 3) of the legs' feet,
    leg frame.
    """
    result = np.zeros((3, len(PLACES), 6))
    result[:, PLACES.index("base"), :3] = shift_mm
    result[:, PLACES.index("base"), 3:] = turn_rad
    return result


def plain_coordinates(parameters, typical, shapes=({},)):
    """Coordinates that are the parameters themselves, but for those that the shapes fix.

    typical: one size for all coordinates or one each. A parameter whose name ends in 1, 2 or 3 belongs to that leg; one
    whose lower bound is zero is positive.
    """
    fixed = set(shapes[0])
    free = [p for p in parameters if p.name not in fixed]

    def to_values(coordinates, shape):
        return parameters.vector(dict(shape) | {p.name: value for p, value in zip(free, coordinates, strict=True)})

    return Coordinates(
        typical=np.broadcast_to(np.asarray(typical, dtype=float), len(free)),
        legs=np.array([int(p.name[-1]) if p.name[-1] in "123" else 0 for p in free]),
        positive=np.array([p.low >= 0.0 for p in free]),
        to_values=to_values,
        shapes=tuple(shapes),
        most=np.array([max(abs(p.low), abs(p.high)) for p in free]),
    )


class Effect(Protocol):
    """One physical effect.

    needs: names of fields of Motion without which the law says nothing.
    """

    name: str
    parameters: ParameterSet
    coordinates: Coordinates
    needs: tuple

    def contribute(self, motion: Motion, values: np.ndarray) -> Contribution:
        """Changes at the points of a motion under parameter values (p,)."""


@dataclass(frozen=True)
class ActiveEffect:
    """An effect together with its parameter values by name; absent values are nominal."""

    effect: Effect
    values: dict = field(default_factory=dict)

    def contribute(self, motion):
        """Changes at the points of a motion."""
        return self.effect.contribute(motion, self.effect.parameters.vector(self.values))
