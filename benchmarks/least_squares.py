"""Calibrations by least squares: SciPy with finite differences, and here with the analytic Jacobian.

Tasks: the 3-RRRU on paper A's seven lines (182 points, 7 parameters), a UR10 and a hexapod (100 points, all numbers
that are identifiable from the points). Both use the same forward kinematics, so that the difference is the derivatives;
the first robot also has what a user would have without this package, fsolve or NumPy. Seconds of one fit.
"""

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from benchmarks import harness
from benchmarks.harness import Call, Task
from benchmarks.kinematics import legs, ur10
from benchmarks.objective import Batch, by_fsolve, campaign
from rrru.calibration.calibrate import estimate_deviations
from rrru.estimation.observations.target_positions import TargetPositions

_POINTS, _NOISE_MM, _SAME = 100, 0.02, 1e-5
_DIFFERENCES = "SciPy, finite differences, our forward kinematics"


def fitted(function, count):
    """Deviations (p,) by SciPy from zero; function: position residuals (n, 3) of deviations (p,)."""
    return least_squares(lambda deviations: function(deviations).ravel(), np.zeros(count), method="lm").x


def measured(robot, actuators, start_mm, turn_rad=2e-4, length_mm=0.2):
    """Residuals of a robot with small errors of all its parameters, and noise."""
    robot, draw = robot.with_identifiable_parameters(actuators, start_mm), np.random.default_rng(5)
    sizes = [length_mm if unit == "mm" else turn_rad for unit in robot.parameters.units]
    real = robot.forward(actuators, sizes * draw.standard_normal(len(sizes)), start_mm)
    return TargetPositions(robot, actuators, real + draw.normal(0.0, _NOISE_MM, real.shape), start_mm)


def an_arm():
    """Residuals of the UR10."""
    robot, (low, high) = ur10(), np.radians([-120.0, 120.0])
    q = np.random.default_rng(3).uniform(low, high, (_POINTS, 6))
    return measured(robot, q, robot.forward(q))


def a_hexapod():
    """Residuals of the hexapod."""
    robot, draw = legs(parameter_set="full"), np.random.default_rng(4)
    place = robot.legs.home_mm + draw.uniform(-40.0, 40.0, (_POINTS, 3))
    turn = Rotation.from_rotvec(draw.uniform(-0.1, 0.1, (_POINTS, 3))).as_matrix()
    return measured(robot, robot.inverse(place, turn=turn), place)


def compared(what, residuals, others=None):
    """Rows of one robot; others: functions of deviations (p,) to residuals (n, 3) by name."""
    count, own = len(residuals.mechanism.parameters), estimate_deviations(residuals).values
    least = (residuals.residual(own) ** 2).sum()
    functions = {_DIFFERENCES: residuals.residual} | (others or {})
    for name, function in functions.items():
        found = fitted(function, count)
        assert abs((residuals.residual(found) ** 2).sum() / least - 1.0) < _SAME, name
    calls = {name: Call(lambda f=function: fitted(f, count)) for name, function in functions.items()}
    task = Task("least_squares", f"{what}, {count} parameters, fit", len(residuals))
    return task.in_turns(Call(lambda: estimate_deviations(residuals)), calls)


def rows():
    """Rows of the group."""
    residuals = campaign(parameter_set="identifiable")
    batch = Batch(residuals)
    others = {
        "SciPy, finite differences, fsolve inside": lambda e: residuals.measured_mm - by_fsolve(residuals, e),
        "SciPy, finite differences, NumPy": lambda e: residuals.measured_mm - batch.positions(e[None])[0],
    }
    return [
        *compared("3-RRRU", residuals, others),
        *compared("6-axis arm", an_arm()),
        *compared("hexapod", a_hexapod()),
    ]


if __name__ == "__main__":
    harness.store("least_squares", rows())
