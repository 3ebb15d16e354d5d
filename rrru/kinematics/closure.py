"""Exact loop closure of any robot's legs: Newton on the platform's pose and the passive joints, all n points at once.

At a guessed pose T of the platform, leg i ends elsewhere by the small twist e_i. With S_i its passive joints'
screws and W_i the wrenches reciprocal to them, W_i S_i = 0, the step obeys

    T - S_i dp_i = e_i   =>   W_i T = W_i e_i,   stacked over the legs   A T = b,   dp_i = S_i^+ (T - e_i)

The W_i of legs that share passive joints are blocks of one W (`rrru.kinematics.wrenches`); their equations are added. A
bar has one wrench, the unit force along its line, and e_i its missing length. More than six wrenches are met by
least squares. Screws and twists are at the world's origin, the velocity first: (v, w). Lengths in mm, angles in rad.
"""

import numpy as np

from rrru.errors import ConfigError
from rrru.kinematics.chain import Poses, Twists
from rrru.kinematics.closure_kernel import ARM_MM
from rrru.kinematics.closure_tables import closed, tables
from rrru.kinematics.wrenches import SCALE, by_group, constraints_of, spare_joints, wrenches_of


class Closure:
    """The closed legs of a robot; raises ConfigError where they do not hold the platform.

    rows: of every leg its rows of A, the same for all legs that share passive joints; row_count: of all.
    """

    def __init__(self, legs):
        self.legs, groups = legs, legs.groups
        self._spare = spare_joints(legs)
        counts = constraints_of(legs, self._spare)
        # one leg, whose end is the platform's
        self._driven = len(legs.legs) == 1 and counts == [6] and not legs.passive_joints
        if sum(counts) < 6:
            raise ConfigError(f"the legs hold the platform by {sum(counts)} constraints; allowed: at least 6")
        self._tables = tables(legs, self._spare)
        # with more than six constraints lengths, of bars and of chains' shifts, count in units of the arm
        weights = [1.0 / ARM_MM if legs.legs[group[0]].bar else 1.0 for group in groups]
        self._weights = np.repeat(weights, counts)[:, None]
        ends = np.cumsum([0, *counts])
        slices = {k: slice(*ends[row : row + 2]) for row, group in enumerate(groups) for k in group}
        self.row_count, self.rows = int(ends[-1]), [slices[k] for k in range(len(legs.legs))]

    def wrenches(self, ways, _poses):
        """Wrenches (n, r, 6) of every leg that are reciprocal to its passive joints."""
        return wrenches_of(self.legs, self._spare, ways)

    def inverse(self, wrenches):
        """Twists (n, 6, rows) of the platform per constraint, the inverse of the wrenches A of all legs."""
        if self._driven:
            return np.broadcast_to(np.eye(6), wrenches[0].shape)
        rows = np.concatenate(by_group(self.legs, wrenches), axis=1)
        return SCALE[:, None] * _inverse(rows * SCALE * self._weights) * self._weights.T

    def solve(self, actuators, start, twists=None):
        """Poses at actuator values (n, K) next to the Poses `start`, under finite twists (n or 1, sites, 6).

        NaN where Newton does not converge.
        """
        driven = self.legs.driven(actuators)
        return Poses(*closed(self._tables, driven, start, Twists(self.legs, twists), self.row_count == 6))


def _inverse(matrices):
    """Inverses of (n, r, 6), those of least squares for r > 6 and where a matrix is singular."""
    if matrices.shape[1] == 6:
        try:
            return np.linalg.inv(matrices)
        except np.linalg.LinAlgError:
            pass
    return np.linalg.pinv(matrices)
