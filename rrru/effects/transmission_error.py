"""Transmission error: a periodic drive-angle error with a whole number of periods per turn of the drive arm.

Meshing and eccentricity errors of a reduction stage repeat with the turns of its shafts (Litvin and Fuentes, Gear Geometry and Applied Theory,
2004, ch. 17); with N periods per turn of the arm, amplitude a_i and phase p_i:

    dtheta_i = a_i sin(N theta_i + p_i)
"""

from dataclasses import dataclass

import numpy as np

from rrru.effects.protocol import Contribution
from rrru.parameters import Parameter, ParameterSet

_PARAMETERS = ParameterSet(
    (
        *(Parameter(f"amplitude{k}", "rad", 0.0, 0.0, 0.01, "assumed: up to some arc minutes") for k in (1, 2, 3)),
        *(Parameter(f"phase{k}", "rad", 0.0, -np.pi, np.pi, "free") for k in (1, 2, 3)),
        Parameter("ratio", "1", 50.0, 1.0, 1000.0, "gear ratio, 50 by default"),
    )
)


@dataclass(frozen=True)
class TransmissionError:
    """Sine in the drive angle, amplitude and phase per leg; `ratio` periods per turn."""

    name: str = "transmission_error"
    parameters: ParameterSet = _PARAMETERS

    def contribute(self, motion, values):
        """Changes of the drive angles under amplitudes (3,), phases (3,) in rad and the ratio."""
        return Contribution(drive_rad=values[:3] * np.sin(values[6] * motion.theta_rad + values[3:6]))
