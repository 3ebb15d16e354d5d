"""Paper B's study as a user runs it."""

import hashlib
import subprocess

import pandas as pd
import pytest

from tests.workflow.folder import SNAKEMAKE, link

_OVERLAY = """
results_dir: build
ptt:
  repeats: 3
  network: {spreads_mm: [15.0, 60.0]}
  extrapolation: {radius_mm: [5.0], height_mm: [], payload_kg: []}
  redraws: 3
  starts_deg: [0.0, 180.0]
  bench: {samples_per_turn: 10}
"""
_TARGETS = (
    "build/tables/ptt_benefit.parquet",
    "build/tables/ptt_repeatability.parquet",
    "build/campaigns/ptt_1/gap_verdicts.parquet",
)


def _run(folder, *arguments, cores=2):
    """Exit code and output of snakemake in a folder of its own."""
    link(folder)
    (folder / "mine.yaml").write_text(_OVERLAY)
    command = [SNAKEMAKE, "--cores", str(cores), *arguments, "--configfile", "mine.yaml"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=300)
    return done.returncode, done.stdout + done.stderr


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ptt")
    code, output = _run(folder, *_TARGETS)
    assert code == 0, output
    return folder / "build"


def test_every_experiment_stands_in_the_tables(finished):
    points = pd.read_parquet(finished / "tables/ptt_points.parquet")
    benefit = pd.read_parquet(finished / "tables/ptt_benefit.parquet").set_index(
        ["experiment", "method", "set", "axis"]
    )
    assert points.groupby(["experiment", "set"]).size().unstack().to_dict() == {
        "test": {f"ptt_{k}": 20 for k in range(1, 6)},
        "train": {f"ptt_{k}": 160 for k in range(1, 6)},
    }
    for name, part in points[points["set"] == "test"].groupby("experiment"):
        for axis in "xyz":
            before, after = (part[f"{when}_{axis}_mm"].abs().mean() for when in ("before", "after"))
            expected = 100.0 * (1.0 - after / before)
            assert benefit.loc[(name, "rbf_inverse", "test", axis), "benefit_percent"] == pytest.approx(
                expected, rel=1e-9
            )


def test_the_diagnosis_names_the_backlash_that_was_not_compensated(finished):
    verdict = pd.read_parquet(finished / "campaigns/ptt_1/gap_verdicts.parquet").iloc[0]
    assert "backlash" in verdict["effects"].split("+") and verdict["share_closed"] > 0.5


def test_one_core_gives_the_same_bytes(finished, tmp_path):
    parts = [
        f"tables/{name}.parquet"
        for name in ("ptt_backlash", "ptt_points", "ptt_benefit", "ptt_start", "ptt_extrapolation")
    ]
    parts.append("campaigns/ptt_1/measurements.parquet")
    code, output = _run(tmp_path, *(f"build/{part}" for part in parts), cores=1)
    assert code == 0, output
    for part in parts:
        here, there = (
            hashlib.sha256((folder / part).read_bytes()).hexdigest() for folder in (finished, tmp_path / "build")
        )
        assert here == there, part
