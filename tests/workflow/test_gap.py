"""The diagnosis as a user runs it: with an effect of one's own, on a file that lacks columns, and refused."""

import subprocess

import numpy as np
import pandas as pd
import pytest

from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Spiral
from rrru.effects.library import active_effects
from rrru.plant.virtual_tripod import VirtualTripod
from rrru.robots.ptt3 import Ptt3
from tests.workflow.folder import ROOT, SNAKEMAKE, link

_DRIFT = """
import numpy as np
from rrru.effects.effect import Contribution
from rrru.parameters import Parameter, ParameterSet

class Drift:
    name, needs = "drift", ("time_s",)
    parameters = ParameterSet(tuple(Parameter(f"speed_{axis}", "mm/s", 0.0, -1e-3, 1e-3) for axis in "xyz"))
    def contribute(self, motion, values):
        shift = motion.time_s[:, None] * values
        return Contribution(joint_mm=np.repeat(shift[:, None], 3, axis=1))
"""


def _run(folder, overlay, *targets):
    """Exit code and output of snakemake in a folder that sees the project's files through links."""
    link(folder)
    (folder / "mine.yaml").write_text(overlay)
    command = [SNAKEMAKE, "--cores", "2", *targets, "--configfile", "mine.yaml"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=300)
    return done.returncode, done.stdout + done.stderr


def test_an_effect_of_ones_own_takes_part_and_editing_it_reruns_the_diagnosis(tmp_path):
    """A measured campaign that the library cannot explain is explained by ten lines of a user's."""
    (tmp_path / "drift.py").write_text(_DRIFT)
    campaign = "campaigns: {mine: {robot: rrru3, ingest: data/field_05.csv, noise_mm: 0.02}}\n"
    target = "results/campaigns/mine/gap_verdicts.parquet"
    code, output = _run(tmp_path, campaign, target)
    assert code == 0, output
    assert "unexplained" in pd.read_parquet(tmp_path / target)["effects"].iloc[0]
    own = campaign + 'gap: {own_effects: ["drift:Drift"]}\n'
    code, output = _run(tmp_path, own, target)
    assert code == 0, output
    verdict = pd.read_parquet(tmp_path / target).iloc[0]
    assert verdict["effects"] == "drift" and verdict["share_closed"] > 0.95
    (tmp_path / "drift.py").write_text(_DRIFT.replace("-1e-3, 1e-3", "-2e-3, 2e-3"))
    _, output = _run(tmp_path, own, target, "-n")
    assert "rule diagnose" in output


def test_a_file_without_times_and_angles_is_diagnosed_and_says_what_it_could_not_test(tmp_path):
    points = pd.read_csv(ROOT / "data/field_02.csv")
    points.drop(columns=["time_s", "speed_mm_s", "payload_kg", "theta1_rad", "theta2_rad", "theta3_rad"]).to_csv(
        tmp_path / "bare.csv", index=False
    )
    target = "results/campaigns/mine/gap_verdicts.parquet"
    code, output = _run(tmp_path, "campaigns: {mine: {robot: rrru3, ingest: bare.csv}}\n", target)
    assert code == 0, output
    verdict = pd.read_parquet(tmp_path / target).iloc[0]
    assert verdict["effects"] == "backlash" and verdict["noise_from"] in ("repeats", "high_frequency")
    assert "thermal_growth not tested" in verdict["notes"] and "servo_lag not tested" in verdict["notes"]
    assert abs(verdict["noise_rms_mm"] / (0.02 * 3.0**0.5) - 1.0) < 0.1


@pytest.mark.parametrize(
    ("overlay", "told"),
    [
        ("gap: {effects: [backlash, wind]}\n", "unknown effect 'wind'"),
        ('gap: {own_effects: ["nowhere:Law"]}\n', "cannot import 'nowhere'"),
        ("gap: {known: {transmission_error: {teeth: 7}}}\n", "no known 'teeth'"),
        ("gap: {tolerence: 0.2}\n", "tolerence"),
    ],
)
def test_what_the_diagnosis_cannot_know_is_refused_before_anything_runs(tmp_path, overlay, told):
    code, output = _run(tmp_path, overlay, "gap", "-n")
    assert code != 0 and told in output


def test_the_check_on_withheld_effects_runs_from_robots_to_figure(tmp_path):
    answers = "campaign,effects,leg\nfield_09,thermal_growth,0\n"
    (tmp_path / "answers.csv").write_text(answers)
    overlay = "withheld: {robots: 3, per_effect: 1, chunk: 2, effects: [backlash], field: [field_09], field_answers: answers.csv}\n"
    code, output = _run(tmp_path, overlay, "withheld")
    assert code == 0, output
    folder = tmp_path / "results/tables"
    scores = pd.read_parquet(folder / "withheld_scores.parquet").set_index(["check", "robot"])
    assert len(scores.loc["label"]) == 3 and len(scores.loc["effect"]) == 1
    assert scores.loc[("field", "field_09"), "right"]
    assert scores.loc[("effect", "effect_backlash_0000"), "truth"] == "backlash"
    summary = pd.read_parquet(folder / "withheld_summary.parquet")
    assert (
        set(summary["check"]) == {"label", "effect", "field"}
        and (tmp_path / "results/figures/withheld.png").stat().st_size > 10_000
    )


def test_a_file_of_a_3_ptt_goes_the_whole_way(tmp_path):
    """Driven by a virtual robot with play, handed over as a file: calibrated, compensated and diagnosed."""
    robot = VirtualTripod(
        Ptt3(), {"db1": 0.3}, active_effects({"backlash": {f"width{k}": 0.05 for k in (1, 2, 3)}}, "mm")
    )
    curve = Spiral("curve", (0.0, 0.0), (40.0, 80.0), (-270.0, -230.0), 2.0, 80)
    plan = make_plan([curve], [{"payload_kg": 0.0, "reverse": reverse} for reverse in (False, True)], 80.0, 400.0, 5.0)
    measurements, _ = robot.run(plan, 0.005, np.random.default_rng(0))
    measurements.drop(columns="status").to_csv(tmp_path / "sliders.csv", index=False)
    folder = tmp_path / "results/campaigns/mine"
    overlay = (
        "campaigns: {mine: {robot: ptt3, ingest: sliders.csv, noise_mm: 0.005}}\ngenetic: {seeds: 1, generations: 20}\n"
    )
    code, output = _run(
        tmp_path, overlay, *(f"results/campaigns/mine/{name}.parquet" for name in ("gap_verdicts", "error_summary"))
    )
    assert code == 0, output
    assert pd.read_parquet(folder / "gap_verdicts.parquet")["effects"].iloc[0] == "backlash"
    found = pd.read_parquet(folder / "parameters.parquet").query(
        "calibration == 'both' and method == 'least_squares' and parameter == 'db1'"
    )
    assert found["value"].iloc[0] == pytest.approx(0.3, abs=0.05)
    summary = pd.read_parquet(folder / "error_summary.parquet").set_index(
        ["calibration", "method", "mode", "trajectory"]
    )["mean_mm"]
    assert summary["both", "least_squares", "model", "curve"] < 0.3 * summary["none", "none", "before", "curve"]


def test_a_campaign_may_have_dimensions_of_its_own(tmp_path):
    """A linear delta's file: with its own dimensions the commands are reached, with those of the level robot they are
    refused.
    """
    own = {"L_mm": 290.0, "R_mm": 140.0, "r_mm": 33.0}
    robot = VirtualTripod(Ptt3(**own, rail_inclination_rad=np.pi / 2), {"db2": 0.2})
    curve = Spiral("curve", (0.0, 0.0), (40.0, 80.0), (0.0, 30.0), 2.0, 60)
    plan = make_plan([curve], [{"payload_kg": 0.0, "reverse": False}], 80.0, 400.0, 5.0)
    robot.run(plan, 0.01, np.random.default_rng(0))[0].drop(columns="status").to_csv(tmp_path / "tall.csv", index=False)
    target = "results/campaigns/mine/parameters.parquet"
    dimensions = ", ".join(f"{key}: {value}" for key, value in (own | {"rail_inclination_deg": 90}).items())
    code, output = _run(
        tmp_path, f"campaigns: {{mine: {{robot: ptt3, ingest: tall.csv, dimensions: {{{dimensions}}}}}}}\n", target
    )
    assert code == 0, output
    found = (
        pd.read_parquet(tmp_path / target)
        .query("calibration == 'both' and method == 'least_squares'")
        .set_index("parameter")["value"]
    )
    assert found["db2"] - found["db1"] == pytest.approx(0.2, abs=0.03)
    code, output = _run(
        tmp_path, "campaigns: {mine: {robot: ptt3, ingest: tall.csv, dimensions: {L9_mm: 3.0}}}\n", target
    )
    assert code != 0 and "robot ptt3: unknown key 'L9_mm'; known: " in output
