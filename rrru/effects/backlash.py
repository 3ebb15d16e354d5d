"""Backlash: lost motion between motor and drive arm.

The arm's angle y follows the motor's angle u only after the motor has crossed the width w of the backlash. This is the
play operator of hysteresis theory (Krasnosel'skii and Pokrovskii, Systems with Hysteresis, 1989, section 2):

    y_k = min(max(y_{k-1}, u_k - w / 2), u_k + w / 2),    dtheta_k = y_k - u_k

It depends on the path, not only on the sign of the speed. A drive that turns back by less than w does not move the arm.
One that has turned back by more drags it along w / 2 behind. It enters at the drive angle, one width per leg. For most
points of a campaign every turn-back is longer than the width; there the effect is linear in w:

    dtheta = -(w / 2) sign(du)

Assumptions: friction holds the arm within the backlash, so that neither gravity nor inertia carries it across. (A load
that never changes its sign would hold the arm at one side, and the error would be constant.) The backlash starts
centred at the first angle of the campaign; motor and path are those commanded. Points of the path at which the angle is
unknown are skipped.

Source: as above; Nordin and Gutman, Controlling mechanical systems with backlash - a survey, Automatica 38, 2002. The
size is assumed: cheaper worm and planetary drives have some arc minutes, 1 arc minute is 2.9e-4 rad. A screw drive has
the backlash of its nut in mm (paper B, section 3.1).
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.protocol import PATH, Contribution, Effect, Motion, drive_parameters, of_drives, plain_coordinates
from rrru.kinematics.robot import Robot
from rrru.kinematics.typed_numba import njit
from rrru.parameters import ParameterSet

_SOURCE = {
    "rad": "backlash of worm and harmonic drives: up to some arc minutes",
    "mm": "paper B, eq. (19) measures it; size assumed",
}
_HIGHEST = {"rad": ("rad", 0.0, 0.02), "mm": ("mm", 0.0, 1.0)}
_TYPICAL = {"rad": 5e-4, "mm": 0.02}


@njit(cache=True)
def play(path: FloatArray, half_width: FloatArray) -> FloatArray:
    """Play operator along a path (N, k) with half widths (k,), same unit: y - u (N, k), NaN where unknown."""
    result = np.empty_like(path)
    for leg in range(path.shape[1]):
        y = np.nan
        for k in range(path.shape[0]):
            u = path[k, leg]
            if np.isnan(y):
                y = u
            elif not np.isnan(u):
                y = min(max(y, u - half_width[leg]), u + half_width[leg])
            result[k, leg] = y - u
    return result


def _lost_motion(motion: Motion, values: FloatArray) -> Contribution:
    """Changes of the actuator values under widths (K,) in their unit."""
    changes = play(np.ascontiguousarray(motion.path_drive), 0.5 * values)[motion.path_index]
    return motion.at_drives(motion.with_approach(changes, -0.5 * values))


def for_robot(robot: Robot) -> Effect:
    """The effect model for all drives."""
    drives = robot.parts.drives
    parameters = ParameterSet(drive_parameters(drives, _SOURCE, ("width", _HIGHEST)))
    return Effect(
        "backlash", parameters, plain_coordinates(parameters, of_drives(drives, _TYPICAL)), _lost_motion, (PATH,)
    )
