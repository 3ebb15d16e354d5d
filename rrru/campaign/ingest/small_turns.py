"""Places of reflectors on a platform that turns by the robot's errors alone, as that of a delta does.

The nominal platform never turns, and what the places of all reflectors have in common is confounded with the shift of
the instrument's frame. The robot's errors e, such as unequal rods, turn the platform by some mrad, R(e), and places
that are all off by d are read off by

    (R(e) - R(0)) d

a product of two unknowns. About the errors e_1 of a fit with d = 0 it is linear in either of them,

    r(e, d) = r_1 - (J + sum_k d_k dJ/dc_k) (e - e_1) - (R(e_1) - R(0)) d

with the derivative J of the readings, and c a reflector's place. For each d the errors follow by linear least squares,
and d from what these leave (variable projection: Golub and Pereyra, SIAM Journal on Numerical Analysis 10, 1973). The
prior of d has the platform's size as its standard deviation. Lengths in mm, angles in rad.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from rrru.arrays import FloatArray
from rrru.kinematics.base_parameters import MeasurementConfig
from rrru.kinematics.chain import Poses
from rrru.kinematics.readings import Readings, reading_residual
from rrru.kinematics.robot import Robot

# rounds of the fit without other places: errors of some mm need three
_ROUNDS = 4
# standard deviation, over that of the prior, where readings and prior have as much information
_AS_PRIOR = np.sqrt(0.5)


def common_shift(robot: Robot, driven: tuple[FloatArray, FloatArray], readings: Readings) -> FloatArray:
    """What to add to the places of all reflectors in mm (3,); zero where no axis has more information than the prior.

    driven: actuator values (n, K) and nominal positions (n, 3); readings: of reflectors, in the robot's frame.
    """
    names = tuple(dict.fromkeys(np.asarray(readings.reflectors).tolist()))
    robot = robot.with_measurement_config(MeasurementConfig(names, frame=True))
    robot = robot.with_identifiable_parameters(*driven, readings)
    prior_sd, size_mm = robot.parameters.high, robot.characteristic_length_mm
    freedom = 3 * len(readings) - len(prior_sd) - 3
    nothing = np.zeros(3)
    nominal, values = robot.solve(*driven), np.zeros(len(prior_sd))
    for step in range(_ROUNDS):
        twists = robot.twists(values)
        poses = robot.solve(*driven, twists)
        if not poses.closed.all() or freedom <= 0:
            return nothing
        left = reading_residual(robot, readings, poses, twists).ravel()
        columns = _columns(robot, driven[0], (poses, twists), readings, np.zeros(3)) * prior_sd
        if step < _ROUNDS - 1:
            values = values + prior_sd * np.linalg.lstsq(columns, left, rcond=None)[0]
    noise_mm = float(np.sqrt((left**2).sum() / freedom))
    by_place = [
        _columns(robot, driven[0], (poses, twists), readings, size_mm * axis) * prior_sd - columns for axis in np.eye(3)
    ]
    turned = size_mm * (poses.turn - nominal.turn).reshape(-1, 3)

    def slopes(share: FloatArray) -> FloatArray:
        """Derivative of the readings by the errors over their priors, where places are off by share * size_mm."""
        return np.asarray(columns + sum(one * by for one, by in zip(share, by_place, strict=True)))

    def errors(share: FloatArray) -> FloatArray:
        """The errors over their priors."""
        return np.asarray(np.linalg.lstsq(slopes(share), left - turned @ share, rcond=None)[0])

    def lacking(share: FloatArray) -> FloatArray:
        """Residuals with these errors, and those of the prior."""
        return np.append(left - turned @ share - slopes(share) @ errors(share), noise_mm * share)

    # a product of two unknowns has several minima
    starts = [nothing, *np.eye(3), *-np.eye(3)]
    found = min((least_squares(lacking, start) for start in starts), key=lambda one: one.cost)
    noise_mm = float(np.sqrt((found.fun[:-3] ** 2).sum() / freedom))
    every = np.column_stack([slopes(found.x), turned + np.stack([by @ errors(found.x) for by in by_place], axis=-1)])
    prior = np.diag(np.append(np.zeros(len(prior_sd)), np.full(3, noise_mm)))
    sd = noise_mm * np.sqrt(np.diag(np.linalg.inv(every.T @ every + prior**2)))[-3:]
    return size_mm * found.x if sd.min() < _AS_PRIOR else nothing


def _columns(
    robot: Robot, actuators: FloatArray, at: tuple[Poses, FloatArray], readings: Readings, shift_mm: FloatArray
) -> FloatArray:
    """Derivative (3 n, p) of what is read by the robot's parameters at (Poses, twists), places shifted by (3,)."""
    moved = replace(readings, place_mm=np.asarray(readings.place_mm) + shift_mm)
    result = robot.map(actuators, *at, moved).columns(robot.directions)
    return np.asarray(result).reshape(-1, result.shape[-1])
