"""What robots share whose three links all end at one point: the platform's centre lies on three spheres.

The driven end of link i, moved inwards by the platform's radius, is E_i(q_i); the platform's centre P keeps the link's
length from it,

    |P - E_i(q_i)|^2 - L_i^2 = 0,   i = 1, 2, 3

which the 3-PTT and the rotary Delta have in common. z points up and the platform hangs below. Lengths in mm, angles in
rad.
"""

from functools import cached_property

import numpy as np

from rrru.errors import ConfigError
from rrru.parameters import Parameter, ParameterSet
from rrru.robots.spheres import lower_intersection
from rrru.robots.three_legs import ThreeLegs, points

ELBOW_SIGN = {"out": 1.0, "in": -1.0}


class Tripod(ThreeLegs):
    """Base of these mechanisms: they add PARAMETER_NAMES, `inverse_of_legs`, `ends`, `end_rates`, `levers`, and the columns
    of the legs' numbers that hold the link (LINK), the driven arm (ARM, None without one) and R - r (OFFSET).
    """

    LINK = OFFSET = 0
    ARM = None
    # nominal dimensions, kinds of error parameters that are angles, and where the parameters come from
    DIMENSIONS = ANGLES = ()
    SOURCE = ""
    # unit of an actuator value
    drive_unit = "rad"

    def __post_init__(self):
        for key in (*self.DIMENSIONS, "angle_limit_rad", "length_limit_mm"):
            if not getattr(self, key) > 0.0:
                raise ConfigError(f"{self.name}: {key} is {getattr(self, key)}; allowed: a positive number")
        if self.parameter_set not in self.PARAMETER_NAMES:
            raise ConfigError(
                f"{self.name}: parameter_set is {self.parameter_set!r}; allowed: {', '.join(self.PARAMETER_NAMES)}"
            )

    @cached_property
    def parameters(self):
        """The error parameters, nominally zero: the meaning of every `errors` vector."""
        return ParameterSet(tuple(self._parameter(name) for name in self.PARAMETER_NAMES[self.parameter_set]))

    def _parameter(self, name):
        """One error parameter."""
        angle = name.rstrip("123") in self.ANGLES
        limit = self.angle_limit_rad if angle else self.length_limit_mm
        return Parameter(name, "rad" if angle else "mm", 0.0, -limit, limit, self.SOURCE)

    @property
    def radial(self):
        """Outward unit vectors (3 legs, 3)."""
        cx, cy = self.turn
        return np.stack([cx, cy, np.zeros(3)], axis=-1)

    @property
    def tangent(self):
        """Tangential unit vectors (3 legs, 3), counter-clockwise seen from above."""
        cx, cy = self.turn
        return np.stack([-cy, cx, np.zeros(3)], axis=-1)

    @property
    def leg_axes(self):
        """Frames of the legs, radial, tangential and up, as rows of (3 legs, 3 axes, 3)."""
        return np.stack([self.radial, self.tangent, np.broadcast_to([0.0, 0.0, 1.0], (3, 3))], axis=1)

    def inverse(self, position_mm, deviations=None, elbow="out"):
        """Actuator values (n, 3) for positions (n, 3) in mm; NaN where a leg cannot reach.

        `elbow` is "out" (carriages outside of the platform or above it, knees outwards: the robots' assembly) or "in".
        """
        return self.inverse_of_legs(points(position_mm), self.legs(deviations), ELBOW_SIGN[elbow])

    def forward(self, actuators, deviations=None, guess_mm=None):
        """Positions (n, 3) in mm of actuator values (n, 3), in closed form; NaN where the links do not meet.

        guess_mm is not needed: of the two assemblies the platform is in the lower one.
        """
        return self.forward_of_legs(actuators, self.legs(deviations))

    def forward_batch(self, actuators, deviations, guess_mm=None):
        """Positions (m, n, 3) in mm of n actuator triples under m error vectors (m, p); see `forward`."""
        return self.forward_of_legs(actuators, self.legs(deviations)[:, None])

    def forward_of_legs(self, actuators, legs, shift_mm=0.0):
        """Positions (..., 3) in mm of actuator values (n, 3) under leg numbers (..., 3, k) that broadcast against them.

        shift_mm: added to the links' ends, (..., 3 legs, 3).
        """
        legs = np.asarray(legs, dtype=float)
        return lower_intersection(self.ends(points(actuators), legs) + shift_mm, legs[..., self.LINK])

    def with_lengths(self, legs, change_mm):
        """Leg numbers (..., 3, k) with changes (..., 3 legs, 5) of R, L1, L2, L3, r in mm."""
        legs = np.array(np.broadcast_to(legs, (*np.shape(change_mm)[:-1], np.shape(legs)[-1])))
        legs[..., self.LINK] += change_mm[..., 3]
        legs[..., self.OFFSET] += change_mm[..., 0] - change_mm[..., 4]
        if self.ARM is not None:
            legs[..., self.ARM] += change_mm[..., 1]
        return legs

    def arm_rates(self, rates):
        """Derivative (n, 3 legs, 3) of the ends by the driven arm's length, from those by all numbers; zero without an
        arm.
        """
        return np.zeros(rates.shape[:-1]) if self.ARM is None else rates[..., self.ARM]

    def closure(self, position_mm, actuators, deviations=None):
        """Left sides (n, 3) of the closures in mm^2, zero where position and actuator values fit."""
        legs = self.legs(deviations)
        link = points(position_mm)[:, None, :] - self.ends(points(actuators), legs)
        return (link**2).sum(axis=-1) - legs[:, self.LINK] ** 2

    def closure_jacobians(self, position_mm, actuators, deviations=None):
        """Derivatives of the closures with respect to the position (n, 3, 3) in mm and to the legs' numbers (n, 3,
        k).
        """
        legs = self.legs(deviations)
        actuators = points(actuators)
        by_position = 2.0 * (points(position_mm)[:, None, :] - self.ends(actuators, legs))
        by_leg = -np.einsum("nlk,nlkc->nlc", by_position, self.end_rates(actuators, legs))
        by_leg[..., self.LINK] = -2.0 * legs[:, self.LINK]
        return by_position, by_leg

    def link_directions(self, position_mm, actuators, deviations=None):
        """Unit vectors (n, 3 legs, 3) along the links, from the driven end to the platform."""
        gradient, _ = self.closure_jacobians(position_mm, actuators, deviations)
        return gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
