"""Runs on one calibration set: their results against the optimum, the typical run, and the comparison of methods."""

import numpy as np
import pandas as pd
import pytest

from rrru.estimation.observations.target_positions import TargetPositions
from rrru.genetic.campaign_runs import Runs, against_least_squares, study_set, typical_parameters
from rrru.genetic.schemas import TABLES
from rrru.genetic.settings import GeneticSettings
from rrru.robots.catalogue import make_mechanism

TRUTH = {"dtheta1": 0.002, "dL1": 0.3, "da": -0.4}


@pytest.fixture(scope="module", params=["rrru3", "delta"])
def study(request):
    """Robot, frames of three short runs on twenty poses, and the truth by identifiable name."""
    searched, identified = (
        make_mechanism(request.param, {}, parameter_set=name)
        for name in ("tied", "identifiable" if request.param == "rrru3" else "tied")
    )
    side = np.random.default_rng(0).uniform(-150.0, 150.0, (20, 2))
    height = {"rrru3": 650.0, "delta": -300.0}[request.param]
    points = np.column_stack([side, np.full(20, height)])
    truth = {name: TRUTH.get(name, 0.0) for name in identified.parameters.names}
    actuators = identified.inverse(points)
    measured = identified.forward(actuators, identified.parameters.vector(truth), points)
    measured = measured + np.random.default_rng(1).normal(0.0, 0.02, measured.shape)
    sets = (TargetPositions(robot, actuators, measured, points) for robot in (searched, identified))
    runs = Runs(GeneticSettings(generations=40, stall_generations=0), 3, 5, ("made_up",))
    return searched, study_set(*sets, "lines", runs), truth


def test_the_frames_are_those_of_the_tables_for_any_robot(study):
    searched, frames, _ = study
    for name, frame in frames.items():
        schema = next(table for table in TABLES if table.name == name)
        schema.pandera().validate(frame.assign(campaign="made_up"))
    runs, found = frames["genetic"], frames["genetic_parameters"]
    assert set(searched.parameters.names) <= set(found["parameter"])
    assert (runs["objective_mm"] >= runs["polished_mm"] - 1e-9).all()
    assert runs["polished_excess"].abs().max() < 1e-4
    assert (runs["excess"] > 0.0).all()


def test_the_typical_run_is_the_lower_median(study):
    _, frames, truth = study
    runs, found = (frames[name][frames[name]["seed"] < 3] for name in ("genetic", "genetic_parameters"))
    best = runs.loc[runs["objective_mm"].idxmin(), "seed"]
    typical = typical_parameters(runs, found, tuple(truth))
    assert typical["parameter"].tolist() == list(truth)
    values = found[found["seed"] == best].set_index("parameter")["value"]
    assert typical["value"].tolist() == values[list(truth)].tolist()


def test_methods_stand_side_by_side(study):
    _, frames, truth = study
    names = list(truth)
    fits = pd.DataFrame({"calibration": ["lines"], "method": "least_squares", "mean_mm": 0.03, "evaluations": 7})
    units = frames["genetic_parameters"].drop_duplicates("parameter").set_index("parameter")["unit"][names].tolist()
    label = {"calibration": "lines", "method": "least_squares"}
    away = pd.DataFrame({"parameter": names, "unit": units, "value": [value + 0.1 for value in truth.values()]} | label)
    tables = frames["genetic"], frames["genetic_parameters"], fits, away
    rows = against_least_squares(*tables, truth).set_index("method")
    assert rows.index.tolist() == ["least_squares", "genetic", "genetic_polished"]
    assert rows.loc["least_squares", ["angle_error_rad", "length_error_mm"]].tolist() == pytest.approx([0.1, 0.1])
    assert rows.loc["genetic", "mean_mm"] == frames["genetic"]["objective_mm"].median()
    assert rows.loc["genetic", "runs"] == 3
    assert rows.loc["genetic_polished", "evaluations"] > rows.loc["genetic", "evaluations"]
    assert rows.loc["genetic_polished", "angle_error_rad"] != rows.loc["genetic", "angle_error_rad"]
    optimum = frames["genetic"]["optimum_mm"].iloc[0]
    assert rows.loc["least_squares", "excess"] == pytest.approx(0.03 / optimum - 1.0)
    assert against_least_squares(*tables, None)[["angle_error_rad", "length_error_mm"]].isna().all(axis=None)
