"""The target `real` as a user runs it: what is there is studied, what is not is left out with a message."""

import json

import pandas as pd
import pytest

from tests.places import ROOT
from tests.workflow.folder import run


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with 150 rows of the UR10, a file of it without a joint, none of other sets; what its run said."""
    place = tmp_path_factory.mktemp("real")
    whole = pd.read_csv(ROOT / "data/real/ur10/series_D.csv")
    (place / "measured/ur10").mkdir(parents=True)
    whole.head(150).to_csv(place / "measured/ur10/series_S.csv", index=False)
    whole.head(20).drop(columns="q3_rad").to_csv(place / "measured/ur10/series_X.csv", index=False)
    (place / "record").mkdir()
    (place / "mine.yaml").write_text(
        "real: {folder: measured, gap: {effects: [drive_compliance, encoder_eccentricity]}}\n"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("RRRU_REAL_DATA", raising=False)
        code, said = run(place, "real", overlays=("mine.yaml",), record=place / "record")
    assert code == 0, said
    return place, said


def test_the_series_that_is_there_has_a_verdict_steps_and_pages(folder):
    place, _ = folder
    verdicts = pd.read_parquet(place / "results/tables/real_verdicts.parquet")
    assert verdicts["campaign"].to_list() == ["ur10_S", "ur10_X"]
    steps = pd.read_parquet(place / "results/tables/real_steps.parquet")
    assert steps["model"].to_list() == ["a", "b", "c", "c2", "d", "e", "verdict"]
    for name in ("steps", "spectrum"):
        assert (place / f"results/figures/real/ur10/{name}.pdf").stat().st_size > 1000


def test_what_is_not_there_is_left_out_with_a_message(folder):
    _, said = folder
    for name in ("irb120", "justin", "maslow", "planar_cables"):
        assert f"real.sets.{name}: skipped, no " in said
    assert "set RRRU_REAL_DATA to its folder" in said


def test_a_file_that_is_refused_has_a_row_that_says_why(folder):
    place, said = folder
    row = pd.read_parquet(place / "results/tables/real_verdicts.parquet").set_index("campaign").loc["ur10_X"]
    assert row["effects"] == "refused" and "no column 'q3_rad'" in row["notes"] and row["points"] == 0
    assert "ur10_X: left out" in said
    assert pd.read_parquet(place / "results/tables/real_carried.parquet").empty


def test_a_job_is_handed_what_it_reads_and_nothing_else(folder):
    place, _ = folder
    rows = [json.loads(file.read_text()) for file in (place / "record").glob("study_series*.json")]
    assert len(rows) == 2
    # the one that is refused reads less
    handed, read = ({tuple(path) for row in rows for path in row[name]} for name in ("handed", "read"))
    # references are of series by name, which are not all here
    handed = {path for path in handed if path[3:4] != ("reference",)}
    assert handed <= read, sorted(handed - read, key=str)
