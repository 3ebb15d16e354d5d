"""Paper B's study as a user runs it."""

import pandas as pd
import pytest


def test_every_experiment_stands_in_the_tables(results):
    points = pd.read_parquet(results / "tables/ptt_points.parquet")
    benefit = pd.read_parquet(results / "tables/ptt_benefit.parquet").set_index(["experiment", "method", "set", "axis"])
    assert points.groupby(["experiment", "set"]).size().unstack().to_dict() == {
        "test": {f"ptt_{k}": 16 for k in range(1, 6)},
        "train": {f"ptt_{k}": 64 for k in range(1, 6)},
    }
    for name, part in points[points["set"] == "test"].groupby("experiment"):
        for axis in "xyz":
            before, after = (part[f"{when}_{axis}_mm"].abs().mean() for when in ("before", "after"))
            expected = 100.0 * (1.0 - after / before)
            assert benefit.loc[(name, "rbf_inverse", "test", axis), "benefit_percent"] == pytest.approx(
                expected, rel=1e-9
            )


def test_the_diagnosis_names_the_backlash_that_was_not_compensated(results):
    verdict = pd.read_parquet(results / "campaigns/ptt_1/gap_verdicts.parquet").iloc[0]
    assert "backlash" in verdict["effects"].split("+") and verdict["share_closed"] > 0.5
