"""Joint clearance: the U-joint's pin lies on the side of its bore towards which the leg pushes.

With the force f_i that leg i transmits along the unit direction g_i, the bore (the platform) lags behind the pin (the forearm) by the radial
clearance c_i (massless contact model; Parenti-Castelli and Venanzi, Mechanism and Machine Theory 40, 2005):

    shift_i = -c_i sign(f_i) g_i

It flips with the sign of the force and vanishes where the leg transmits none.
"""

from dataclasses import dataclass

import numpy as np

from rrru.effects.protocol import Contribution
from rrru.parameters import Parameter, ParameterSet

_PARAMETERS = ParameterSet(
    tuple(Parameter(f"clearance{k}", "mm", 0.0, 0.0, 2.0, "paper A, section 3.3 blames it; size assumed") for k in (1, 2, 3))
)


@dataclass(frozen=True)
class JointClearance:
    """Radial clearance per leg in the U joint."""

    name: str = "joint_clearance"
    parameters: ParameterSet = _PARAMETERS

    def contribute(self, motion, values):
        """Shifts of the platform's U-joint centres against the forearms under clearances (3,) in mm."""
        push = np.sign(motion.force_n) * np.asarray(values, dtype=float)
        return Contribution(joint_mm=-push[..., None] * motion.force_direction)
