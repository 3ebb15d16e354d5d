"""Every method on one robot: true errors of the driven robot before and after, how many points it takes, how long.
Lengths in mm, times in s.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.seeds import run_seed
from rrru.studies.methods import learners
from rrru.studies.methods.benches import TESTS

# a method has enough points where all that more of them bring is this share of its mean error, or the tracker's noise
_ENOUGH = 0.1


def compare(bench, config, image_offsets=None):
    """Frames of one robot, without its name: rows of `methods`, `method_points` and `method_timings`.

    image_offsets: mapping with dtheta_rad (3,) found from images, poses and measuring_time_s, or None where the robot
    has no camera.
    """
    plans = {test: bench.plan(points) for test, points in bench.tests.items()}
    before = {test: _errors(bench, plan, test) for test, plan in plans.items()}
    curve, timings = [], []
    for count in config["methods"]["points"]:
        measured, time = _campaign(bench, count)
        seed = run_seed(bench.seed, "methods", bench.name, "genetic", count)
        for name, learn in learners.position_methods(measured, config, bench.generator, seed).items():
            start = perf_counter()
            learned = learn()
            timings.append({"method": name, "points": count, "seconds": perf_counter() - start})
            for test, plan in plans.items():
                curve.append(
                    _row(name, test, count, time, learned, before[test], _errors(bench, plan, test, learned.controller))
                )
    for test, plan in plans.items():
        learned, time, seconds = _step(bench, plan, test)
        timings.append({"method": "jacobian_step", "points": len(plan.targets()), "seconds": seconds})
        curve.append(
            _row(
                "jacobian_step",
                test,
                len(plan.targets()),
                time,
                learned,
                before[test],
                _errors(bench, plan, test, learned.controller),
            )
        )
    if image_offsets is not None:
        learned = learners.offsets(bench.robot.mechanism, image_offsets["dtheta_rad"])
        for test, plan in plans.items():
            after = _errors(bench, plan, test, learned.controller)
            time, poses = image_offsets["measuring_time_s"], image_offsets["poses"]
            curve.append(_row("zero_offsets_images", test, poses, time, learned, before[test], after))
    curve = pd.DataFrame(curve)
    return _methods(curve, bench.noise_mm), curve, pd.DataFrame(timings).drop_duplicates(["method", "points"])


def measuring_time_s(bench, points_mm):
    """Time in s that the robot takes to stop at points (n, 3) for a measurement."""
    return float(bench.plan(points_mm).time_s()[-1])


def _campaign(bench, count):
    """The first `count` points to learn from, as measured, and the time that takes."""
    plan = bench.plan(bench.train[:count])
    measurements, _ = bench.run(plan, "train")
    return learners.points_of(bench.robot.mechanism, measurements), float(plan.time_s()[-1])


def _step(bench, plan, test):
    """The Jacobian's step on the targets of a test, the time to measure them and the seconds to compute it."""
    measurements, _ = bench.run(plan, f"{test} first")
    found = learners.points_of(bench.robot.mechanism, measurements)
    # where a target was not measured nothing is known of its error
    known = rows.usable(measurements)
    start = perf_counter()
    index = plan.path()[1][known]
    learned = learners.jacobian_step(bench.robot.mechanism, index, found)
    learned.controller(plan.path()[0])
    return replace(learned, evaluations=len(index)), float(plan.time_s()[-1]), perf_counter() - start


def _errors(bench, plan, test, controller=None):
    """Distances (m,) between the targets of a plan and where the robot truly goes; NaN where it cannot."""
    _, truth = bench.run(plan, test, controller)
    return np.linalg.norm(truth[[f"true_{axis}_mm" for axis in "xyz"]].to_numpy() - plan.targets(), axis=1)


def _row(method, test, count, time, learned, before, after):
    """A row of `method_points`."""
    return {
        "method": method,
        "test": test,
        "points": count,
        "before_mean_mm": np.nanmean(before),
        "before_max_mm": np.nanmax(before),
        "after_mean_mm": np.nanmean(after),
        "after_max_mm": np.nanmax(after),
        "numbers": learned.numbers,
        "measuring_time_s": time,
        "evaluations": learned.evaluations,
    }


def _methods(curve, noise_mm):
    """Rows of `methods`: each method with all its points, and the fewest points from which on more bring next to
    nothing inside the region.
    """
    result = []
    for method, part in curve.groupby("method", sort=False):
        inside = part[part["test"] == "inside"].sort_values("points")
        last = inside["after_mean_mm"].iloc[-1]
        short = np.flatnonzero(inside["after_mean_mm"] > max((1.0 + _ENOUGH) * last, last + noise_mm))
        enough = inside.iloc[short[-1] + 1 if short.size else 0]
        for test in TESTS:
            row = part[
                (part["test"] == test) & (part["points"] == part.loc[part["test"] == test, "points"].max())
            ].iloc[0]
            result.append(
                row.to_dict()
                | {
                    "removed_share": 1.0 - row["after_mean_mm"] / row["before_mean_mm"],
                    "points_needed": int(enough["points"]),
                    "needed_time_s": float(enough["measuring_time_s"]),
                    "needs": learners.NEEDS[method],
                }
            )
    return pd.DataFrame(result)
