"""Rail tilt: a slider's rail does not point where the drawing says.

In the frame of leg k (x radial, y tangential, z up) the rail runs through its zero mark, turned there by the rotation
vector

    w_k = (lean_k, -rise_k, swing_k)

rise lifts a horizontal rail's outer end or leans an upright one inwards, swing turns a horizontal rail about the
vertical, lean an upright one to the side. The carriage at the distance b_k from the zero mark is off by w_k x b_k d_k,
which grows along the rail: what tells it from the zero error of a slider. It enters as a displacement at the place
`base`, nine numbers of which six do something, and is linear in them.

Assumptions: straight rail, true at its zero mark; joints that keep the platform upright all the same; constant over the
campaign.

Source: geometry; squareness and parallelism of guides as in Slocum, Precision Machine Design, 1992. Typical size
assumed: 0.3 mm over 300 mm.
"""

import numpy as np

from rrru.effects.protocol import Contribution, Effect, base_displacement, leg_parameters, plain_coordinates
from rrru.parameters import ParameterSet

_TURNS = tuple((kind, "rad", -0.05, 0.05) for kind in ("lean", "rise", "swing"))
_PARAMETERS = ParameterSet(leg_parameters("seat of the rail, size assumed", *_TURNS))


def _seats(_, values):
    """Displacement of the rails' seats under lean, rise and swing of leg 1, then of legs 2 and 3, (9,) in rad."""
    turn = np.reshape(values, (3, 3)) * [1.0, -1.0, 1.0]
    return Contribution(displacement=base_displacement(np.zeros((3, 3)), turn))


EFFECTS = (Effect("rail_tilt", _PARAMETERS, plain_coordinates(_PARAMETERS, 1e-3), _seats, drives=("mm",)),)
