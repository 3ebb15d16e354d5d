"""The code checks: ruff, snakefmt, and snakemake's own, which may only ask for conda environments (README says why
there are none).
"""

import re
import subprocess
import sys
from pathlib import Path

from tests.places import ROOT

_ROOT = ROOT
_BIN = Path(sys.executable).parent


def _run(*command):
    return subprocess.run(
        [str(_BIN / command[0]), *command[1:]], cwd=_ROOT, capture_output=True, text=True, check=False
    )


def test_ruff_has_nothing_to_say():
    for command in (("ruff", "check", "."), ("ruff", "format", "--check", ".")):
        result = _run(*command)
        assert result.returncode == 0, result.stdout


def test_snakefiles_are_formatted():
    result = _run("snakefmt", "--check", "Snakefile", "workflow/rules")
    assert result.returncode == 0, result.stderr


def test_snakemake_lint_asks_for_environments_only():
    result = _run("snakemake", "--lint")
    complaints = set(re.findall(r"^    \* (.*?):", result.stdout + result.stderr, re.MULTILINE))
    assert complaints == {"Specify a conda environment or container for each rule."}
