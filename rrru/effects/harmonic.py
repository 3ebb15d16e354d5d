"""What periodic drive errors share: amplitude and phase of each drive as parameters, sine and cosine as coordinates."""

import numpy as np

from rrru.effects.protocol import Coordinates, Effect, leg_parameters
from rrru.parameters import ParameterSet


def harmonic_parameters(count, source, unit="rad", highest=0.01):
    """Amplitudes (count) in the drive's unit and phases (count) in rad, as a tuple of parameters."""
    amplitudes = leg_parameters(source, ("amplitude", unit, 0.0, highest), count=count)
    return (*amplitudes, *leg_parameters("free", ("phase", "rad", -np.pi, np.pi), count=count))


def harmonic(drive, periods, values):
    """Errors a_i sin(N theta_i + p_i), (n, K), of angles (n, K); values: amplitudes, phases; N periods a turn."""
    count = drive.shape[1]
    return values[:count] * np.sin(periods * drive + values[count : 2 * count])


def harmonic_coordinates(parameters, typical, shapes=({},)):
    """Coordinates sine1, cosine1, sine2, ... in the drive's unit: the error is s_i sin(N q_i) + c_i cos(N q_i).

    parameters: those of `harmonic_parameters` first, after them those of the shapes.
    """
    names = [name for name in parameters.names if name not in shapes[0]]
    drives = len(names) // 2

    def to_values(coordinates, shape):
        sine, cosine = np.reshape(coordinates, (drives, 2)).T
        values = np.concatenate([np.hypot(sine, cosine), np.arctan2(cosine, sine)])
        return parameters.vector(dict(shape) | dict(zip(names, values, strict=True)))

    return Coordinates(
        typical=np.full(len(names), float(typical)),
        legs=np.repeat(np.arange(1, drives + 1), 2),
        positive=np.zeros(len(names), dtype=bool),
        to_values=to_values,
        shapes=tuple(shapes),
        most=np.full(len(names), parameters[names[0]].high),
    )


def of_encoders(robot, name, periods, source, typical_rad):
    """The Effect of errors with so many periods a turn of every drive, None for robots whose drives do not all turn."""
    if "mm" in robot.parts.units:
        return None
    parameters = ParameterSet(harmonic_parameters(len(robot.parts.drives), source))

    def law(motion, values):
        return motion.at_drives(harmonic(motion.drive, periods, values))

    return Effect(name, parameters, harmonic_coordinates(parameters, typical_rad), law)


def waves(angle, orders):
    """Sine and cosine in turn, (n, 2 orders), of orders (k,) times an angle (n,)."""
    return np.stack([np.sin(np.outer(angle, orders)), np.cos(np.outer(angle, orders))], axis=2).reshape(len(angle), -1)
