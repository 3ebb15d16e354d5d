"""What small errors in the legs of a tripod do to the platform, to first order.

With its drive locked, leg i keeps the platform's centre P at the length of its link from the end E_i; g_i points along
the link to the platform. A shift d of the end, or of the platform's joint against the link, and a change of length dL
move P with the velocity v of

    g_i . v = a_i,   a_i = g_i . d + dL

so that every error of a leg counts by the one number a_i, its leg error.

# ASSUME the platform does not turn: U joints and parallelograms keep it upright even where a rail leans. Lengths in mm,
angles in rad.
"""

from functools import cached_property

import numpy as np


class TripodFirstOrder:
    """The map from leg errors to the platform's centre at n poses of a `rrru.robots.tripod.Tripod`.

    position_mm, actuators: (n, 3), a pose that fits the deviations (p,) of the mechanism.
    """

    def __init__(self, mechanism, position_mm, actuators, deviations=None):
        legs = mechanism.legs(deviations)
        self.position_mm = np.asarray(position_mm, dtype=float)
        self.link = mechanism.link_directions(position_mm, actuators, deviations)
        self.radial = mechanism.radial
        self.axes = mechanism.leg_axes
        rates = mechanism.end_rates(np.asarray(actuators, dtype=float), legs)
        self._by_drive, self._by_arm = rates[..., 0], mechanism.arm_rates(rates)
        self.levers = mechanism.levers(np.asarray(actuators, dtype=float), legs)

    @cached_property
    def response(self):
        """Motion of the platform's centre per leg error: (n, 3 axes, 3 legs, 1), mm per mm."""
        return np.linalg.inv(self.link)[..., None]

    @cached_property
    def drive(self):
        """Leg error per actuator value: (n, 3)."""
        return np.einsum("nlk,nlk->nl", self.link, self._by_drive)

    @cached_property
    def length(self):
        """Leg error per change of R, L1, L2, L3, r: (n, 3 legs, 5)."""
        out = (self.link * self.radial).sum(axis=-1)
        arm = (self.link * self._by_arm).sum(axis=-1)
        return np.stack([out, arm, np.zeros_like(out), np.ones_like(out), -out], axis=-1)

    def leg_errors(self, contribution):
        """Leg errors (n, 3, 1) of what an effect contributes, its frame apart; of displacements those at the base."""
        result = self.drive * contribution.drive
        if np.ndim(contribution.length_mm):
            result = result + (self.length * contribution.length_mm).sum(axis=-1)
        if np.ndim(contribution.joint_mm):
            result = result + (self.link * contribution.joint_mm).sum(axis=-1)
        if np.ndim(contribution.displacement):
            result = result + (self.link * base_shift(self.axes, self.levers, contribution.displacement)).sum(axis=-1)
        return result[..., None]

    def move(self, contribution):
        """Change (n, 3) of the measured position in mm under what an effect contributes."""
        result = np.einsum("nalc,nlc->na", self.response, self.leg_errors(contribution))
        if np.ndim(contribution.frame):
            result = result + contribution.frame[:3] + np.cross(contribution.frame[3:], self.position_mm)
        return result


def base_shift(axes, levers, displacement):
    """Shift (n, 3 legs, 3) of the links' ends in mm by the legs' displacements at the base (3 legs, 6 places, 6).

    axes (3 legs, 3 axes, 3): the legs' frames, in which displacements are given; levers (n, 3 legs, 3): from the leg's
    foot to the end.
    """
    shift = np.einsum("lak,la->lk", axes, displacement[:, 0, :3])
    turn = np.einsum("lak,la->lk", axes, displacement[:, 0, 3:])
    return shift + np.cross(turn, levers)
