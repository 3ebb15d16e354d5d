"""Pose solves per second of the calibration's objective, beside a loop over scipy.optimize.fsolve, in one run on one
core.

`.venv/bin/python benchmarks/objective.py`
"""

from time import perf_counter

import numpy as np
from scipy.optimize import fsolve

from rrru.campaign.trajectories import line_groups, sample
from rrru.fit.residuals import Residuals
from rrru.robots.rrru3 import Rrru3

_POPULATION = 30


def _campaign():
    """182 points of seven lines under errors like Table 5's, tied model."""
    robot = Rrru3(parameter_set="tied")
    lines = line_groups((-800.0, 0.0, 600.0), (-300.0, 0.0, 600.0), (0.0, 37.5, -37.5, 75.0, -75.0, 112.5, -112.5), 26)
    points = np.concatenate([sample(line) for line in lines])
    theta = robot.require_reachable(points)
    truth = robot.parameters.vector({"dtheta1": 0.0012, "dL1": 0.3, "dL2": 0.24, "dr": 2.1})
    return Residuals(robot, theta, robot.forward(theta, truth, points), points)


def _fsolve_rate(residuals, deviations, count):
    """Pose solves per second of fsolve on eq. (8), written out in plain numpy as a user would, and the positions
    (count, 3).
    """
    legs, (cx, cy) = residuals.mechanism.legs(deviations), residuals.mechanism.azimuth_cos_sin

    def closure(p, theta):
        u, v = p[0] * cx + p[1] * cy, p[1] * cx - p[0] * cy
        angle = theta + legs[:, 0]
        x = u + legs[:, 4] - legs[:, 1] * np.cos(angle)
        z = p[2] - legs[:, 1] * np.sin(angle)
        return x * x + z * z - (legs[:, 2] + np.sqrt(legs[:, 3] ** 2 - v * v)) ** 2

    start = perf_counter()
    positions = [
        fsolve(closure, g, args=(t,))
        for t, g in zip(residuals.actuators[:count], residuals.start_mm[:count], strict=True)
    ]
    return count / (perf_counter() - start), np.array(positions)


def main():
    """Print both rates and their ratio, several rounds side by side."""
    residuals = _campaign()
    generator = np.random.default_rng(0)
    deviations = generator.uniform(-1.0, 1.0, (_POPULATION, 8)) * np.r_[[0.005] * 3, [1.0] * 5]
    residuals.mean_distance(deviations)
    for _ in range(5):
        repeats = 200
        start = perf_counter()
        for _ in range(repeats):
            residuals.mean_distance(deviations)
        ours = repeats * _POPULATION * len(residuals) / (perf_counter() - start)
        theirs, positions = _fsolve_rate(residuals, deviations[0], len(residuals))
        apart = np.abs(positions - residuals.model(deviations[0])).max()
        print(
            f"objective {ours:.3g} pose solves/s, fsolve {theirs:.3g}, ratio {ours / theirs:.0f}, "
            f"positions apart {apart:.1e} mm"
        )


if __name__ == "__main__":
    main()
