"""What small deviations anywhere in the legs do to the platform, to first order.

With its drive locked, leg i of the 3-RRRU resists two things, whatever its passive joints do: motion of the U-joint's
centre C_i along the forearm g_i, and rotation about b_i (`rrru.robots.singularity`). Deviations of the leg, a shift d
and a rotation w at a point D of it, move its end by

    a_i = g_i . (d + w x (C_i - D)),   c_i = b_i . w

and the platform's centre P follows with the velocity v and the rotation o of (principle of reciprocal screws: Ball,
Theory of Screws, 1900)

    g_i . (v + o x (C_i - P)) = a_i,   b_i . o = c_i,   i = 1, 2, 3

Every deviation of a leg therefore counts by the two numbers (a_i, c_i). A tripod's leg keeps P at the length of its
link from the end E_i; with g_i along the link, a shift d of the end, or of the platform's joint against the link, and a
change of length dL count by the one number

    g_i . v = a_i,   a_i = g_i . d + dL

# ASSUME a tripod's platform does not turn: U joints and parallelograms keep it upright even where a rail leans.
Lengths in mm, angles in rad.
"""

from functools import cached_property

import numpy as np

from rrru.robots import singularity
from rrru.robots.rrru3 import Rrru3


def first_order(mechanism, position_mm, actuators, deviations=None):
    """The map from the legs to the platform at n poses (n, 3), (n, 3) that fit a mechanism's deviations (p,)."""
    kind = FirstOrder if isinstance(mechanism, Rrru3) else TripodFirstOrder
    return kind(mechanism, position_mm, actuators, deviations)


class _LegMap:
    """Base of both maps, which add `response`, `drive`, `length`, `position_mm` and unit vectors `along` (n, 3, 3)."""

    def _along(self, contribution):
        """Numbers a_i (n, 3) of what an effect contributes, its displacements and frame apart."""
        result = self.drive * contribution.drive
        if np.ndim(contribution.length_mm):
            result = result + (self.length * contribution.length_mm).sum(axis=-1)
        if np.ndim(contribution.joint_mm):
            result = result + (self.along * contribution.joint_mm).sum(axis=-1)
        return result

    def move(self, contribution):
        """Change (n, 3) of the measured position in mm under what an effect contributes."""
        result = np.einsum("nalc,nlc->na", self.response, self.leg_deviations(contribution))
        if np.ndim(contribution.frame):
            result = result + contribution.frame[:3] + np.cross(contribution.frame[3:], self.position_mm)
        return result


class FirstOrder(_LegMap):
    """The map from the legs of the 3-RRRU to its platform's centre at n poses.

    position_mm, theta_rad: (n, 3), a pose that fits the deviations (p,) of the mechanism.
    """

    def __init__(self, mechanism, position_mm, theta_rad, deviations=None):
        legs = mechanism.legs(deviations)
        passive = mechanism.passive_angles(position_mm, theta_rad, deviations)
        arm = np.asarray(theta_rad) + legs[:, 0]
        plane = arm + passive[..., 0]
        self.along = singularity.leg_forces(mechanism, position_mm, theta_rad, deviations)
        self.moment = mechanism.constraint_moments(position_mm, theta_rad, deviations)
        self.position_mm = np.asarray(position_mm, dtype=float)
        # local axes (n, 3 legs, 3 axes, 3) at the six places of the chain, and the lever (n, 3 legs, 3) from each to C
        leg_axes = mechanism.leg_axes
        in_arm, in_plane = _pitched(leg_axes, arm), _pitched(leg_axes, plane)
        in_forearm = _yawed(in_plane, passive[..., 1])
        in_wrist = _yawed(in_forearm, passive[..., 2])
        everywhere = np.broadcast_to(leg_axes, in_arm.shape)
        self.axes = np.stack([everywhere, in_arm, in_plane, in_forearm, in_wrist, everywhere], axis=2)
        forearm = legs[:, 3, None] * self.along
        offset = legs[:, 2, None] * in_plane[..., 0, :]
        platform = np.broadcast_to(mechanism.r_mm * mechanism.radial, forearm.shape)
        none = np.zeros_like(forearm)
        to_arm = legs[:, 1, None] * in_arm[..., 0, :]
        self.levers = np.stack([to_arm + offset + forearm, offset + forearm, forearm, none, none, platform], axis=2)
        self._tangent = mechanism.tangent

    @cached_property
    def response(self):
        """Motion of the platform's centre per (a_i, c_i): (n, 3 axes, 3 legs, 2), mm per mm and mm per rad."""
        to_centre = np.linalg.inv(self.along)
        to_rotation = np.linalg.inv(self.moment)
        twisting = np.cross(self.levers[:, :, 5], self.along)
        return np.stack([to_centre, -to_centre @ twisting @ to_rotation], axis=-1)

    @cached_property
    def drive(self):
        """a_i per drive angle: (n, 3), mm per rad."""
        return np.einsum("nlk,nlk->nl", self.along, np.cross(-self._tangent, self.levers[:, :, 0]))

    @cached_property
    def length(self):
        """a_i per change of R, L1, L2, L3, r: (n, 3 legs, 5)."""
        along = np.stack([*(self.axes[:, :, place, 0] for place in range(4)), -self.axes[:, :, 5, 0]], axis=2)
        return np.einsum("nlk,nlck->nlc", self.along, along)

    @cached_property
    def displacement(self):
        """(a_i, c_i) per displacement in local axes: (n, 3 legs, 6 places, 6, 2)."""
        shift = np.einsum("nlk,nlpak->nlpa", self.along, self.axes)
        turn = np.einsum("nlk,nlpak->nlpa", self.along, np.cross(self.axes, self.levers[:, :, :, None, :]))
        twist = np.einsum("nlk,nlpak->nlpa", self.moment, self.axes)
        return np.stack(
            [np.concatenate([shift, turn], axis=-1), np.concatenate([np.zeros_like(shift), twist], axis=-1)], axis=-1
        )

    def leg_deviations(self, contribution):
        """Numbers (a_i, c_i), (n, 3, 2), of what an effect contributes, its frame apart."""
        first = self._along(contribution)
        result = np.stack([first, np.zeros_like(first)], axis=-1)
        if np.ndim(contribution.displacement):
            result = result + np.einsum("nlpac,lpa->nlc", self.displacement, contribution.displacement)
        return result


class TripodFirstOrder(_LegMap):
    """The map from the legs of a `rrru.robots.tripod.Tripod` to its platform's centre at n poses.

    position_mm, actuators: (n, 3), a pose that fits the deviations (p,) of the mechanism.
    """

    def __init__(self, mechanism, position_mm, actuators, deviations=None):
        legs, actuators = mechanism.legs(deviations), np.asarray(actuators, dtype=float)
        self.position_mm = np.asarray(position_mm, dtype=float)
        self.along = mechanism.link_directions(position_mm, actuators, deviations)
        self.axes = mechanism.leg_axes
        self.levers = mechanism.levers(actuators, legs)
        self._arm, self._rates = mechanism.ARM, mechanism.end_rates(actuators, legs)

    @cached_property
    def response(self):
        """Motion of the platform's centre per a_i: (n, 3 axes, 3 legs, 1), mm per mm."""
        return np.linalg.inv(self.along)[..., None]

    @cached_property
    def drive(self):
        """a_i per actuator value: (n, 3)."""
        return np.einsum("nlk,nlk->nl", self.along, self._rates[..., 0])

    @cached_property
    def length(self):
        """a_i per change of R, L1, L2, L3, r: (n, 3 legs, 5)."""
        out = (self.along * self.axes[:, 0]).sum(axis=-1)
        arm = np.zeros_like(out) if self._arm is None else (self.along * self._rates[..., self._arm]).sum(axis=-1)
        return np.stack([out, arm, np.zeros_like(out), np.ones_like(out), -out], axis=-1)

    def leg_deviations(self, contribution):
        """Numbers a_i (n, 3, 1) of what an effect contributes, its frame apart; of displacements those at the base."""
        result = self._along(contribution)
        if np.ndim(contribution.displacement):
            result = result + (self.along * base_shift(self.axes, self.levers, contribution.displacement)).sum(axis=-1)
        return result[..., None]


def base_shift(axes, levers, displacement):
    """Shift (n, 3 legs, 3) of the links' ends in mm by the legs' displacements at the base (3 legs, 6 places, 6).

    axes (3 legs, 3 axes, 3): the legs' frames, in which displacements are given; levers (n, 3 legs, 3): from the leg's
    foot to the end.
    """
    shift = np.einsum("lak,la->lk", axes, displacement[:, 0, :3])
    turn = np.einsum("lak,la->lk", axes, displacement[:, 0, 3:])
    return shift + np.cross(turn, levers)


def _pitched(axes, angle):
    """Axes (3 legs, 3, 3) turned by angles (n, 3) about their own -y: (n, 3, 3, 3)."""
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    x, y, z = axes[:, 0], axes[:, 1], axes[:, 2]
    return np.stack([c * x + s * z, np.broadcast_to(y, (*angle.shape, 3)), c * z - s * x], axis=-2)


def _yawed(axes, angle):
    """Axes (n, 3 legs, 3, 3) turned by angles (n, 3) about their own z."""
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    x, y, z = axes[..., 0, :], axes[..., 1, :], axes[..., 2, :]
    return np.stack([c * x + s * y, c * y - s * x, z], axis=-2)
