"""What periodic drive errors share: amplitude and phase of each leg as parameters, sine and cosine as coordinates."""

import numpy as np

from rrru.effects.protocol import Coordinates, leg_parameters
from rrru.parameters import LEGS


def harmonic_parameters(source, unit="rad", highest=0.01):
    """Amplitudes (3) in the drive's unit and phases (3) in rad, as a tuple of parameters."""
    amplitudes = leg_parameters(source, ("amplitude", unit, 0.0, highest))
    return (*amplitudes, *leg_parameters("free", ("phase", "rad", -np.pi, np.pi)))


def harmonic(drive, periods, values):
    """Errors a_i sin(N theta_i + p_i), (n, 3), of angles (n, 3); values: amplitudes, phases; N periods a turn."""
    return values[:3] * np.sin(periods * drive + values[3:6])


def harmonic_coordinates(parameters, typical, shapes=({},)):
    """Coordinates sine1, cosine1, sine2, ... in the drive's unit: the error is s_i sin(N q_i) + c_i cos(N q_i).

    parameters: those of `harmonic_parameters` first.
    """
    names = parameters.names[:6]

    def to_values(coordinates, shape):
        sine, cosine = np.reshape(coordinates, (3, 2)).T
        values = np.concatenate([np.hypot(sine, cosine), np.arctan2(cosine, sine)])
        return parameters.vector(dict(shape) | dict(zip(names, values, strict=True)))

    return Coordinates(
        typical=np.full(6, float(typical)),
        legs=np.repeat(LEGS, 2),
        positive=np.zeros(6, dtype=bool),
        to_values=to_values,
        shapes=tuple(shapes),
        most=np.full(6, parameters[names[0]].high),
    )
