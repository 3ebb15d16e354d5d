"""What is refused is refused before anything runs, and says why."""

import pytest

from tests.refusals import refusals
from tests.workflow.folder import dry_run, run


@refusals("overlay", "message")
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
