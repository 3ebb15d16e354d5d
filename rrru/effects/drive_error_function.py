"""Drive error function: every drive, or one alone, errs by a rough function of its own value.

An encoder's scale, its mounting, teeth, pitch and bearings together make an error that repeats at every value of the
drive but follows no single wave:

    dq_i = c_i0 + sum over n of s_in sin(n u_i) + c_in cos(n u_i),   n = 1, 2, .. 128

u_i is the angle of a drive that turns, and pi q_i / L_i of one that slides: L_i is its stroke, of which the waves make
any function, 1 m where none is stated. It enters at the drive's value. The coefficients of order n are independent and
normal. This is a Gaussian process on the circle. Their standard deviation is in proportion to one of

    1 / sqrt(1 + (n / b)^2)    with steps, as where two pieces of a scale are joined; of one drive alone
    1 / sqrt(1 + (n / b)^4)    with corners
    exp(-(n / b)^2 / 2)        smooth

with waves up to about b per turn, with steps to order 128, else to 64. The function is zero at the value at which the
drive was zeroed, which is not known: the constant c_i0 has the standard deviation of the sum of the waves at one value.
It cannot be separated from the drive's zero offset, whose interval is wider by it. The likelihood chooses the kind and
b among some values, for all drives or for one alone. The result is the spectrum of the error. A gear's sharp orders are
`transmission_error` and `transmission_orders`: where few waves suffice, these have fewer coefficients and a higher
evidence. Only what the measured range of a drive resolves is fitted.

Assumptions: it depends on the drive's value only, not on load or sense of motion; all drives of a kind that err have
errors of one size.

Source: MacKay, Introduction to Gaussian processes, 1998 (periodic kernels). The sizes are assumed: 20 arc seconds are
1e-4 rad, and a slide of ordinary precision is within 0.02 mm.
"""

from collections.abc import Callable

import numpy as np

from rrru.arrays import FloatArray
from rrru.cache import Latest, read_only
from rrru.effects.harmonic import waves
from rrru.effects.protocol import Contribution, Coordinates, Effect, Motion
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

ORDERS = np.arange(1, 129)
# by the kind of a function its falling off with order / bend, its bends in waves per turn, its highest order, and
# whether it is a fault of one drive
_SPECTRA: tuple[tuple[Callable[[FloatArray], FloatArray], tuple[float, ...], int, bool], ...] = (
    # with steps, which high orders make: ASSUME no robot has several scales that are joined with an offset. The waves
    # of a step fall off from the first one on, as with a bend of one wave per turn: higher bends leave so little of its
    # longest waves that an effect that resembles these, as a lead error does, seems to act as well
    (lambda at: (1.0 + at**2) ** -0.5, (1.0, 3.0, 12.0, 48.0), 128, True),
    # with corners
    (lambda at: (1.0 + at**4) ** -0.5, (3.0, 6.0, 12.0, 24.0, 48.0), 64, False),
    # smooth, of a short part of a turn: fewer waves are what eccentricity, gears and others make
    (lambda at: np.exp(-0.5 * at**2), (12.0, 24.0), 64, False),
)
_TYPICAL, _MOST = {"rad": 1e-4, "mm": 0.02}, {"rad": 0.01, "mm": 2.0}
_STROKE_MM = 1000.0


def for_robot(robot: Robot) -> Effect:
    """The effect model for all drives."""
    units = robot.parts.units
    waves_of = [f"{part}{{}}_{order}" for order in ORDERS for part in ("sine", "cosine")]
    parameters = ParameterSet(
        tuple(
            Parameter(name.format(drive), unit, 0.0, -_MOST[unit], _MOST[unit], "assumed", drive)
            for drive, unit in enumerate(units, 1)
            for name in ("constant{}", *waves_of)
        )
    )
    typical = np.repeat([_TYPICAL[unit] for unit in units], 1 + len(waves_of))
    spectra = tuple(
        typical * np.tile(_with_constant(falling(ORDERS / bend) * (highest >= ORDERS)), len(units))
        for falling, bends, highest, _ in _SPECTRA
        for bend in bends
    )
    per_unit = _per_unit(robot)
    none = np.zeros(len(parameters), dtype=int)
    coordinates = Coordinates(
        spectra[0],
        parameters.legs,
        none > 0,
        lambda values, _: values,
        spectra=spectra,
        of_one=tuple(alone for _, bends, _, alone in _SPECTRA for _ in bends),
        broad=True,
    )

    # a fit evaluates the same motion again and again
    latest = Latest(1)

    def functions(motion: Motion) -> list[FloatArray]:
        """By drive the functions (n, 1 + 2 orders) of its value that a unit of each of its coordinates adds."""
        found: list[FloatArray] = latest.of(motion.drive.tobytes(), lambda: read_only(made(motion.drive)))
        return found

    def made(drive: FloatArray) -> list[FloatArray]:
        constant = np.ones((len(drive), 1))
        return [np.concatenate([constant, waves(angle, ORDERS)], axis=1) for angle in (drive * per_unit).T]

    def err(motion: Motion, values: FloatArray) -> Contribution:
        """Changes of the actuator values under coefficients (K times (1 + 2 orders),) in their units."""
        by_drive = np.reshape(values, (len(units), -1))
        return motion.at_drive_functions(functions(motion), by_drive)

    return Effect("drive_error_function", parameters, coordinates, err, along_drives=functions, of_drive_value=True)


def _with_constant(sizes: FloatArray) -> FloatArray:
    """Standard deviations (1 + 2 orders,) of the constant, and of sine and cosine of each order, from those (orders,)
    of the orders.
    """
    return np.concatenate([[np.sqrt((sizes**2).sum())], np.repeat(sizes, 2)])


def _per_unit(robot: Robot) -> FloatArray:
    """Angle (K,) of the lowest wave per drive value: 1 for drives that turn, in rad per mm for those that slide."""
    strokes = np.where(np.isfinite(robot.strokes), robot.strokes, _STROKE_MM)
    return np.where(np.array(robot.parts.units) == "rad", 1.0, np.pi / strokes)
