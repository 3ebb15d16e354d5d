"""Numbers of the sister studies for papers B and C, out of small tables made by hand."""

import numpy as np
import pandas as pd
import pytest
import yaml

from rrru.studies.rrru3.published_sisters import sister_rows
from rrru.studies.rrru3.sisters import spread_c, study_b, study_c
from tests.workflow.folder import ROOT

CONFIG = yaml.safe_load((ROOT / "config.yaml").read_text())


def test_paper_bs_numbers_are_those_of_the_jacobians_route_on_test_points():
    rows = [
        {"experiment": f"ptt_{k}", "method": method, "set": which, "axis": axis, "benefit_percent": value + k}
        for k in range(1, 6)
        for axis in ("x", "y", "z", "z_absolute")
        for method, which, value in (
            ("rbf_jacobian", "test", 90.0),
            ("rbf_jacobian", "train", 0.0),
            ("parameters", "test", 50.0),
        )
    ]
    spread = pd.DataFrame(
        [
            {
                "experiment": f"ptt_{k}",
                "spread_from": "candidate",
                "learns": "correction",
                "spread_mm": mm,
                "chosen": mm == 40.0,
            }
            for k in range(1, 6)
            for mm in (20.0, 40.0)
        ]
    )
    neurons = np.arange(0, 31)
    # within a tenth of its least RMS error from 8 neurons on
    error = np.where(neurons < 8, 10.0 - neurons, np.where(neurons < 15, 1.05, 1.0))
    training = pd.concat(
        [
            pd.DataFrame(row | {"neurons": neurons, "validation_mse_mm2": error**2})
            for row in spread.drop(columns="chosen").to_dict("records")
        ]
    )
    repeatability = pd.DataFrame(
        [
            {"leg": leg, "compensated": compensated, "per_travel_um_per_mm": 0.1 if compensated else 0.2}
            for leg in (1, 2, 3)
            for compensated in (True, False)
        ]
    )
    here = study_b(CONFIG, pd.DataFrame(rows), spread, training, repeatability)
    assert [here[f"benefit_{k}_{axis}"] for k in (1, 5) for axis in "xyz"] == [91.0] * 3 + [95.0] * 3
    assert here["spread_3"] == pytest.approx(40.0 / CONFIG["ptt"]["curve"]["radius_mm"])
    assert here["training_steps"] == 8.0 and here["order_repeatability"] == 1.0 and here["training_points"] == 160.0
    # every item is one that the paper prints
    sister_rows({"B": here})
    worse = repeatability.assign(per_travel_um_per_mm=[0.3, 0.2] * 3)
    assert study_b(CONFIG, pd.DataFrame(rows), spread, training, worse)["order_repeatability"] == 0.0


def test_paper_cs_numbers_are_those_of_the_papers_variant():
    points = pd.DataFrame(
        {
            "variant": ["none"] * 3 + ["paper"] * 3 + ["shape"] * 3,
            "error_mm": [1.0, 2.0, 3.0, 0.1, 0.2, 0.6, 9.0, 9.0, 9.0],
        }
    )
    camera = pd.DataFrame({"parameter": ["focal_x_px", "focal_y_px"], "found": [1600.0, 1700.0]})
    here = study_c(CONFIG, points, camera)
    assert (here["before_mean"], here["before_max"], here["after_max"]) == (2.0, 3.0, 0.6)
    assert here["after_mean"] == pytest.approx(0.3)
    assert here["focal_length_mm"] == pytest.approx(1600.0 * 0.0099) and here["poses"] == 20.0
    sister_rows({"C": here})


def test_paper_cs_ranges_are_those_of_before_and_the_papers_variant():
    sizes = [f"plane_{kind}_{side}_mm" for kind in ("mean", "max") for side in ("low", "high")]
    draws = pd.DataFrame(np.arange(12.0).reshape(3, 4), columns=sizes).assign(variant=["none", "paper", "shape"])
    spread = spread_c(draws)
    assert spread["before_mean"] == (0.0, 1.0) and spread["after_mean"] == spread["after_about"] == (4.0, 5.0)
    assert spread["after_max"] == (6.0, 7.0)
    rows = {row["item"]: row for row in sister_rows(spread={"C": spread}) if row["paper"] == "C"}
    assert (rows["after_max"]["here_low"], rows["after_max"]["here_high"]) == (6.0, 7.0)
    assert np.isnan(rows["poses"]["here_low"])
