"""What the periodic drive errors share: amplitude and phase per leg as parameters, sine and cosine parts as
coordinates.
"""

import numpy as np

from rrru.effects.effect import LEGS, Coordinates
from rrru.parameters import Parameter


def harmonic_parameters(source, unit="rad", highest=0.01):
    """Amplitudes (3) in the drive's unit and phases (3) in rad, as a tuple of parameters."""
    return (
        *(Parameter(f"amplitude{k}", unit, 0.0, 0.0, highest, source) for k in LEGS),
        *(Parameter(f"phase{k}", "rad", 0.0, -np.pi, np.pi, "free") for k in LEGS),
    )


def harmonic(drive, periods, values):
    """Errors a_i sin(N theta_i + p_i), shape (n, 3), of angles (n, 3); values: amplitudes (3) and phases (3) first; N
    periods per turn.
    """
    return values[:3] * np.sin(periods * drive + values[3:6])


def harmonic_coordinates(parameters, typical, shapes=({},)):
    """Coordinates sine1, cosine1, sine2, ... in the drive's unit: the error is s_i sin(N q_i) + c_i cos(N q_i)."""

    def to_values(coordinates, shape):
        sine, cosine = np.reshape(coordinates, (3, 2)).T
        amplitude, phase = np.hypot(sine, cosine), np.arctan2(cosine, sine)
        named = {f"amplitude{k}": a for k, a in zip(LEGS, amplitude, strict=True)}
        return parameters.vector(dict(shape) | named | {f"phase{k}": p for k, p in zip(LEGS, phase, strict=True)})

    return Coordinates(
        typical=np.full(6, float(typical)),
        legs=np.repeat(LEGS, 2),
        positive=np.zeros(6, dtype=bool),
        to_values=to_values,
        shapes=tuple(shapes),
        most=np.full(6, parameters["amplitude1"].high),
    )
