"""The diagnosis as a user runs it: with an effect of one's own, on a file that lacks columns, and refused."""

import numpy as np
import pandas as pd
import pytest

from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Spiral
from rrru.effects.library import active_effects
from rrru.robots.ptt3 import Ptt3
from rrru.simulation.virtual_robot import VirtualRobot
from tests.places import DATA
from tests.workflow.folder import dry_run, run_here

_DRIFT = """
import numpy as np
from rrru.parameters import Parameter, ParameterSet

class Drift:
    name, needs = "drift", ("time_s",)
    parameters = ParameterSet(tuple(Parameter(f"speed_{axis}", "mm/s", 0.0, -1e-3, 1e-3) for axis in "xyz"))
    def contribute(self, motion, values):
        shift = motion.time_s[:, None] * values
        return motion.at({"world": np.concatenate([shift, 0.0 * shift], axis=1)})
"""


def _run(folder, overlay, *targets):
    """Exit code and output of snakemake with an overlay in a folder of its own."""
    (folder / "mine.yaml").write_text(overlay)
    return run_here(folder, *targets, overlays=("mine.yaml",))


def test_an_effect_of_ones_own_takes_part_and_editing_it_reruns_the_diagnosis(tmp_path):
    """A measured campaign that the library cannot explain is explained by ten lines of a user's."""
    (tmp_path / "drift.py").write_text(_DRIFT)
    campaign = "campaigns: {mine: {robot: rrru3, ingest: data/field_05.csv, noise_mm: 0.02}}\n"
    few = "effects: [backlash, drive_compliance, thermal_growth]"
    target = "results/campaigns/mine/gap_verdicts.parquet"
    code, output = _run(tmp_path, campaign + f"gap: {{{few}}}\n", target)
    assert code == 0, output
    assert "unexplained" in pd.read_parquet(tmp_path / target)["effects"].iloc[0]
    own = campaign + f'gap: {{{few}, own_effects: ["drift:Drift"]}}\n'
    code, output = _run(tmp_path, own, target)
    assert code == 0, output
    verdict = pd.read_parquet(tmp_path / target).iloc[0]
    assert verdict["effects"] == "drift" and verdict["share_closed"] > 0.95
    (tmp_path / "drift.py").write_text(_DRIFT.replace("-1e-3, 1e-3", "-2e-3, 2e-3"))
    _, output = dry_run(tmp_path, target, overlays=("mine.yaml",))
    assert "rule diagnose" in output


_TALL = {"L_mm": 290.0, "R_mm": 140.0, "r_mm": 33.0}
_DIMENSIONS = ", ".join(f"{key}: {value}" for key, value in _TALL.items())
_CAMPAIGNS = f"""
campaigns:
  bare: {{robot: rrru3, ingest: bare.csv}}
  sliders: {{robot: ptt3, ingest: sliders.csv, noise_mm: 0.005}}
  tall: {{robot: ptt3, ingest: tall.csv, dimensions: {{{_DIMENSIONS}, rail_inclination_deg: 90}}}}
genetic: {{seeds: 1, generations: 20}}
"""
_TARGETS = ("bare/gap_verdicts", "sliders/gap_verdicts", "sliders/error_summary", "tall/parameters")


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Folder of the campaigns' parts of three files: without times and angles, of a 3-PTT, of a linear delta."""
    folder = tmp_path_factory.mktemp("measured")
    points = pd.read_csv(DATA / "field_02.csv")
    lacking = ["time_s", "speed_mm_s", "payload_kg", "theta1_rad", "theta2_rad", "theta3_rad"]
    points.drop(columns=lacking).to_csv(folder / "bare.csv", index=False)
    play = active_effects({"backlash": {f"width{k}": 0.05 for k in (1, 2, 3)}}, Ptt3())
    robots = {
        "sliders": (VirtualRobot(Ptt3(), {"db1": 0.3}, effects=play), (-270.0, -230.0), 80, (False, True), 0.005),
        "tall": (
            VirtualRobot(Ptt3(**_TALL, rail_inclination_rad=np.pi / 2), {"db2": 0.2}),
            (0.0, 30.0),
            60,
            (False,),
            0.01,
        ),
    }
    for name, (robot, heights, count, directions, noise_mm) in robots.items():
        curve = Spiral("curve", (0.0, 0.0), (40.0, 80.0), heights, 2.0, count)
        plan = make_plan([curve], [{"payload_kg": 0.0, "reverse": way} for way in directions], 80.0, 400.0, 5.0)
        measurements, _ = robot.run(plan, noise_mm, np.random.default_rng(0))
        measurements.drop(columns="status").to_csv(folder / f"{name}.csv", index=False)
    code, output = _run(folder, _CAMPAIGNS, *(f"results/campaigns/{target}.parquet" for target in _TARGETS))
    assert code == 0, output
    return folder / "results/campaigns"


def test_a_file_without_times_and_angles_is_diagnosed_and_says_what_it_could_not_test(measured):
    verdict = pd.read_parquet(measured / "bare/gap_verdicts.parquet").iloc[0]
    assert verdict["effects"] == "backlash" and verdict["noise_from"] in ("repeats", "fitted")
    assert "thermal_growth not tested" in verdict["notes"] and "servo_lag not tested" in verdict["notes"]
    assert abs(verdict["noise_rms_mm"] / (0.02 * 3.0**0.5) - 1.0) < 0.1


def _fitted(folder):
    """Parameters by least squares on all points, by name."""
    parameters = pd.read_parquet(folder / "parameters.parquet")
    return parameters.query("calibration == 'all' and method == 'least_squares'").set_index("parameter")["value"]


def test_a_file_of_a_3_ptt_goes_the_whole_way(measured):
    """Driven by a virtual robot with play, handed over as a file: calibrated, compensated and diagnosed."""
    folder = measured / "sliders"
    assert pd.read_parquet(folder / "gap_verdicts.parquet")["effects"].iloc[0] == "backlash"
    assert _fitted(folder)["db1"] == pytest.approx(0.3, abs=0.05)
    keys = ["calibration", "method", "mode", "trajectory"]
    summary = pd.read_parquet(folder / "error_summary.parquet").set_index(keys)["mean_mm"]
    assert summary["all", "least_squares", "model", "curve"] < 0.3 * summary["none", "none", "before", "curve"]


def test_a_campaign_may_have_dimensions_of_its_own(measured):
    """A linear delta's file: its commands are reached with its own dimensions only."""
    fitted = _fitted(measured / "tall")
    assert fitted["db2"] - fitted["db1"] == pytest.approx(0.2, abs=0.03)


def test_dimensions_that_a_robot_does_not_have_are_refused(measured, tmp_path):
    (tmp_path / "tall.csv").write_text((measured.parents[1] / "tall.csv").read_text())
    overlay = "campaigns: {mine: {robot: ptt3, ingest: tall.csv, dimensions: {L9_mm: 3.0}}}\n"
    code, output = _run(tmp_path, overlay, "results/campaigns/mine/measurements.parquet")
    assert code != 0 and "robot ptt3: unknown key 'L9_mm'; known: " in output


def test_the_check_on_withheld_effects_runs_from_robots_to_figure(results):
    scores = pd.read_parquet(results / "tables/withheld_scores.parquet").set_index(["check", "robot"])
    assert len(scores.loc["label"]) == 4 and len(scores.loc["effect"]) == 1
    assert scores.loc[("field", "field_09"), "right"]
    assert scores.loc[("effect", "effect_backlash_0000"), "truth"] == "backlash"
    assert len(scores.loc["many"]) == len(scores.loc["background"]) == len(scores.loc["own"]) == 1
    summary = pd.read_parquet(results / "tables/withheld_summary.parquet")
    assert set(summary["check"]) == {"label", "effect", "many", "background", "own", "field"}
    parts = pd.read_parquet(results / "tables/withheld_parts.parquet")
    assert set(parts["robot"]) == set(scores.query("check != 'field'").index.get_level_values("robot"))
    methods = pd.read_parquet(results / "timings/withheld_methods.parquet").set_index("method")
    assert list(methods.index) == ["diagnosis", "bic", "lasso", "spike_and_slab", "gaussian_process"]
    assert (methods["robots"] == 1).all()
    assert (results / "figures/withheld.png").stat().st_size > 10_000
