"""Seconds and right answers of the gap diagnosis, beside what one would do instead: linear signatures of single effects
and the BIC.

`.venv/bin/python benchmarks/diagnosis.py` on robots of the withheld check, one after another in one run on one core.
"""

import sys
from time import perf_counter

import numpy as np

from rrru.gap.attribute import calibrate
from rrru.gap.case import make_case
from rrru.gap.diagnose import MeasuredRobot, diagnose, sim
from rrru.gap.settings import GapSettings
from rrru.studies.withheld.chunks import Member
from rrru.studies.withheld.draw import draw
from rrru.studies.withheld.robots import Conditions

_SETTINGS = {
    "seed": 2021,
    "robot": {"name": "rrru3", "dimensions": {}},
    "masses": {},
    "motion": {"speed_mm_s": 80.0, "acceleration_mm_s2": 40.0, "dwell_s": 60.0},
    "withheld": {"noise_mm": 0.02},
}


def plain(measurements, conditions, settings):
    """Name of the effect of lowest BIC, none or unexplained: columns of single effects beside the calibration."""
    noise_mm = conditions.noise_mm
    case = make_case(measurements, sim(conditions.mechanism), conditions.masses, noise_mm, settings.library())
    linear = case.linearise(calibrate(case))
    data, base = linear.data.ravel() / noise_mm, linear.base.reshape(-1, 7) / noise_mm
    found = {}
    for (name, _), columns in {("none", 0): np.zeros((*base.shape[:1], 0)), **linear.columns}.items():
        design = np.concatenate([base, columns.reshape(len(data), -1) / noise_mm], axis=1)
        misfit = float(((data - design @ np.linalg.lstsq(design, data, rcond=None)[0]) ** 2).sum())
        found[name] = min(found.get(name, (np.inf, 0.0)), (misfit + design.shape[1] * np.log(len(data)), misfit))
    best = min(found, key=found.get)
    too_much = found[best][1] > len(data) + 5.0 * np.sqrt(2.0 * len(data))
    return "unexplained" if too_much else best


def main(count=40):
    """Print a line per robot and the sums."""
    conditions, settings = Conditions.from_config(_SETTINGS), GapSettings()
    known = MeasuredRobot(conditions.mechanism, conditions.masses, conditions.noise_mm)
    seconds, right = {"here": [], "plain": []}, {"here": 0, "plain": 0}
    for number in range(count):
        robot = draw(Member("label", "", number), conditions)
        (measurements, _), truth = robot.campaign(conditions).run(), robot.truth
        answers = {}
        for name, method in (
            ("here", lambda m: diagnose(m, known, settings).verdict["effects"]),
            ("plain", lambda m: plain(m, conditions, settings)),
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
