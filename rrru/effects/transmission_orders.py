"""Transmission orders: every drive leads and lags in several sharp waves per turn, of its own orders.

A drive of several stages, or drives of unlike gears, err at several orders N_k, each on one drive i_k:

    dtheta_i = sum over k with i_k = i of s_k sin(N_k theta_i) + c_k cos(N_k theta_i)

`transmission_error` is the special case of one ratio that all drives share. Orders and drives are searched one after
another in the residuals of the calibration, see `rrru.diagnosis.drive_spectra`. The prior of each order accounts for
the choice among many.

Assumptions: the error depends on the angle only, not on load or direction of motion.

Source: Litvin and Fuentes, Gear Geometry and Applied Theory, 2004; the search is matching pursuit (Mallat and Zhang,
IEEE Transactions on Signal Processing 41, 1993). The size is assumed: one arc minute is 3e-4 rad.
"""

from collections.abc import Sequence

import numpy as np

from rrru.arrays import FloatArray
from rrru.effects.harmonic import waves
from rrru.effects.protocol import Contribution, Coordinates, Effect, Motion
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_TYPICAL, _MOST = 3e-4, 0.01


def for_robot(robot: Robot) -> Effect | None:
    """The effect model, whose waves are still to be found, for robots whose drives all turn, None for others."""
    return _with_waves(()) if set(robot.parts.units) == {"rad"} else None


def _with_waves(pairs: Sequence[tuple[int, float]], log_prior: float = 0.0) -> Effect:
    """The effect model with waves (drive, order), drives counted from 0 on; log_prior: of having chosen just these."""
    parameters = ParameterSet(
        tuple(
            Parameter(f"{part}_{drive + 1}_{order:.4g}", "rad", 0.0, -_MOST, _MOST, "some arc minutes", drive + 1)
            for drive, order in pairs
            for part in ("sine", "cosine")
        )
    )
    none = np.zeros(2 * len(pairs), dtype=int)
    coordinates = Coordinates(
        np.full(len(none), _TYPICAL),
        none,
        none > 0,
        lambda values, _: values,
        log_prior=log_prior,
        broad=True,
    )
    drives = np.array([drive for drive, _ in pairs], dtype=int)
    orders = np.array([order for _, order in pairs], dtype=float)

    def err(motion: Motion, values: FloatArray) -> Contribution:
        """Changes of the drive angles under sines and cosines (2 waves,) in rad."""
        changes = np.zeros_like(motion.drive)
        for drive in np.unique(drives):
            its = drives == drive
            changes[:, drive] = waves(motion.drive[:, drive], orders[its]) @ np.reshape(values, (-1, 2))[its].ravel()
        return motion.at_drives(changes)

    return Effect(
        "transmission_orders",
        parameters,
        coordinates,
        err,
        of_drive_value=True,
        with_waves=_with_waves,
        waves=tuple(pairs),
    )
