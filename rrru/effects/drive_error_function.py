"""Drive error function: every turning drive errs by a rough periodic function of its own angle.

An encoder's scale, its mounting, teeth and bearings together make an error that repeats with every turn of the joint
but follows no single wave:

    dtheta_i = sum over n of s_in sin(n theta_i) + c_in cos(n theta_i),   n = 1, 2, .. 64

It enters at the drive angle. The coefficients of order n are independent and normal with a standard deviation in
proportion to 1 / sqrt(1 + (n / b)^4): a Gaussian process on the circle, of waves up to about b per turn, rougher ones
ever weaker. Of some b the likelihood chooses. The spectrum of what is found is the finding. A gear's sharp orders are
`transmission_error` and `transmission_orders`: where few waves do, these need fewer numbers and win.

Assumptions: it depends on the angle only, not on load or sense of motion; one size for all drives.

Source: MacKay, Introduction to Gaussian processes, 1998 (periodic kernels). The size is assumed: 20 arc seconds are
1e-4 rad.
"""

import numpy as np

from rrru.effects.harmonic import waves
from rrru.effects.protocol import Coordinates, Effect
from rrru.parameters import Parameter, ParameterSet

# a law of campaigns of many poses: it is tested where a configuration names it
BY_NAME_ONLY = True

ORDERS = np.arange(1, 65)
_BENDS, _STEEPNESS, _TYPICAL, _MOST = (3.0, 6.0, 12.0, 24.0, 48.0), 4, 1e-4, 0.01


def for_robot(robot):
    """The law for robots whose drives all turn, None for others."""
    if set(robot.parts.units) != {"rad"}:
        return None
    count = len(robot.parts.drives)
    parameters = ParameterSet(
        tuple(
            Parameter(f"{part}{drive}_{order}", "rad", 0.0, -_MOST, _MOST, "assumed", drive)
            for drive in range(1, count + 1)
            for order in ORDERS
            for part in ("sine", "cosine")
        )
    )
    spectra = [
        _TYPICAL * np.tile(np.repeat((1.0 + (ORDERS / bend) ** _STEEPNESS) ** -0.5, 2), count) for bend in _BENDS
    ]
    none = np.zeros(len(parameters), dtype=int)
    coordinates = Coordinates(spectra[0], none, none > 0, lambda values, _: values, spectra=tuple(spectra), broad=True)
    return Effect("drive_error_function", parameters, coordinates, _err, along_drives=_functions, of_drive_value=True)


def _functions(motion):
    """By drive the functions (n, 2 orders) of its angle that a unit of each of its coordinates adds."""
    return [waves(angle, ORDERS) for angle in motion.drive.T]


def _err(motion, values):
    """Changes of the drive angles under coefficients (K times 2 orders,) in rad."""
    own = np.reshape(values, (motion.drive.shape[1], -1))
    changes = [waves(angle, ORDERS) @ one for angle, one in zip(motion.drive.T, own, strict=True)]
    return motion.at_drives(np.stack(changes, axis=1))
