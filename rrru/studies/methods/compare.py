"""Every method on one robot: true errors of the driven robot before and after, points and times. mm, s."""

from dataclasses import replace
from time import perf_counter

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.seeds import run_seed
from rrru.studies.methods import learners
from rrru.studies.methods.regions import TESTS

# a method has enough points where more of them improve its mean error by less than this share, or than the noise
_MIN_IMPROVEMENT = 0.1


class Judge:
    """Drives a trial's targets with learned controllers and collects rows of `method_points` and `method_timings`."""

    def __init__(self, trial):
        self.trial = trial
        self.plans = {test: trial.plan(points) for test, points in trial.tests_mm.items()}
        self.before = {test: self.errors(test) for test in self.plans}
        self.rows, self.timings = [], []

    def errors(self, test, controller=None):
        """Distances (m,) between the targets of a test and the true positions; NaN where the robot has none."""
        _, truth = self.trial.run(self.plans[test], test, controller)
        return np.linalg.norm(rows.vectors(truth, "true") - self.plans[test].targets(), axis=1)

    def learn(self, method, count, learn):
        """The learned model of a method from a number of points; its time is recorded."""
        start = perf_counter()
        learned = learn()
        self.timings.append({"method": method, "points": count, "seconds": perf_counter() - start})
        return learned

    def judge(self, method, count, time_s, learned, tests=TESTS):
        """Add the rows of a learned model; count, time_s: of its training points."""
        for test in tests:
            before, after = self.before[test], self.errors(test, learned.controller)
            self.rows.append(
                {
                    "method": method,
                    "test": test,
                    "points": count,
                    "before_mean_mm": np.nanmean(before),
                    "before_max_mm": np.nanmax(before),
                    "after_mean_mm": np.nanmean(after),
                    "after_max_mm": np.nanmax(after),
                    "numbers": learned.numbers,
                    "measuring_time_s": time_s,
                    "evaluations": learned.evaluations,
                }
            )


def compare(trial, counts, candidates, genetic_settings, image_offsets=None):
    """Frames of one robot, without its name: rows of `methods`, `method_points` and `method_timings`.

    counts: numbers of points to learn from; image_offsets: mapping with dtheta_rad (3,) found from images, poses and
    measuring_time_s, or None where the robot has no camera.
    """
    judge, mechanism = Judge(trial), trial.robot.mechanism
    for count in counts:
        plan = trial.plan(trial.train_mm[:count])
        points = learners.measured_points(mechanism, trial.run(plan, "train")[0])
        seed = run_seed(trial.seed, "methods", trial.name, "genetic", count)
        methods = learners.position_methods(points, candidates, genetic_settings, trial.generator, seed)
        for name, learn in methods.items():
            judge.judge(name, count, _duration_s(plan), judge.learn(name, count, learn))
    for test, plan in judge.plans.items():
        count, time_s = len(plan.targets()), _duration_s(plan)
        judge.judge("jacobian_step", count, time_s, _step(judge, test), [test])
    if image_offsets is not None:
        learned = learners.offsets(mechanism, image_offsets["dtheta_rad"])
        judge.judge("zero_offsets_images", image_offsets["poses"], image_offsets["measuring_time_s"], learned)
    curve, timings = pd.DataFrame(judge.rows), pd.DataFrame(judge.timings).drop_duplicates(["method", "points"])
    return summary(curve, trial.noise_mm), curve, timings


def measuring_time_s(trial, points_mm):
    """Time in s that the robot takes to stop at points (n, 3) for a measurement."""
    return _duration_s(trial.plan(points_mm))


def _duration_s(plan):
    """Time of the last measurement of a plan."""
    return float(plan.time_s()[-1])


def _step(judge, test):
    """The Jacobian's step on the targets of a test."""
    plan = judge.plans[test]
    measurements, _ = judge.trial.run(plan, f"{test} first")
    points = learners.measured_points(judge.trial.robot.mechanism, measurements)
    path, index = plan.path()
    # targets without a measurement have no known error
    index = index[rows.usable(measurements)]

    def learn():
        learned = learners.jacobian_step(points, index)
        learned.controller(path)
        return replace(learned, evaluations=len(index))

    return judge.learn("jacobian_step", len(plan.targets()), learn)


def summary(curve, noise_mm):
    """Rows of `methods`: each method with all its points, and the fewest points that are enough."""
    result = []
    for method, part in curve.groupby("method", sort=False):
        inside = part[part["test"] == "inside"].sort_values("points")
        last = inside["after_mean_mm"].iloc[-1]
        short = np.flatnonzero(inside["after_mean_mm"] > max((1.0 + _MIN_IMPROVEMENT) * last, last + noise_mm))
        enough = inside.iloc[short[-1] + 1 if short.size else 0]
        most = part.sort_values("points", kind="stable").drop_duplicates("test", keep="last").set_index("test")
        result.append(
            most.loc[list(TESTS)]
            .reset_index()
            .assign(
                removed_share=lambda frame: 1.0 - frame["after_mean_mm"] / frame["before_mean_mm"],
                points_needed=int(enough["points"]),
                needed_time_s=float(enough["measuring_time_s"]),
                needs=learners.NEEDS[method],
            )
        )
    return pd.concat(result, ignore_index=True)
