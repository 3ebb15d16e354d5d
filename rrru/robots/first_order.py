"""What small errors anywhere in the 3-RRRU's legs do to the platform, to first order, with the platform free to turn.

With its drive locked, leg i resists two things, whatever its passive joints do: motion of the U-joint's centre C_i
along the forearm g_i, and rotation about b_i (`rrru.robots.singularity`). Errors of the leg, a shift d and a rotation w
at a point D of it, move its end by

    a_i = g_i . (d + w x (C_i - D)),   c_i = b_i . w

and the platform's centre P follows with the velocity v and the rotation o of (principle of reciprocal screws: Ball,
Theory of Screws, 1900)

    g_i . (v + o x (C_i - P)) = a_i,   b_i . o = c_i,   i = 1, 2, 3

Every error of a leg therefore counts by the two numbers (a_i, c_i), its leg errors. Lengths in mm, angles in rad.
"""

from functools import cached_property

import numpy as np

from rrru.robots import singularity
from rrru.robots.first_order_tripod import TripodFirstOrder
from rrru.robots.rrru3 import Rrru3


def first_order(mechanism, position_mm, actuators, deviations=None):
    """The map from leg errors to the platform of any mechanism at n poses (n, 3), (n, 3) that fit its deviations (p,)."""
    kind = FirstOrder if isinstance(mechanism, Rrru3) else TripodFirstOrder
    return kind(mechanism, position_mm, actuators, deviations)


class FirstOrder:
    """The map from leg errors to the platform's centre at n poses of a mechanism.

    position_mm, theta_rad: (n, 3), a pose that fits the deviations (p,) of the mechanism.
    """

    def __init__(self, mechanism, position_mm, theta_rad, deviations=None):
        legs = mechanism.legs(deviations)
        passive = mechanism.passive_angles(position_mm, theta_rad, deviations)
        arm = np.asarray(theta_rad) + legs[:, 0]
        plane = arm + passive[..., 0]
        cx, cy = mechanism.turn
        zero, down = np.zeros(3), np.array([0.0, 0.0, 1.0])
        radial, tangent = np.stack([cx, cy, zero], axis=-1), np.stack([-cy, cx, zero], axis=-1)
        self.forearm = singularity.leg_forces(mechanism, position_mm, theta_rad, deviations)
        self.couple = mechanism.constraint_moments(position_mm, theta_rad, deviations)
        self.position_mm = np.asarray(position_mm, dtype=float)
        # local axes (n, 3 legs, 3 axes, 3) at the six places of the chain, and the lever (n, 3 legs, 3) from each to C
        leg_axes = np.stack([radial, tangent, np.broadcast_to(down, (3, 3))], axis=-2)
        in_arm, in_plane = _pitched(leg_axes, arm), _pitched(leg_axes, plane)
        in_forearm = _yawed(in_plane, passive[..., 1])
        in_wrist = _yawed(in_forearm, passive[..., 2])
        everywhere = np.broadcast_to(leg_axes, in_arm.shape)
        self.axes = np.stack([everywhere, in_arm, in_plane, in_forearm, in_wrist, everywhere], axis=2)
        forearm = legs[:, 3, None] * self.forearm
        offset = legs[:, 2, None] * in_plane[..., 0, :]
        platform = np.broadcast_to(mechanism.r_mm * radial, forearm.shape)
        none = np.zeros_like(forearm)
        to_arm = legs[:, 1, None] * in_arm[..., 0, :]
        self.levers = np.stack([to_arm + offset + forearm, offset + forearm, forearm, none, none, platform], axis=2)
        self.tangent = np.broadcast_to(tangent, forearm.shape)
        self.radial = np.broadcast_to(radial, forearm.shape)
        self._platform_lever = platform

    @cached_property
    def response(self):
        """Motion of the platform's centre per leg error: (n, 3 axes, 3 legs, 2), mm per mm and mm per rad."""
        to_centre = np.linalg.inv(self.forearm)
        to_rotation = np.linalg.inv(self.couple)
        twisting = np.cross(self._platform_lever, self.forearm)
        return np.stack([to_centre, -to_centre @ twisting @ to_rotation], axis=-1)

    @cached_property
    def drive(self):
        """Leg error a_i per drive angle: (n, 3), mm per rad."""
        return np.einsum("nlk,nlk->nl", self.forearm, np.cross(-self.tangent, self.levers[:, :, 0]))

    @cached_property
    def length(self):
        """Leg error a_i per change of R, L1, L2, L3, r: (n, 3 legs, 5)."""
        along = np.stack([*(self.axes[:, :, place, 0] for place in range(4)), -self.axes[:, :, 5, 0]], axis=2)
        return np.einsum("nlk,nlck->nlc", self.forearm, along)

    @cached_property
    def displacement(self):
        """Leg errors per displacement in local axes: (n, 3 legs, 6 places, 6, 2)."""
        shift = np.einsum("nlk,nlpak->nlpa", self.forearm, self.axes)
        turn = np.einsum("nlk,nlpak->nlpa", self.forearm, np.cross(self.axes, self.levers[:, :, :, None, :]))
        couple = np.einsum("nlk,nlpak->nlpa", self.couple, self.axes)
        return np.stack(
            [np.concatenate([shift, turn], axis=-1), np.concatenate([np.zeros_like(shift), couple], axis=-1)], axis=-1
        )

    def leg_errors(self, contribution):
        """Leg errors (n, 3, 2) of what an effect contributes, its frame apart."""
        first = self.drive * contribution.drive
        if np.ndim(contribution.length_mm):
            first = first + (self.length * contribution.length_mm).sum(axis=-1)
        if np.ndim(contribution.joint_mm):
            first = first + (self.forearm * contribution.joint_mm).sum(axis=-1)
        result = np.stack([first, np.zeros_like(first)], axis=-1)
        if np.ndim(contribution.displacement):
            result = result + np.einsum("nlpac,lpa->nlc", self.displacement, contribution.displacement)
        return result

    def move(self, contribution):
        """Change (n, 3) of the measured position in mm under what an effect contributes."""
        result = np.einsum("nalc,nlc->na", self.response, self.leg_errors(contribution))
        if np.ndim(contribution.frame):
            result = result + contribution.frame[:3] + np.cross(contribution.frame[3:], self.position_mm)
        return result


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
