"""Pose solves of the calibration's objective: a loop over fsolve, NumPy, the compiled kernel, and this core's
arithmetic limit.

Task: mean distance of a population of 30 over paper A's seven lines, 182 points, 8 parameters; seconds per pose.

The limit is the arithmetic of a pose at this core's rate of each kind, counted in `rrru.robots.rrru3_objective`:
operations a point and individual, for two Newton steps. What is the same for all points of an individual, its legs'
numbers except cosines and sines, is left out.
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from os import cpu_count, getloadavg
from time import perf_counter, process_time

import numba
import numpy as np
from scipy.optimize import fsolve

from benchmarks import harness
from benchmarks.harness import Call, Task
from rrru.campaign.trajectories import line_groups, sample
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.kinematics.compiled import fma
from rrru.robots.rrru3 import Rrru3

POPULATION, SIDES_MM = 30, (0.0, 37.5, -37.5, 75.0, -75.0, 112.5, -112.5)
TABLE_5 = {"dtheta1": 0.0012, "dtheta2": -0.0003, "dtheta3": 0.0003}
TABLE_5 |= {"dL1": 0.3092, "dL2": 0.2405, "dL3": -0.1761, "dR": -1.209, "dr": 0.8865}
# largest difference of solutions; convergence limit of Batch
_SAME_MM, _LAST_STEP_MM2 = 1e-8, 1e-8
_LOOPS, _WORKERS = 4000, 2
LIMIT = "limit: its arithmetic at this core's rates"
# a leg's closure: 12 multiply-adds, 9 products and sums, a root; the three equations: 19 and 20, a division; before
# them 24 multiply-adds make the start, after them 2, 5 and a root the distance
_STEPS, _LEGS = 2, 3
_SIMPLE = (24 + _STEPS * (_LEGS * 12 + 19) + 2) + (_STEPS * (_LEGS * 9 + 20) + 5)
_ROOTS, _DIVISIONS = _STEPS * _LEGS + 1, _STEPS
_NUMBERS, _DEEP = 512, 8


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
    peers[LIMIT] = limit_call(len(residuals))
    return [*task.in_turns(ours, peers, notes={LIMIT: _rates_in_words()}), *two_cores()]


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


# --- the limit

_compiled = numba.njit(error_model="numpy")


@_compiled
def _multiply_adds(count, x, y):
    """Multiply-adds, few enough on one number in a row that none waits for the one before."""
    for _ in range(count // (x.size * _DEEP)):
        for j in range(x.size):
            number = x[j]
            for _ in range(_DEEP):
                number = fma(number, 0.5, 0.5)
            y[j] = number
        x[0] += 1.0


@_compiled
def _roots(count, x, y):
    """Square roots."""
    for k in range(count // x.size):
        x[k % x.size] += 1.0
        for j in range(x.size):
            y[j] = np.sqrt(x[j])


@_compiled
def _divisions(count, x, y):
    """Divisions."""
    for k in range(count // x.size):
        x[k % x.size] += 1.0
        for j in range(x.size):
            y[j] = 1.0 / x[j]


@_compiled
def _turns(count, x, y):
    """Cosines and as many sines."""
    for k in range(count // x.size):
        x[k % x.size] += 1.0
        for j in range(x.size):
            y[j] = np.cos(x[j]) + np.sin(x[j])


def limit_call(points, poses=200_000):
    """A Call of only the arithmetic of poses, where `points` share an individual."""
    x, y = np.linspace(0.5, 1.5, _NUMBERS), np.empty(_NUMBERS)

    def work():
        _multiply_adds(poses * _SIMPLE, x, y)
        _roots(poses * _ROOTS, x, y)
        _divisions(poses * _DIVISIONS, x, y)
        _turns(poses * _LEGS // points, x, y)

    return Call(work, poses)


def _rates_in_words():
    """The counts and this core's rates."""
    x, y = np.linspace(0.5, 1.5, _NUMBERS), np.empty(_NUMBERS)
    counts = {_multiply_adds: 50_000_000, _roots: 2_000_000, _divisions: 2_000_000, _turns: 200_000}
    rates = []
    for function, count in counts.items():
        function(count, x, y)
        spent = []
        for _ in range(9):
            start = process_time()
            function(count, x, y)
            spent.append(process_time() - start)
        rates.append(1e-9 * count / np.median(spent))
    simple, root, division, turn = rates
    return (
        f"a pose: {_SIMPLE} multiply-adds, products and sums at {simple:.3g}e9/s, {_ROOTS} roots at {root:.3g}e9/s, "
        f"{_DIVISIONS} divisions at {division:.3g}e9/s; an individual: 3 cosines and 3 sines at {2.0 * turn:.2g}e9/s"
    )


if __name__ == "__main__":
    harness.store("objective", rows())
