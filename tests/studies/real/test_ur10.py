"""A UR10 before a laser tracker: the shipped series of 632 poses, with others' fits as the reference."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from rrru.diagnosis.settings import GapSettings
from rrru.studies.real import arm_tables, arms
from rrru.studies.real.series import found
from tests.places import ROOT


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    config = yaml.safe_load((ROOT / "config.yaml").read_text())
    real = config["real"] | {"folder": str(ROOT / config["real"]["folder"])}
    series = {one.label: one for one in found(real, "ur10")}
    settings = GapSettings.from_config(config["gap"] | real["gap"], config["seed"])
    sheet = Path(tmp_path_factory.mktemp("ur10"), "sheet.parquet")
    return arms.study(series["D"], config["robots"], settings, sheet)


@pytest.fixture(scope="module")
def tables(studied):
    return arm_tables.tables(studied)


def test_plain_models_leave_no_more_than_others_fits_of_them(tables):
    row = tables["real_verdicts"].iloc[0]
    for model in "abcd":
        assert row[f"held_out_{model}_rms_mm"] <= 1.02 * row[f"reference_{model}_rms_mm"]


def test_errors_that_depend_on_the_drive_angle_are_named_and_predict_held_out_rows(tables):
    row = tables["real_verdicts"].iloc[0]
    assert row["effects"].startswith("drive_error_function") and row["probability"] > 0.9
    assert row["held_out_rms_mm"] <= 0.095
    assert row["predicted_share"] == pytest.approx(row["held_out_share"], abs=0.05)
    assert "a rough function of every drive's angle" in row["notes"] and "for the function" in row["notes"]


def test_no_wave_is_left_of_what_stood_out_before(tables):
    waves = tables["real_spectrum"].dropna()
    strong = waves[waves["before_rad"] > 2e-4]
    assert len(strong) > 20
    assert (strong["after_rad"] < 0.2 * strong["before_rad"]).all()


def test_held_out_rows_are_in_no_fit(studied):
    held = (studied.measurements["status"] == "held_out").to_numpy()
    assert held.sum() == len(studied.held_out_mm) > 150
    assert not np.isin(np.flatnonzero(held), studied.problem.at).any()


def test_the_corrected_model_fits_the_rows_that_it_was_fitted_to(studied, tables):
    """A compliance times an unstated payload: the mean of each factor left twice the rms on these rows."""
    inference = studied.diagnosis.inference
    fitted = np.sqrt((inference.problem.residual(inference.state) ** 2).sum(axis=1).mean())
    assert fitted < tables["real_verdicts"].iloc[0]["held_out_rms_mm"]


def test_every_number_lies_in_its_own_interval(studied):
    numbers = studied.diagnosis.tables["gap_parameters"].dropna(subset=["low_95", "high_95"])
    assert (numbers["low_95"] <= numbers["value"]).all() and (numbers["value"] <= numbers["high_95"]).all()
