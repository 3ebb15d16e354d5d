"""No rule of the diagnosis is given an answer, and no code of it knows where answers are made."""

import ast
import re
from pathlib import Path

import pytest

from tests.places import ROOT
from tests.workflow.folder import MINIMAL, dry_run


@pytest.fixture(scope="module")
def jobs(tmp_path_factory):
    """(rule, inputs, outputs) of every job of the check, as snakemake plans them."""
    folder = tmp_path_factory.mktemp("planned")
    code, output = dry_run(folder, "--forceall", "withheld", "gap", overlays=(MINIMAL,))
    assert code == 0, output
    result = []
    for block in re.split(r"^(?=(?:local)?rule \w+:$)", output, flags=re.MULTILINE):
        rule = re.search(r"^(?:local)?rule (\w+):$", block, re.MULTILINE)
        if rule:
            lists = {key: re.search(rf"^    {key}: (.*)$", block, re.MULTILINE) for key in ("input", "output")}
            result.append((rule[1], *(set(found[1].split(", ")) if found else set() for found in lists.values())))
    return result


def test_the_plan_holds_the_check(jobs):
    rules = [rule for rule, _, _ in jobs]
    chunks = rules.count("withheld_diagnose")
    assert chunks >= 3 and rules.count("withheld_answers") == rules.count("withheld_score") == chunks
    assert rules.count("withheld_summary") == 1


def test_no_diagnosis_is_given_an_answer(jobs):
    answers = {path for rule, _, outputs in jobs for path in outputs if rule == "withheld_answers"}
    assert len(answers) >= 3
    readers = {rule for rule, inputs, _ in jobs if inputs & answers}
    assert readers == {"withheld_measure", "withheld_score"}
    for rule, inputs, outputs in jobs:
        if rule == "withheld_diagnose":
            assert {Path(path).parent.name for path in inputs} == {"measurements"}
            assert {Path(path).parent.name for path in outputs} == {"verdicts", "states"}
        if rule == "diagnose":
            assert {Path(path).name for path in inputs} == {"measurements.parquet"}
    # what is measured reaches the diagnosis, and nothing that was scored does
    scored = {path for rule, _, outputs in jobs for path in outputs if rule in ("withheld_score", "withheld_summary")}
    assert {rule for rule, inputs, _ in jobs if inputs & scored} <= {"withheld_summary", "withheld", "figure"}
    assert {"diagnose", "withheld_diagnose"} <= {rule for rule, _, _ in jobs}


def test_the_measurements_hold_no_answer():
    from tests.schemas import TABLES

    given = {column.name for column in TABLES["withheld_measurements"].columns}
    assert given - {column.name for column in TABLES["measurements"].columns} == {"robot", "kind"}


def _imports(path):
    """Modules of rrru that a file imports, names that may be modules included."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _reached(path, seen):
    """Every file of the package that a file imports, by itself or through others."""
    for name in _imports(path):
        parts = name.split(".")
        file = ROOT.joinpath(*parts).with_suffix(".py")
        if parts[0] == "rrru" and file.is_file() and file not in seen:
            seen.add(file)
            _reached(file, seen)
    return seen


@pytest.mark.parametrize("script", ["withheld_diagnose", "diagnose"])
def test_no_code_of_the_diagnosis_knows_how_robots_are_drawn(script):
    reached = _reached(ROOT / f"workflow/scripts/{script}.py", set())
    assert {"diagnose", "case"} <= {file.stem for file in reached if file.parent.name == "gap"}
    # of the room that draws the robots only how a corrected sim is written down
    assert {file.stem for file in reached if file.parent.name == "withheld"} <= {"states"}
    # and the walk would see them
    seen = {
        file.stem
        for file in _reached(ROOT / "workflow/scripts/withheld_score.py", set())
        if file.parent.name == "withheld"
    }
    assert seen >= {"draw", "robots", "outside"}
