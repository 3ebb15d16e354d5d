"""No rule of the diagnosis is given an answer, and no code of it knows where answers are made."""

import re
from pathlib import Path

import pytest

from rrru.store.digest import closure
from tests.schemas import TABLES
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


def _of(jobs, table):
    """Files of all jobs that hold a part of one table."""
    return {path for _, _, outputs in jobs for path in outputs if Path(path).stem == f"withheld_{table}"}


def test_the_plan_holds_the_check(jobs):
    rules = [rule for rule, _, _ in jobs]
    chunks = rules.count("withheld_diagnose")
    assert chunks == 2 and rules.count("withheld_robots") == rules.count("withheld_score") == chunks
    assert rules.count("withheld_summary") == 1


def test_no_diagnosis_is_given_an_answer(jobs):
    answers = _of(jobs, "answers")
    assert len(answers) == 2
    assert {rule for rule, _, outputs in jobs if outputs & answers} == {"withheld_robots"}
    # the advised run is driven by the robot itself
    with_truth = {"withheld_score", "withheld_methods", "withheld_advice"}
    assert {rule for rule, inputs, _ in jobs if inputs & answers} == with_truth
    for rule, inputs, outputs in jobs:
        if rule == "withheld_beliefs":
            assert {Path(path).stem for path in inputs} == {"withheld_measurements"}
        if rule == "withheld_diagnose":
            assert {Path(path).stem for path in inputs} == {"withheld_measurements"}
            assert {Path(path).stem for path in outputs} == {
                "withheld_verdicts",
                "withheld_stated",
                "withheld_states",
                "withheld_budget",
            }
        if rule == "diagnose":
            assert {Path(path).name for path in inputs} == {"measurements.parquet"}
    # what is measured reaches the diagnosis, and nothing that was scored does
    scored = {path for rule, _, outputs in jobs for path in outputs if rule in ("withheld_score", "withheld_summary")}
    readers = {rule for rule, inputs, _ in jobs if inputs & scored}
    assert readers == {"withheld_summary", "withheld", "withheld_figures"}
    assert {"diagnose", "withheld_diagnose"} <= {rule for rule, _, _ in jobs}


def test_the_measurements_hold_no_answer():
    given = {column.name for column in TABLES["withheld_measurements"].columns}
    assert given - {column.name for column in TABLES["measurements"].columns} == {"robot", "kind"}


def _modules(script):
    """(package, module) of every file of the package that a script reaches."""
    return {(file.parent.name, file.stem) for file in closure(f"workflow/scripts/{script}.py")}


@pytest.mark.parametrize("script", ["withheld_diagnose", "withheld_beliefs", "diagnose"])
def test_no_code_of_the_diagnosis_knows_how_robots_are_drawn(script):
    modules = _modules(script)
    assert {("diagnosis", "diagnose"), ("diagnosis", "problem")} <= modules
    # of the study that draws the robots only how verdicts and corrected sims are written down, and other ways to them
    own = {
        "__init__",
        "schemas",
        "stated",
        *(("rivals", "verdicts") if "beliefs" in script else ()),
    }
    assert {name for package, name in modules if package == "blind_validation"} <= own
    # and the walk would see them
    assert {("blind_validation", name) for name in ("draw", "robots", "causes")} <= _modules("withheld_score")
