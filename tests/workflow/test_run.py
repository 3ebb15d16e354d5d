"""The workflow as a user runs it: end to end, interrupted, refused."""

import os
import signal
import time

import pandas as pd

from rrru.studies.rrru3 import paper as paper_a
from tests.places import ROOT
from tests.workflow.folder import MINIMAL, digests, dry_run, run_here, start


def test_everything_is_there_and_a_second_run_does_nothing(shared, results):
    made = digests(results)
    assert {"tables/published.parquet", "tables/audit.parquet", "tables/errors.parquet", "figures/fig09.png"} <= set(
        made
    )
    campaigns = pd.read_parquet(results / "tables/campaigns.parquet")
    assert {"paper", "crooked", "field_01", "field_09"} == set(campaigns["campaign"])
    # the 3-RRRU hangs below its base
    assert campaigns["z_down"].all()
    code, output = dry_run(shared, "all", "withheld", overlays=(MINIMAL, "field.yaml"))
    assert code == 0 and "Nothing to be done" in output


def test_every_number_of_the_paper_stands_beside_ours(results):
    published = pd.read_parquet(results / "tables/published.parquet")
    for number in paper_a.NUMBERS:
        row = published[(published["item"] == number.item) & (published["source"] == number.source)]
        assert len(row) == 1 and row["published"].iloc[0] == number.value and row["unit"].iloc[0] == number.unit
    known = published.dropna(subset=["here", "ratio"])
    pd.testing.assert_series_equal(known["ratio"], known["here"] / known["published"], check_names=False)
    by_item = published.drop_duplicates("item").set_index("item")
    assert (by_item.loc[[n.item for n in paper_a.DESIGN], "ratio"].drop(["population"]).dropna() == 1.0).all()
    # the minimal sweep has two of the ten values
    assert (
        by_item.loc[["P_c=0.5", "P_m=1.0", *paper_a.ERRORS_MM], "here"].notna().all()
        and by_item.loc["P_c=0.4":"P_c=0.4", "here"].isna().all()
    )
    # recomputed from the point errors, not through the package
    errors = pd.read_parquet(results / "tables/errors.parquet").query("campaign == 'paper'")
    first = errors.query("trajectory == 'line_1' and mode == 'before'")["error_mm"]
    assert (
        by_item.loc["group1_before_max", "here"] == first.max()
        and by_item.loc["group1_before_min", "here"] == first.min()
    )
    driven = errors.query("mode == 'closed_loop' and method == 'least_mean_distance'")
    curve = driven.query("trajectory == 'spiral' and calibration == 'group_1'")
    assert by_item.loc["spiral_under_lines_x_min", "here"] == curve["error_x_mm"].min()
    spread = published.dropna(subset=["here_low"])
    assert len(spread) >= 17 and (spread["here_low"] <= spread["here_high"]).all()


# One job of nearly every rule that computes. What needs all jobs, the papers' numbers and the sweeps' statistics, is
# left out: a second whole run would take three times as long
_ONE_OF_EACH = (
    *(f"figures/field_09/{name}.png" for name in ("gap", "cross")),
    *("sweep/pygad/migration_fraction/islands/sweep_runs.parquet", "methods/ptt3/methods.parquet"),
    *(f"tables/{name}.parquet" for name in ("delta_calibrations", "printers", "ptt_benefit")),
)


def test_a_run_that_was_killed_and_goes_on_on_one_core_ends_with_the_same_bytes(results, tmp_path):
    targets = [f"build/minimal/{target}" for target in _ONE_OF_EACH]
    process = start(tmp_path, *targets)
    until = time.monotonic() + 300.0
    while len(list((tmp_path / "build").rglob("*.parquet"))) < 12:
        assert process.poll() is None and time.monotonic() < until
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert not all((tmp_path / target).exists() for target in targets)
    code, output = run_here(tmp_path, "--unlock", overlays=(MINIMAL,))
    assert code == 0, output
    code, output = run_here(tmp_path, *targets, overlays=(MINIMAL,), cores=1)
    assert code == 0, output
    assert all((tmp_path / target).exists() for target in targets)
    made, whole = digests(tmp_path / "build/minimal"), digests(results)
    assert made == {name: whole[name] for name in made} and len(made) > 60


def test_a_user_campaign_is_added_by_an_overlay(results, tmp_path):
    """Only the campaign's own part is made: the rest is the same study."""
    data = pd.read_csv(ROOT / "data/field_01.csv").drop(
        columns=["theta1_rad", "theta2_rad", "theta3_rad", "payload_kg"]
    )
    position = [f"{kind}_{axis}_mm" for kind in ("command", "measured") for axis in "xyz"]
    data[position] /= 25.4
    data.to_csv(tmp_path / "mine.csv", index=False)
    (tmp_path / "mine.yaml").write_text("campaigns: {mine: {robot: rrru3, ingest: mine.csv, unit: inch}}\n")
    target = "build/minimal/campaigns/mine/errors.parquet"
    code, output = run_here(tmp_path, target, overlays=(MINIMAL, "mine.yaml"))
    assert code == 0, output
    errors = pd.read_parquet(tmp_path / target)
    same = pd.read_parquet(results / "campaigns/field_01/errors.parquet")
    rows = (errors["mode"] == "before").to_numpy()
    pd.testing.assert_series_equal(
        errors["error_mm"][rows], same["error_mm"][(same["mode"] == "before").to_numpy()], atol=1e-5
    )
    info = pd.read_parquet(tmp_path / "build/minimal/campaigns/mine/campaigns.parquet").iloc[0]
    assert info["noise_from"] in ("repeats", "high_frequency") and "theta" in info["notes"]


def test_a_refused_file_says_where_and_leaves_nothing(tmp_path):
    lines = (ROOT / "data/field_01.csv").read_text().splitlines()
    lines[17] = lines[17].replace(lines[17].split(",")[11], "oops")
    (tmp_path / "bad.csv").write_text("\n".join(lines))
    (tmp_path / "bad.yaml").write_text("campaigns: {bad: {robot: rrru3, ingest: bad.csv}}\n")
    code, output = run_here(
        tmp_path, "build/minimal/campaigns/bad/measurements.parquet", overlays=(MINIMAL, "bad.yaml")
    )
    assert code != 0
    assert (
        "bad.csv, row 18, column measured_y_mm: got 'oops'" in output
        and "Traceback" not in output.split("IngestError")[-1]
    )
    assert not list((tmp_path / "build").rglob("*.parquet")) and not list((tmp_path / "build").rglob("*.partial*"))
