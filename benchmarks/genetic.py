"""Times the readings of the paper's genetic algorithm on the same task, side by side.

Task: paper A's seven lines (182 points) and its first (26), 8 errors, population 30, measured with Table 5's errors and
0.3 mm of noise. Run: python benchmarks/genetic.py
"""

import time

import numpy as np

from rrru.fit.residuals import Residuals
from rrru.genetic.algorithm import minimise
from rrru.genetic.settings import GeneticSettings
from rrru.robots.rrru3 import Rrru3

TABLE_5_RAD = {"dtheta1": 0.0012, "dtheta2": -0.0003, "dtheta3": 0.0003}
TABLE_5_MM = {"dL1": 0.3092, "dL2": 0.2405, "dL3": -0.1761, "dR": -1.209, "dr": 0.8865}
GENERATIONS, POPULATION, SEEDS = 1400, 30, range(5)


def task(sides_mm):
    """Objective and bounds of the lines at the given y."""
    robot = Rrru3(parameter_set="tied")
    line = np.linspace(-800.0, -300.0, 26)
    commanded = np.concatenate([np.column_stack([line, np.full(26, y), np.full(26, 600.0)]) for y in sides_mm])
    theta = robot.inverse(commanded)
    real = robot.forward(theta, robot.parameters.vector(TABLE_5_RAD | TABLE_5_MM), commanded)
    measured = real + np.random.default_rng(0).normal(0.0, 0.3, real.shape)
    return Residuals(robot, theta, measured, commanded).mean_distance, robot.parameters.low, robot.parameters.high


def ours(objective, low, high, seed, **settings):
    """Best objective and generations of one run."""
    result = minimise(objective, low, high, GeneticSettings(generations=GENERATIONS, **settings), seed)
    return result.objective, result.generations


def timed(*arguments, **settings):
    """Seconds a run, seconds a generation and median best objective over the seeds; the first, untimed run compiles."""
    ours(*arguments, 0, **settings)
    start = time.perf_counter()
    found = [ours(*arguments, seed, **settings) for seed in SEEDS]
    seconds = time.perf_counter() - start
    return (
        seconds / len(SEEDS),
        seconds / sum(generations for _, generations in found),
        float(np.median([best for best, _ in found])),
    )


def main():
    """Print the table."""
    tasks = {
        "no task (operators and bookkeeping)": (lambda errors: np.abs(errors).sum(axis=1), *task((0.0,))[1:]),
        "one line, 26 points": task((0.0,)),
        "seven lines, 182 points": task((0.0, 37.5, -37.5, 75.0, -75.0, 112.5, -112.5)),
    }
    runs = {
        "MATLAB's step, all generations": {"stall_generations": 0},
        "MATLAB's step, three islands": {"stall_generations": 0, "populations": (10, 10, 10)},
        "MATLAB's step, 50 stalled": {},
        "adaptive feasible mutation, all generations": {"stall_generations": 0, "operators": "matlab_adaptive"},
        "adaptive feasible mutation, 50 stalled": {"operators": "matlab_adaptive"},
        "PyGAD's own operators, all generations": {"stall_generations": 0, "operators": "pygad"},
        "PyGAD's own operators, saturate_50": {"operators": "pygad"},
    }
    for title, arguments in tasks.items():
        print(title)
        reference = None
        for name, settings in runs.items():
            a_run, a_generation, best = timed(*arguments, **settings)
            reference = reference or a_generation
            print(
                f"  {name:45s} {1e3 * a_generation:7.3f} ms a generation ({a_generation / reference:5.1f} x)"
                f"  {a_run:7.3f} s a run  best {best:.4f}"
            )


if __name__ == "__main__":
    main()
