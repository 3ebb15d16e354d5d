"""Common parts of periodic drive errors: amplitude and phase of each drive as parameters, sine and cosine fitted.

They act at the drives of one unit. In a robot with turning and sliding drives these are not all of them.
"""

from collections.abc import Mapping

import numpy as np

from rrru.arrays import FloatArray, IntArray
from rrru.effects.protocol import Contribution, Coordinates, Effect, Motion, leg_parameters
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

_PHASE = "phase"


def is_phase(parameter: str) -> bool:
    """Whether a parameter of an effect is the phase of a wave, by its name.

    >>> is_phase("phase2"), is_phase("amplitude2")
    (True, False)
    """
    return parameter.rstrip("0123456789") == _PHASE


def drives_of(robot: Robot, unit: str) -> IntArray:
    """Numbers (k,) from 0 on of a robot's drives of a unit, "rad" or "mm"."""
    return np.flatnonzero([drive_unit == unit for drive_unit in robot.parts.units])


def harmonic_parameters(
    drives: IntArray, source: str, unit: str = "rad", highest: float = 0.01
) -> tuple[Parameter, ...]:
    """Amplitudes in the unit and phases in rad of drives (k,), numbered from 0 on, as a tuple of 2 k parameters."""
    count = drives.max() + 1
    amplitudes = leg_parameters(source, ("amplitude", unit, 0.0, highest), count=count)
    phases = leg_parameters("free", (_PHASE, "rad", -np.pi, np.pi), count=count)
    return tuple(parameter for parameter in (*amplitudes, *phases) if parameter.leg - 1 in drives)


def at_harmonic(motion: Motion, drives: IntArray, periods: float, values: FloatArray) -> Contribution:
    """Contribution of errors a_i sin(N theta_i + p_i) of drives (k,); values: amplitudes, phases; N periods a turn."""
    count, change = len(drives), np.zeros_like(motion.drive)
    wave = np.sin(periods * motion.drive[:, drives] + values[count : 2 * count])
    change[:, drives] = values[:count] * wave
    return motion.at_drives(change)


def harmonic_coordinates(
    parameters: ParameterSet, typical: float, shapes: tuple[Mapping[str, float], ...] = ({},)
) -> Coordinates:
    """Coordinates sine1, cosine1, sine2, ... in the drive's unit: the error is s_i sin(N q_i) + c_i cos(N q_i).

    parameters: those of `harmonic_parameters` first, after them those of the shapes.
    """
    names = [name for name in parameters.names if name not in shapes[0]]
    drives = [parameters[name].leg for name in names[: len(names) // 2]]

    def to_values(coordinates: FloatArray, shape: Mapping[str, float]) -> FloatArray:
        sine, cosine = np.reshape(coordinates, (-1, 2)).T
        values = np.concatenate([np.hypot(sine, cosine), np.arctan2(cosine, sine)])
        return parameters.vector(dict(shape) | dict(zip(names, values, strict=True)))

    return Coordinates(
        typical=np.full(len(names), float(typical)),
        legs=np.repeat(drives, 2),
        positive=np.zeros(len(names), dtype=bool),
        to_values=to_values,
        shapes=tuple(shapes),
        most=np.full(len(names), parameters[names[0]].high),
    )


def of_encoders(robot: Robot, name: str, periods: float, source: str, typical_rad: float) -> Effect | None:
    """Effect of errors with `periods` waves per turn of every turning drive, None for robots without any."""
    turning = drives_of(robot, "rad")
    if not len(turning):
        return None
    parameters = ParameterSet(harmonic_parameters(turning, source))

    def harmonic_error(motion: Motion, values: FloatArray) -> Contribution:
        return at_harmonic(motion, turning, periods, values)

    coordinates = harmonic_coordinates(parameters, typical_rad)
    return Effect(name, parameters, coordinates, harmonic_error, of_drive_value=True)


def waves(angle: FloatArray, orders: FloatArray | IntArray) -> FloatArray:
    """Sine and cosine in turn, (n, 2 orders), of orders (k,) times an angle (n,)."""
    phase = np.outer(angle, orders)
    return np.stack([np.sin(phase), np.cos(phase)], axis=2).reshape(len(angle), -1)
