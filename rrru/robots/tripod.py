"""Common base of robots whose three links end at one point: the platform's centre is on three spheres.

A link is a pair of bars side by side, a parallelogram that keeps the platform from turning. The driven end of link i,
moved inwards by the platform's radius, is E_i(q_i); the platform's centre P keeps the link's length from it, which the
3-PTT and the rotary Delta have in common:

    |P - E_i(q_i)|^2 - L_i^2 = 0,   i = 1, 2, 3

Of the two points that the spheres share, the platform is at the lower one: z points up and the platform hangs below.
Lengths in mm, angles in rad.
"""

from abc import abstractmethod
from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np

from rrru.arrays import FloatArray
from rrru.kinematics import singularity
from rrru.kinematics.legs import Bar, Joint, Leg, X, Y, cross
from rrru.robots.rrru3_kernels import tripod_mean_distance
from rrru.robots.three_legs import ThreeLegs, of_three_legs, points

# both bars of every leg
BARS = tuple(zip(of_three_legs("a bar"), of_three_legs("b bar"), strict=True))
ELBOW_SIGN = {"out": 1.0, "in": -1.0}


class Tripod(ThreeLegs):
    """Base of these mechanisms: they add `inverse_of_legs`, `ends` and `end_rates`.

    LINK: column of the legs' numbers that holds the link.
    """

    LINK: ClassVar[int] = 0

    @abstractmethod
    def inverse_of_legs(self, position_mm: FloatArray, legs: FloatArray, sign: float) -> FloatArray:
        """Actuator values (n, 3) under leg numbers (3, k), in the assembly of a sign; NaN where out of reach."""

    @abstractmethod
    def ends(self, actuators: FloatArray, legs: FloatArray, /) -> FloatArray:
        """Links' driven ends, moved inwards by the platform's radius, (..., n, 3 legs, 3) in mm; actuators (n, 3)."""

    @abstractmethod
    def end_rates(self, actuators: FloatArray, legs: FloatArray, /) -> FloatArray:
        """Derivative (n, 3 legs, 3 axes, k) of `ends` by the legs' numbers (3, k)."""

    def inverse(self, position_mm: FloatArray, deviations: FloatArray | None = None, elbow: str = "out") -> FloatArray:
        """Actuator values (n, 3) for positions (n, 3) in mm; NaN where a leg cannot reach.

        `elbow` is "out" (carriages outside of the platform or above it, elbows outwards: the robots' assembly) or "in".
        """
        return self.inverse_of_legs(points(position_mm), self.numbers(deviations), ELBOW_SIGN[elbow])

    def forward(
        self, actuators: FloatArray, deviations: FloatArray | None = None, guess_mm: FloatArray | None = None
    ) -> FloatArray:
        """Positions (n, 3) in mm of actuator values (n, 3), in closed form; NaN where the links do not meet.

        guess_mm is not needed: of the two assemblies the platform is in the lower one.
        """
        return self.forward_of_legs(actuators, self.numbers(deviations))

    def forward_batch(
        self, actuators: FloatArray, deviations: FloatArray, guess_mm: FloatArray | None = None
    ) -> FloatArray:
        """Positions (m, n, 3) in mm of n actuator triples under m vectors of deviations (m, p); see `forward`."""
        return self.forward_of_legs(actuators, self.numbers(deviations)[:, None])

    def forward_of_legs(self, actuators: FloatArray, legs: FloatArray) -> FloatArray:
        """Positions (..., 3) in mm of actuator values (n, 3) under leg numbers (..., 3, k) that fit them."""
        legs = np.asarray(legs, dtype=float)
        return lower_intersection(self.ends(points(actuators), legs), legs[..., self.LINK])

    def mean_distance(
        self, actuators: FloatArray, _nominal_mm: FloatArray, measured_mm: FloatArray
    ) -> Callable[[FloatArray], FloatArray]:
        """Objective: deviations (m, p) to mean distances (m,) in mm from measured positions (n, 3)."""
        measured_mm = np.ascontiguousarray(measured_mm, dtype=float)

        def evaluate(deviations: FloatArray) -> FloatArray:
            legs = self.numbers(deviations)
            ends = np.ascontiguousarray(self.ends(points(actuators), legs[:, None]))
            return tripod_mean_distance(ends, np.ascontiguousarray(legs[..., self.LINK]), measured_mm)

        return evaluate

    def closure(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """Left sides (n, 3) of the closures in mm^2, zero where position and actuator values fit."""
        legs = self.numbers(deviations)
        link = points(position_mm)[:, None, :] - self.ends(points(actuators), legs)
        return np.asarray((link**2).sum(axis=-1) - legs[:, self.LINK] ** 2)

    def closure_jacobians(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the closures by the position (n, 3, 3) in mm and by the legs' numbers (n, 3, k)."""
        legs = self.numbers(deviations)
        actuators = points(actuators)
        by_position = 2.0 * (points(position_mm)[:, None, :] - self.ends(actuators, legs))
        by_leg = -np.einsum("nlk,nlkc->nlc", by_position, self.end_rates(actuators, legs))
        by_leg[..., self.LINK] = -2.0 * legs[:, self.LINK]
        return by_position, by_leg

    def constraint_moments(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """Unit directions (n, 3 legs, 3) about which each leg's parallelogram keeps the platform from turning."""
        across = np.cross(self.tangent, self.link_directions(position_mm, actuators, deviations))
        return np.asarray(across / np.linalg.norm(across, axis=-1, keepdims=True))

    def link_directions(
        self, position_mm: FloatArray, actuators: FloatArray, deviations: FloatArray | None = None
    ) -> FloatArray:
        """Unit vectors (n, 3 legs, 3) along the links, from the driven end to the platform."""
        return singularity.leg_forces(self, position_mm, actuators, deviations)


def pair_of_bars(
    leg: int, joints: tuple[Joint, ...], root: FloatArray, sizes_mm: tuple[float, float, float]
) -> Iterator[Leg]:
    """Both Legs of a leg's bars, side by side behind joints that leave their frame as it stands on the base.

    root (3, 3): that frame, x outwards; sizes_mm: length of the bars, radius of the platform, distance of the bars.
    """
    length, radius, spacing = sizes_mm
    for name, side in (("a", -0.5 * spacing * Y), ("b", 0.5 * spacing * Y)):
        ball = Joint(f"leg {leg} {name} ball", shift_mm=side)
        yield Leg(f"leg {leg} {name}", (*joints, ball), bar=Bar(length, root @ (radius * X + side)))


def lower_intersection(centres_mm: FloatArray, radii_mm: FloatArray) -> FloatArray:
    """Lower, in z, of the two points (..., 3) that three spheres share; NaN where there is none.

    centres_mm: (..., 3 spheres, 3); radii_mm: broadcast to (..., 3). The two points mirror each other in the centres'
    plane. With u along the line of the first two centres, at the distance d, and v across it in their plane, where the
    third centre lies at (i, j),

        x = (d^2 + r1^2 - r2^2) / 2d,   y = (i^2 + j^2 + r1^2 - r3^2 - 2 i x) / 2j,   h^2 = r1^2 - x^2 - y^2.
    """
    centres = np.asarray(centres_mm, dtype=float)
    squares = np.broadcast_to(np.asarray(radii_mm, dtype=float) ** 2, centres.shape[:-1])
    first, second, third = centres[..., 0, :], centres[..., 1, :], centres[..., 2, :]
    with np.errstate(invalid="ignore", divide="ignore"):
        d = np.linalg.norm(second - first, axis=-1)
        along = (second - first) / d[..., None]
        i = ((third - first) * along).sum(axis=-1)
        perpendicular = third - first - i[..., None] * along
        j = np.linalg.norm(perpendicular, axis=-1)
        across = perpendicular / j[..., None]
        x = (d**2 + squares[..., 0] - squares[..., 1]) / (2.0 * d)
        y = (i**2 + j**2 + squares[..., 0] - squares[..., 2] - 2.0 * i * x) / (2.0 * j)
        height = np.sqrt(squares[..., 0] - x**2 - y**2)
        normal = cross(along, across)
        # centres in an upright plane have no lower side
        down = np.where(normal[..., 2:] == 0.0, np.nan, -np.sign(normal[..., 2:]))
        return np.asarray(first + x[..., None] * along + y[..., None] * across + down * height[..., None] * normal)
