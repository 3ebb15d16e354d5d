"""Seconds and right answers of the gap diagnosis, beside what one would do instead: linear signatures of single effects
and the BIC.

`.venv/bin/python benchmarks/diagnosis.py` on robots of the withheld check, one after another in one run on one core.
"""

import sys
from time import perf_counter

import numpy as np

from rrru.gap.attribute import calibrate
from rrru.gap.case import make_case
from rrru.gap.diagnose import GapSettings, diagnose, sim
from rrru.robots.dynamics import Masses
from rrru.studies.withheld.draw import draw_labelled
from rrru.studies.withheld.robots import NOISE_MM, measure, nominal, truth_of

_SEED = 2021


def plain(measurements, mechanism, settings):
    """Name of the effect of lowest BIC, none or unexplained: each effect's linear columns beside the calibration's,
    noise known.
    """
    case = make_case(measurements, sim(mechanism), Masses(), NOISE_MM, settings.library())
    linear = case.linearise(calibrate(case))
    data, base = linear.data.ravel() / NOISE_MM, linear.base.reshape(-1, 7) / NOISE_MM
    found = {}
    for (name, _), columns in {("none", 0): np.zeros((*base.shape[:1], 0)), **linear.columns}.items():
        design = np.concatenate([base, columns.reshape(len(data), -1) / NOISE_MM], axis=1)
        misfit = float(((data - design @ np.linalg.lstsq(design, data, rcond=None)[0]) ** 2).sum())
        found[name] = min(found.get(name, (np.inf, 0.0)), (misfit + design.shape[1] * np.log(len(data)), misfit))
    best = min(found, key=found.get)
    too_much = found[best][1] > len(data) + 5.0 * np.sqrt(2.0 * len(data))
    return "unexplained" if too_much else best


def main(count=40):
    """Print a line per robot and the sums."""
    mechanism, settings = nominal({}), GapSettings()
    seconds, right = {"here": [], "plain": []}, {"here": 0, "plain": 0}
    for number in range(count):
        robot = draw_labelled(_SEED, number, mechanism)
        measurements, truth = measure(robot, _SEED, mechanism), truth_of(robot)
        answers = {}
        for name, method in (
            ("here", lambda m: diagnose(m, mechanism, Masses(), settings, NOISE_MM).verdict["effects"]),
            ("plain", lambda m: plain(m, mechanism, settings)),
        ):
            start = perf_counter()
            answers[name] = method(measurements)
            if number:
                seconds[name].append((len(measurements), perf_counter() - start))
            same = set(answers[name].split("+")) == set(truth.split("+"))
            right[name] += same or (truth.startswith("outside") and "unexplained" in answers[name])
        print(
            f"{len(measurements):4d} points  {truth:45s} here: {answers['here']:45s} plain: {answers['plain']}",
            flush=True,
        )
    for name, times in seconds.items():
        print(f"{name}: right {right[name]} of {count}")
        for size, chosen in (
            ("up to 400 points", [t for n, t in times if n <= 400]),
            ("more", [t for n, t in times if n > 400]),
        ):
            if chosen:
                print(f"  {size}: median {np.median(chosen):.2f} s, longest {max(chosen):.2f} s")


if __name__ == "__main__":
    main(*(int(text) for text in sys.argv[1:]))
