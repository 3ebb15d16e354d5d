"""What is refused is refused before anything runs, and says why."""

import pytest

from tests.workflow.folder import dry_run, run


@pytest.mark.parametrize(
    ("overlay", "message"),
    [
        ("sede: 3", "did you mean seed for sede?"),
        ("genetic: {crossover_probability: 0.8}", "crossover_probability"),
        ("campaigns: {mine: {robot: rrru3, ingest: a.csv, nois_mm: 0.02}}", "did you mean noise_mm for nois_mm?"),
        ("campaigns: {mine: {robot: rrru9, ingest: a.csv}}", "rrru9"),
        (
            "campaigns: {mine: {robot: rrru3, ingest: nothere.csv}}",
            "campaigns.mine.ingest: nothere.csv: there is no such file",
        ),
        (
            "campaigns: {crooked: {passes: [{trajectories: [nosuch]}]}}",
            "campaigns.crooked.passes: no trajectory 'nosuch'",
        ),
        ("campaigns: {crooked: {virtual: nosuch}}", "campaigns.crooked: virtual_robots has no 'nosuch'"),
        ("campaigns: {crooked: {advised_by: paper}}", "campaigns.crooked.advised_by: 'paper'; allowed: another"),
        ("campaigns: {crooked: {advised_by: nosuch}}", "campaigns.crooked.advised_by: campaigns has no 'nosuch'"),
        ("circle: {diagnosed: paper, fresh: nosuch}", "circle.fresh: campaigns has no 'nosuch'"),
        ("virtual_robots: {twin: {mujoco: {}}}", "virtual robot: mujoco drives rrru3, which has no mjcf"),
        ("virtual_robots: {twin: {mujoco: {cause: {}}}}", "'cause' was unexpected"),
        ("campaigns: {paper: {unit: inch}}", "unit"),
        ("sweep: {values: [0.1, 0.2]}", "sweep.values.1: 0.2 is not of type 'string'"),
        ('sweep: {values: ["0.5", "0.50"]}', "sweep.values holds a number twice"),
        ("sweep: {populations: {islands: [30]}}", "sweep.populations.islands is [30]"),
        ("reproduce: {campaign: nosuch}", "reproduce.campaign is 'nosuch'"),
        ("reproduce: {line_calibration: nosuch}", "reproduce.line_calibration is 'nosuch'"),
        ("genetic: {generations: 0}", "0 is less than the minimum of 1"),
        ("gap: {effects: [backlash, wind]}", "unknown effect 'wind'"),
        ('gap: {own_effects: ["nowhere:Law"]}', "cannot import 'nowhere'"),
        ('gap: {own_effects: ["os.system(1):x"]}', "gap.own_effects.0: 'os.system(1):x' does not match"),
        ("gap: {known: {transmission_error: {teeth: 7}}}", "no known 'teeth'"),
        ("gap: {tolerence: 0.2}", "tolerence"),
        ("withheld: {effects: [wind]}", "withheld.effects has 'wind'"),
        ("printers: {files: [nothere.json]}", "printers.files: there is no file nothere.json"),
        ("delta: {lens_mm: 12.0}", "lens_mm"),
        ("delta: {tilted_views: {count: 2}}", "2 is less than the minimum of 3"),
        ("delta: {plane: {radius_mm: 2000.0}}", "delta.plane: a point is out of the robot's reach"),
        ("ptt: {network: {train: 180}}", "ptt.network.train is 180"),
        (
            "campaigns:\n  mine: {robot: rrru3, ingest: a.csv}\n  mine: {robot: delta, ingest: b.csv}",
            "wrong.yaml, line 3: campaigns.mine occurs twice",
        ),
        ("ptt: {joint: {all: [ptt_9, ptt_1]}}", "ptt.joint.all: no experiment 'ptt_9'"),
    ],
)
def test_a_wrong_configuration_fails_before_anything_runs(tmp_path, overlay, message):
    (tmp_path / "wrong.yaml").write_text(f"{overlay}\nresults_dir: build\n")
    code, output = dry_run(tmp_path, overlays=("wrong.yaml",))
    assert code != 0 and message in output
    assert not (tmp_path / "build").exists()


def test_the_page_of_an_unknown_campaign_names_those_there_are(tmp_path):
    code, output = dry_run(tmp_path, "results/campaigns/feild_09/report.html")
    assert code != 0 and "there is no campaign 'feild_09'" in output and "field_09" in output


def test_a_command_that_is_refused_ends_so_and_leaves_nothing(tmp_path):
    (tmp_path / "wrong.yaml").write_text("gap: {effects: [wind]}\nresults_dir: build\n")
    code, output = run(tmp_path, overlays=("wrong.yaml",))
    assert code != 0 and "unknown effect 'wind'" in output and not (tmp_path / "build").exists()


@pytest.mark.parametrize(
    "value",
    [
        "!!python/object/apply:os.mkdir [ran]",
        "!!python/object/new:os.mkdir [ran]",
        "!!python/name:os.mkdir",
        "!!python/module:this",
        '\'__import__("os").mkdir("ran")\'',
        '{\'?__import__("os").mkdir("ran")\': 1}',
        "?__import__('os').mkdir('ran')",
    ],
)
def test_a_configuration_runs_no_code(tmp_path, value):
    """But that of modules which own_effects, effects and module name, and where its top says __use_yte__: see docs."""
    (tmp_path / "code.yaml").write_text(f"seed: {value}\nresults_dir: build\n")
    code, _ = dry_run(tmp_path, overlays=("code.yaml",))
    assert code != 0 and not (tmp_path / "ran").exists()
