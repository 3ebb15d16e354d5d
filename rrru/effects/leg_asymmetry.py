"""Leg asymmetry: the three legs' link lengths differ.

Leg i has its own arm, offset and forearm,

    L1_i = L1 + dL1_i,    L2_i = L2 + dL2_i,    L3_i = L3 + dL3_i

where the calibration of paper A knows one number per link for all legs (its 14 errors, tied to 8; 7 of them can be
identified). It enters at the lengths, nine numbers, and is linear in them; the position follows from eq. (8) leg by
leg, and the platform does not turn.

The part common to the legs, (dLk_1 + dLk_2 + dLk_3) / 3, is the calibration's own dLk: a gauge, so that two of the
three numbers per link are new. L2 and L3 of one leg act nearly alike, since rho = L2 + sqrt(L3^2 - v^2) tells them
apart only where the tangential offset v of the platform is large.

A robot with one link per leg (SLIDER) has the three dL3_i only.

Assumptions: rigid links, constant over the campaign.

Source: paper A, section 2.2 (the 14 errors); the bounds are those of its calibration here. Typical size assumed: what a
workshop holds on welded or clamped links of this length, ISO 2768-1 class m (+-0.8 mm from 400 to 1000 mm).
"""

from dataclasses import dataclass

import numpy as np

from rrru.effects.effect import LEGS, Contribution, Coordinates, plain_coordinates
from rrru.parameters import Parameter, ParameterSet

_LINKS = (1, 2, 3)
_PARAMETERS = ParameterSet(
    tuple(
        Parameter(f"dL{k}_leg{leg}", "mm", 0.0, -4.0, 4.0, "paper A, section 2.2; bounds assumed")
        for leg in LEGS
        for k in _LINKS
    )
)
_COORDINATES = plain_coordinates(_PARAMETERS, 0.3)


@dataclass(frozen=True)
class LegAsymmetry:
    """Link lengths of every leg by themselves; links: the numbers of those that a leg has."""

    name: str = "leg_asymmetry"
    parameters: ParameterSet = _PARAMETERS
    coordinates: Coordinates = _COORDINATES
    needs: tuple = ()
    links: tuple = _LINKS

    def contribute(self, motion, values):
        """Changes (n, 3, 5) of the lengths under dL of the links of leg 1, then of legs 2 and 3, (3 times the links,)
        in mm.
        """
        length = np.zeros((len(motion), 3, 5))
        length[..., self.links] = np.reshape(values, (3, len(self.links)))
        return Contribution(length_mm=length)


_ONE_LINK = ParameterSet(
    tuple(Parameter(f"dL_leg{leg}", "mm", 0.0, -4.0, 4.0, "workshop tolerance, assumed") for leg in LEGS)
)
SLIDER = LegAsymmetry(parameters=_ONE_LINK, coordinates=plain_coordinates(_ONE_LINK, 0.3), links=(3,))
