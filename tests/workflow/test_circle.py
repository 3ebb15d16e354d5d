"""The example of the whole circle, with fewer points on the third campaign: from an MJCF to a corrected one."""

import pandas as pd
import pytest

from tests.workflow import test_dependencies as dependencies
from tests.workflow.folder import run

_SMALLER = """
results_dir: results
gap: {draws: 20}
trajectories: {elsewhere: {lines: {points: 10}}}
"""
# what the bench has in MuJoCo's terms, see examples/circle.yaml
_PLAY_RAD, _STIFFNESS_N_MM = 0.0003, 1.5e8


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("circle")
    (place / "smaller.yaml").write_text(_SMALLER)
    (place / "record").mkdir()
    overlays = ("examples/circle.yaml", "smaller.yaml")
    code, output = run(place, "circle", overlays=overlays, record=place / "record")
    assert code == 0, output
    return place


def _of(folder, campaign, name):
    return pd.read_parquet(folder / f"results/campaigns/{campaign}/{name}.parquet")


def test_the_second_campaign_ends_with_the_run_that_the_first_was_advised(folder):
    advised = _of(folder, "first", "gap_next_runs").iloc[0]
    before, points = _of(folder, "first", "measurements"), _of(folder, "second", "measurements")
    assert points["run"].nunique() == before["run"].nunique() + 1
    last = points[points["run"] == points["run"].max()]
    assert len(last) == advised["points"] and set(last["trajectory"]) == {advised["trajectory"]}
    assert set(last["payload_kg"]) == {advised["payload_kg"]} and set(last["speed_mm_s"]) == {advised["speed_mm_s"]}
    again = before[before["trajectory"] == advised["trajectory"]].groupby("run").first()
    starts = again[["command_x_mm", "command_y_mm", "command_z_mm"]].to_numpy()
    first = last[["command_x_mm", "command_y_mm", "command_z_mm"]].to_numpy()[0]
    assert abs(starts[int(advised["reverse"])] - first).max() < 1e-9


def test_the_advised_run_settles_an_uncertain_verdict(folder):
    before, after = (_of(folder, name, "gap_verdicts").iloc[0] for name in ("first", "second"))
    assert before["confounded_with"] != "" and before["probability"] < 0.9
    assert after["effects"] == "backlash+drive_compliance" and after["confounded_with"] == ""
    assert after["probability"] > before["probability"] and after["next_runs"] == ""
    found = _of(folder, "second", "gap_parameters").set_index("parameter")[["value", "standard_error"]]
    for name, truth in (("width3", _PLAY_RAD), ("compliance2", 1.0 / _STIFFNESS_N_MM)):
        value, error = found.loc[name]
        assert abs(value - truth) < 3.0 * error < 0.2 * truth


def test_the_corrected_file_leaves_the_noise_of_a_third_campaign(folder):
    table = pd.read_parquet(folder / "results/tables/circle.parquet").set_index("model")
    assert set(table["fresh"]) == {"third"} and set(table["diagnosed"]) == {"second"}
    rms, noise = table["rms_mm"], table["noise_rms_mm"].iloc[0]
    assert rms["given"] > rms["calibrated"] > 3.0 * noise
    assert rms["corrected"] < 1.2 * noise
    assert (folder / "results/figures/circle.svg").stat().st_size > 10_000


def test_the_trial_of_a_corrected_file_reads_what_it_is_handed_and_loads_what_its_digest_covers(folder):
    jobs = dependencies.recorded(folder / "record")["try_corrected"]
    dependencies.test_a_rule_is_handed_what_its_jobs_read_and_nothing_else({"try_corrected": jobs})
    dependencies.covered_by_its_digest("try_corrected", jobs)
