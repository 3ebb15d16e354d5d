"""Pose solves of the calibration's objective: a loop over fsolve, NumPy, the compiled kernel, and this core's
arithmetic limit.

Task: mean distance of a population of 30 over paper A's seven lines, 182 points, 8 parameters; seconds per pose.
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from os import cpu_count, getloadavg
from time import perf_counter, process_time

import numpy as np
from scipy.optimize import fsolve

from benchmarks import harness, rates
from benchmarks.harness import Call, Task
from rrru.campaign.trajectories import line_groups, sample
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.robots.rrru3 import Rrru3

POPULATION, SIDES_MM = 30, (0.0, 37.5, -37.5, 75.0, -75.0, 112.5, -112.5)
TABLE_5 = {"dtheta1": 0.0012, "dtheta2": -0.0003, "dtheta3": 0.0003}
TABLE_5 |= {"dL1": 0.3092, "dL2": 0.2405, "dL3": -0.1761, "dR": -1.209, "dr": 0.8865}
# largest difference of solutions; convergence limit of Batch
_SAME_MM, _LAST_STEP_MM2 = 1e-8, 1e-8
_LOOPS, _WORKERS = 4000, 2


def campaign(sides_mm=SIDES_MM, parameter_set="tied", noise_mm=0.3):
    """TargetPositions of lines at the given y, measured with Table 5's errors and noise."""
    robot = Rrru3(parameter_set=parameter_set)
    lines = line_groups((-800.0, 0.0, 600.0), (-300.0, 0.0, 600.0), sides_mm, 26)
    points = np.concatenate([sample(line) for line in lines])
    theta, real = robot.require_reachable(points), Rrru3(parameter_set="tied")
    measured = real.forward(theta, real.parameters.vector(TABLE_5), points)
    noise = np.random.default_rng(0).normal(0.0, noise_mm, measured.shape)
    return TargetPositions(robot, theta, measured + noise, points)


def population(count=POPULATION):
    """Deviations (count, 8) of a usual size."""
    return np.random.default_rng(0).uniform(-1.0, 1.0, (count, 8)) * np.r_[[0.005] * 3, [1.0] * 5]


def by_fsolve(residuals, deviations):
    """Positions (n, 3) under deviations (p,) by scipy's fsolve on eq. (8), point by point."""
    legs, (cx, cy) = residuals.mechanism.numbers(deviations), residuals.mechanism.azimuth_cos_sin

    def closure(p, theta):
        u, v = p[0] * cx + p[1] * cy, p[1] * cx - p[0] * cy
        angle = theta + legs[:, 0]
        x = u + legs[:, 4] - legs[:, 1] * np.cos(angle)
        z = p[2] - legs[:, 1] * np.sin(angle)
        return x * x + z * z - (legs[:, 2] + np.sqrt(legs[:, 3] ** 2 - v * v)) ** 2

    pairs = zip(residuals.actuators, residuals.start_mm, strict=True)
    return np.array([fsolve(closure, start, args=(theta,)) for theta, start in pairs])


def mean_by_fsolve(residuals, deviations):
    """The objective of one individual (p,) with `by_fsolve` inside."""
    return float(np.linalg.norm(by_fsolve(residuals, deviations) - residuals.measured_mm, axis=1).mean())


class Batch:
    """The objective in NumPy, whole population at once: the kernel's algorithm, one array operation per term."""

    def __init__(self, residuals):
        self.residuals, robot = residuals, residuals.mechanism
        self.robot, self.start = robot, residuals.nominal_mm
        self.slope = robot.parameter_jacobian(self.start, residuals.actuators).reshape(-1, len(robot.parameters)).T

    def __call__(self, deviations):
        """Mean distances (m,)."""
        return np.linalg.norm(self.positions(deviations) - self.residuals.measured_mm, axis=-1).mean(axis=1)

    def positions(self, deviations):
        """Positions (m, n, 3) in mm."""
        position = self.start + (deviations @ self.slope).reshape(len(deviations), -1, 3)
        legs, (cx, cy) = self.robot.numbers(deviations)[:, None], self.robot.azimuth_cos_sin
        angle = self.residuals.actuators + legs[..., 0]
        foot, height = legs[..., 4] - legs[..., 1] * np.cos(angle), legs[..., 1] * np.sin(angle)
        longest = np.inf
        while longest > _LAST_STEP_MM2:
            x, y, z = (position[..., axis, None] for axis in range(3))
            v, big_x, big_z = cx * y - cy * x, cx * x + cy * y + foot, z - height
            s = np.sqrt(legs[..., 3] ** 2 - v * v)
            rho = legs[..., 2] + s
            side, closure = rho * v / s, 0.5 * (big_x**2 + big_z**2 - rho**2)
            step = _solved(big_x * cx - side * cy, big_x * cy + side * cx, big_z, -closure)
            position = position + step
            longest = (step**2).sum(axis=-1).max()
        return position


def _solved(x, y, z, right):
    """Solutions (.., 3) of three equations x a + y b + z c = right each, all (.., 3 equations), by Cramer's rule."""

    def across(a, b):
        return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]

    yz = across(y, z)
    parts = [(right * yz).sum(axis=-1), (right * across(z, x)).sum(axis=-1), (right * across(x, y)).sum(axis=-1)]
    return np.stack(parts, axis=-1) / (x * yz).sum(axis=-1)[..., None]


def rows():
    """Rows of the group."""
    residuals, deviations = campaign(), population()
    kernel, batch = residuals.mean_distance, Batch(residuals)
    assert np.abs(by_fsolve(residuals, deviations[0]) - residuals.model(deviations[0])).max() < 1e-6
    assert abs(mean_by_fsolve(residuals, deviations[0]) - kernel(deviations)[0]) < 1e-6
    assert np.abs(batch(deviations) - kernel(deviations)).max() < _SAME_MM
    poses = len(deviations) * len(residuals)
    task = Task("objective", "a pose of the objective, 30 individuals x 182 points", poses)
    peers = {
        "SciPy fsolve, a loop over points": Call(lambda: by_fsolve(residuals, deviations[0]), len(residuals)),
        "NumPy, whole population at once": Call(lambda: batch(deviations), poses),
    }
    ours = Call(lambda: kernel(deviations), poses)
    peers[rates.LIMIT] = rates.limit_call(len(residuals))
    return [*task.in_turns(ours, peers, notes={rates.LIMIT: rates.in_words()}), *two_cores()]


def _work(_=0):
    """Evaluate the objective for a while; returns start, end, and seconds of this process."""
    kernel, deviations = campaign().mean_distance, population()
    kernel(deviations)
    start, spent = perf_counter(), process_time()
    for _ in range(_LOOPS):
        kernel(deviations)
    return start, perf_counter(), process_time() - spent


def two_cores():
    """Rows of the same work in two simultaneous processes: speed-up over sequential ones."""
    ratios, seconds = {"wall": [], "process": []}, []
    with ProcessPoolExecutor(_WORKERS, mp_context=get_context("spawn")) as pool:
        list(pool.map(_work, range(_WORKERS)))
        for _ in range(9):
            single = np.array([pool.submit(_work).result() for _ in range(_WORKERS)])
            both = np.array(list(pool.map(_work, range(_WORKERS))))
            wall = both[:, 1].max() - both[:, 0].min()
            ratios["wall"].append((single[:, 1] - single[:, 0]).sum() / wall)
            ratios["process"].append(single[:, 2].sum() / both[:, 2].max())
            seconds.append(wall / (_WORKERS * _LOOPS * POPULATION * 182))
    task = Task("objective", "a pose of the objective, two processes at once", POPULATION * 182)
    notes = {"wall": f"load {getloadavg()[0]:.0f} on {cpu_count()} cores", "process": "goal: 1.9"}
    names = {"wall": "one after the other, by the clock", "process": "one after the other, by seconds on a core"}
    spent = float(np.median(seconds))
    first = [task.row(harness.OURS, spent, [1.0])]
    return first + [
        task.row(names[clock], spent * np.median(values), values, note=notes[clock]) for clock, values in ratios.items()
    ]


if __name__ == "__main__":
    harness.store("objective", rows())
