"""Any robot's chains closed exactly, with deviations of its numbers and under what effects contribute.

Virtual robots and the diagnosis' corrected sims stand on this. The 3-RRRU closes in space, with a platform that may
turn (`rrru.plant.spatial`); the platform of a tripod only translates. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass

import numpy as np

from rrru.effects.protocol import PLACES
from rrru.plant.spatial import SpatialGeometry, into_frame
from rrru.robots.first_order import base_shift
from rrru.robots.rrru3 import Rrru3


@dataclass(frozen=True)
class TripodGeometry:
    """A tripod and the numbers (3, k) of its real legs."""

    mechanism: object
    legs: np.ndarray

    def solve_under(self, actuators, change):
        """Platform centres (n, 3) in the tracker's frame at actuator values (n, 3) under a Contribution.

        NaN where the links do not meet.
        """
        robot, legs, actuators = self.mechanism, self.legs, np.asarray(actuators, dtype=float)
        shift = np.zeros((len(actuators), 3, 3)) + change.joint_mm
        if np.ndim(change.displacement):
            shift = shift + base_shift(robot.leg_axes, robot.levers(actuators, legs), change.displacement)
        if np.ndim(change.length_mm):
            legs = robot.with_lengths(legs, change.length_mm)
        return into_frame(robot.forward_of_legs(actuators + change.drive, legs, shift), change.frame)


def corrected_sim(mechanism, deviations, actuators, command_mm, change):
    """Positions (n, 3) in mm of a mechanism with deviations (p,) under a Contribution.

    actuators (n, 3): near those of the commands (n, 3).
    """
    legs = mechanism.legs(deviations)
    if not isinstance(mechanism, Rrru3):
        return TripodGeometry(mechanism, legs).solve_under(actuators, change)
    radial = np.full((3, 1), mechanism.R_mm)
    lengths = np.concatenate([radial, legs[:, 1:4], radial + legs[:, 4:]], axis=1)
    geometry = SpatialGeometry(np.array(mechanism.azimuth_rad), lengths, np.zeros((3, len(PLACES), 6)))
    passive = mechanism.passive_angles(command_mm, mechanism.inverse(command_mm))
    return geometry.solve_under(actuators + legs[:, 0], passive, change).position_mm
