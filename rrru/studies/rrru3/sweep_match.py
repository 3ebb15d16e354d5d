"""Interpretation of the genetic algorithm nearest to Tables 3 and 4 of paper A, and whether it reproduces them."""

import numpy as np
import pandas as pd

from rrru.genetic.sweep import SWEEP
from rrru.seeds import stream
from rrru.studies.rrru3.paper import CROSSOVER, MIGRATION, SETTINGS

PRINTED = {
    "crossover_fraction": ("Table 3", dict(zip(map(float, SETTINGS), CROSSOVER, strict=True))),
    "migration_fraction": ("Table 4", dict(zip(map(float, SETTINGS), MIGRATION, strict=True))),
}
_CURVES = 4000
_MIDDLE = (0.025, 0.975)


def sweep_match(runs, seed=0):
    """Rows of `sweep_match`, one per SWEEP of a table of runs, whose values the paper prints.

    A printed curve has a single run per value. It is reproduced if it is compatible with random curves of a single run
    per value: its distance from the medians, without its mean, since the level depends on the robot, and its range both
    have to be within the middle 95 % of those of random curves. `seed` is for these draws.
    """
    rows, runs = [], runs[np.isfinite(runs["objective_mm"])]
    for parameter, (table, printed) in PRINTED.items():
        swept = runs[(runs["parameter"] == parameter) & runs["value"].isin(printed)]
        if swept.empty:
            continue
        every = swept.groupby(SWEEP)["value"].agg(set)
        shared = sorted(set.intersection(*every))
        found = [_row(group, key, printed, shared, seed) for key, group in swept.groupby(SWEEP)]
        nearest = min(row["distance_shared_mm"] for row in found)
        rows += [{"table": table, "nearest": row["distance_shared_mm"] == nearest} | row for row in found]
    return pd.DataFrame(rows)


def nearest_seed(runs, printed):
    """The seed whose single curve is nearest to a printed one, and its distance in mm, each minus its mean.

    runs: of one sweep; printed: value to objective. Values at which a run of the seed is infeasible do not count.
    """
    curves = runs[np.isfinite(runs["objective_mm"])].pivot(index="seed", columns="value", values="objective_mm")
    off = curves - np.array([printed[value] for value in curves.columns])
    distance = np.sqrt(off.sub(off.mean(axis=1), axis=0).pow(2).mean(axis=1))
    return int(distance.idxmin()), float(distance.min())


def _row(group, key, printed, shared, seed):
    """One sweep compared with the printed curve; shared: values that all sweeps of this table have."""
    samples = {value: part.to_numpy() for value, part in group.groupby("value")["objective_mm"]}
    medians = np.array([np.median(sample) for sample in samples.values()])
    curve = np.array([printed[value] for value in samples])
    distance = _centred_distance(medians, curve)
    generator = stream(seed, "sweep_match", *key)
    drawn = np.stack([generator.choice(sample, _CURVES) for sample in samples.values()], axis=1)
    low, high = np.quantile(_centred_distance(drawn, medians), _MIDDLE)
    ranges = np.quantile(np.ptp(drawn, axis=1), _MIDDLE)
    reproduced = low <= distance <= high and ranges[0] <= np.ptp(curve) <= ranges[1]
    common, (seed, seed_distance) = np.isin(list(samples), shared), nearest_seed(group, printed)
    return dict(zip(SWEEP, key, strict=True)) | {
        "settings": len(samples),
        "runs": len(group),
        "level_mm": float((medians - curve).mean()),
        "distance_mm": float(distance),
        "chance_low_mm": float(low),
        "chance_high_mm": float(high),
        "nearest_seed": seed,
        "nearest_seed_mm": seed_distance,
        "distance_shared_mm": float(_centred_distance(medians[common], curve[common])),
        "scatter_mm": float(np.median([np.ptp(sample) for sample in samples.values()])),
        "range_mm": float(np.ptp(medians)),
        "chance_range_low_mm": float(ranges[0]),
        "chance_range_high_mm": float(ranges[1]),
        "printed_range_mm": float(np.ptp(curve)),
        "verdict": "reproduced" if reproduced else "not reproduced",
    }


def _centred_distance(curves, curve):
    """RMS distance (...) of curves (..., v) from a curve (v,), each minus its mean."""
    difference = curves - curve
    return np.sqrt(np.mean((difference - difference.mean(axis=-1, keepdims=True)) ** 2, axis=-1))
