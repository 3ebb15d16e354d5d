"""Backlash: play between motor and drive arm.

The arm's angle y follows the motor's angle u only when the play of width w is used up (the play operator of hysteresis theory: Krasnosel'skii
and Pokrovskii, Systems with Hysteresis, 1989, section 2):

    y_k = min(max(y_{k-1}, u_k - w / 2), u_k + w / 2)

so it remembers the path, not only the sign of the speed. The play starts centred at the first angle of the campaign.
"""

from dataclasses import dataclass

import numba
import numpy as np

from rrru.effects.protocol import Contribution
from rrru.parameters import Parameter, ParameterSet


@numba.njit(cache=True)
def play(path, half_width):
    """Play operator along a path (N, k) with half widths (k,), same unit; returns y - u, shape (N, k)."""
    result = np.empty_like(path)
    for leg in range(path.shape[1]):
        y = path[0, leg]
        for k in range(path.shape[0]):
            u = path[k, leg]
            y = min(max(y, u - half_width[leg]), u + half_width[leg])
            result[k, leg] = y - u
    return result


_PARAMETERS = ParameterSet(
    tuple(Parameter(f"width{k}", "rad", 0.0, 0.0, 0.02, "play of worm and harmonic drives: up to some arc minutes") for k in (1, 2, 3))
)


@dataclass(frozen=True)
class Backlash:
    """Play of a width per leg in the drive angle."""

    name: str = "backlash"
    parameters: ParameterSet = _PARAMETERS

    def contribute(self, motion, values):
        """Changes of the drive angles under widths (3,) in rad."""
        along_path = play(np.ascontiguousarray(motion.path_theta_rad), 0.5 * np.asarray(values, dtype=float))
        return Contribution(drive_rad=along_path[motion.path_index])
