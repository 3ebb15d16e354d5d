"""Interpretations of the algorithm compared with Tables 3 and 4: synthetic curves that reproduce them or not."""

import numpy as np
import pandas as pd
import pytest

from rrru.studies.rrru3.paper import CROSSOVER, MIGRATION
from rrru.studies.rrru3.published import _sweep
from rrru.studies.rrru3.schemas import TABLES
from rrru.studies.rrru3.sweep_match import sweep_match

VALUES = np.arange(1, 11) / 10.0
SCHEMA = next(table for table in TABLES if table.name == "sweep_match")


def runs(curve, scatter, parameter="migration_fraction", operators="pygad", values=VALUES, seeds=20):
    generator = np.random.default_rng(1)
    rows = [
        {"value": value, "seed": seed, "objective_mm": level + scatter * generator.standard_normal()}
        for value, level in zip(values, curve, strict=True)
        for seed in range(seeds)
    ]
    label = {"operators": operators, "stop": "end", "parameter": parameter, "population": "one"}
    return pd.DataFrame(rows).assign(**label)


def match(*frames):
    return SCHEMA.pandera().validate(sweep_match(pd.concat(frames, ignore_index=True)))


def test_scatter_like_the_printed_one_reproduces_and_hundreds_of_times_as_much_does_not():
    flat = np.full(10, 0.7)
    row = match(runs(flat, 0.0001)).iloc[0]
    assert row["verdict"] == "reproduced" and row["nearest"] and row["table"] == "Table 4"
    assert row["level_mm"] == pytest.approx(0.7 - np.mean(MIGRATION), abs=1e-4)
    assert row["printed_range_mm"] == pytest.approx(0.0003)
    # too smooth to be a draw of these
    assert match(runs(flat, 0.03)).iloc[0]["verdict"] == "not reproduced"
    # medians that happen to be flat do not help where single runs are not
    pairs = runs(np.full(20, 0.7), 0.0, values=np.repeat(VALUES, 2), seeds=1)
    pairs["objective_mm"] += 0.02 * np.tile([-1.0, 1.0], 10)
    row = match(pairs.assign(seed=np.tile([1, 2], 10))).iloc[0]
    assert row["range_mm"] < 1e-9 < 0.0003 < row["chance_range_low_mm"] and row["verdict"] == "not reproduced"
    # too far away
    assert match(runs(np.linspace(0.5, 0.6, 10), 0.0001)).iloc[0]["verdict"] == "not reproduced"


def test_the_nearest_reading_is_taken_over_the_values_that_all_have():
    near = runs(np.array(CROSSOVER)[[0, 7, 9]], 0.0, "crossover_fraction", "pygad", VALUES[[0, 7, 9]], 2)
    far = runs(np.array(CROSSOVER) + 0.01 * VALUES, 0.0, "crossover_fraction", "matlab_gaussian")
    frame = match(near, far).set_index("operators")
    assert frame["nearest"].to_dict() == {"pygad": True, "matlab_gaussian": False}
    assert frame["settings"].to_dict() == {"pygad": 3, "matlab_gaussian": 10}
    expected = np.std(0.01 * VALUES)
    assert frame.loc["matlab_gaussian", "distance_mm"] == pytest.approx(expected)
    assert frame.loc["matlab_gaussian", "distance_shared_mm"] == pytest.approx(np.std(0.01 * VALUES[[0, 7, 9]]))


def test_infeasible_runs_and_unprinted_values_are_left_out():
    frame = runs(np.full(10, 0.6), 0.001)
    frame.loc[0, "objective_mm"] = np.inf
    other = runs([0.6, 0.6], 0.001, values=[0.15, 0.25])
    row = match(frame, other).iloc[0]
    assert (row["runs"], row["settings"]) == (199, 10) and np.isfinite(row["distance_mm"])


def test_the_nearest_seed_by_brute_force_and_published_shows_it_with_the_range_over_seeds():
    frame = runs(np.array(CROSSOVER) + 0.1, 0.02, "crossover_fraction", "matlab_gaussian", seeds=12)
    frame.loc[(frame["seed"] == 3) & (frame["value"] == 1.0), "objective_mm"] = np.inf
    distances = {}
    for seed, part in frame.groupby("seed"):
        part = part[np.isfinite(part["objective_mm"])].sort_values("value")
        off = [
            one - CROSSOVER[round(10 * value) - 1]
            for value, one in zip(part["value"], part["objective_mm"], strict=True)
        ]
        distances[seed] = np.sqrt(np.mean([(one - np.mean(off)) ** 2 for one in off]))
    nearest = min(distances, key=distances.get)
    row = match(frame).iloc[0]
    assert row["nearest_seed"] == nearest and row["nearest_seed_mm"] == pytest.approx(distances[nearest])
    here, spread = _sweep(frame, "matlab_gaussian")
    assert list(here) == [f"P_c={k / 10:.1f}" for k in range(1, 11)]
    at = frame[frame["value"] == 0.8]
    assert here["P_c=0.8"] == at.set_index("seed").loc[nearest, "objective_mm"]
    assert spread["P_c=0.8"] == pytest.approx(np.quantile(at["objective_mm"], [0.5, 0.05, 0.95]))
    assert _sweep(frame, "pygad") == ({}, {})
