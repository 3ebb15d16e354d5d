"""What a rule depends on is what its script reads and imports: neither less, so that nothing goes stale, nor more."""

import importlib
import json
import re
import shutil
import subprocess

import pytest

from rrru.store import digest
from tests.places import ROOT
from tests.workflow.folder import MINIMAL, SNAKEMAKE, dry_run


@pytest.fixture(scope="module")
def records(shared):
    return recorded(shared / "record")


def recorded(folder):
    """Records of a run's jobs by rule."""
    result = {}
    for file in sorted(folder.glob("*.json")):
        row = json.loads(file.read_text())
        result.setdefault(row["rule"], []).append(row)
    return result


def test_every_module_that_a_job_has_loaded_is_in_its_digest(records):
    assert len(records) >= 25
    for rule, jobs in records.items():
        covered_by_its_digest(rule, jobs)


def covered_by_its_digest(rule, jobs):
    """Whether the digest of a rule covers all that its recorded jobs have loaded."""
    for row in jobs:
        covered = {str(file) for file in digest.closure(f"workflow/scripts/{row['script']}")}
        loaded = {importlib.import_module(name).__file__ for name in row["modules"]}
        # a script that draws loads the functions that its settings name
        drawn = {str(file) for name in row["modules"] if "figures" in name for file in digest.closure(name)}
        assert loaded <= covered | drawn | _papers(rule), (rule, loaded - covered - drawn)


def _papers(rule):
    """Files of the papers' modules, which the settings of `published` name."""
    if rule != "published":
        return set()
    modules = [f"rrru.studies.{s}.{m}" for s in ("rrru3", "ptt3", "delta") for m in ("published", "audit")]
    return {str(file) for file in digest.closure(*modules)}


def test_a_rule_is_handed_what_its_jobs_read_and_nothing_else(records):
    for rule, jobs in records.items():
        # the digest of a robot's file is handed for its change alone
        handed = {tuple(path) for row in jobs for path in row["handed"] if path[-1] != "digest"}
        read = {tuple(path) for row in jobs for path in row["read"]}
        assert handed <= read, (rule, sorted(handed - read, key=str))


def test_linear_algebra_has_one_thread_in_every_job(records):
    """Also where the rule has two (`published`) and the user's environment eight: more change the last digits."""
    for rule, jobs in records.items():
        pools = {tuple(pool) for row in jobs for pool in row["threads"]}
        assert ("openblas", 1) in pools and {count for _, count in pools} == {1}, (rule, pools)


def test_a_digest_follows_imports_wherever_they_stand(tmp_path, monkeypatch):
    files = {
        "rrru/__init__.py": "",
        "rrru/a.py": "from rrru import b\n",
        "rrru/b.py": "def f():\n    from rrru.inner import (\n        c as d,\n    )\n",
        "rrru/inner/__init__.py": "import rrru.e\n",
        "rrru/inner/c.py": "import numpy\n",
        "rrru/e.py": "",
        "rrru/other.py": "",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True, parents=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(digest, "ROOT", tmp_path)
    for function in (digest._imported, digest._file, digest.code_digest):
        function.cache_clear()
    try:
        found = {str(file.relative_to(tmp_path)) for file in digest.closure("rrru.a")}
        assert found == set(files) - {"rrru/other.py"}
        before = digest.code_digest("rrru.a")
        for name in files:
            digest.code_digest.cache_clear()
            (tmp_path / name).write_text(files[name] + "# touched\n")
            assert (digest.code_digest("rrru.a") != before) == (name in found), name
            (tmp_path / name).write_text(files[name])
    finally:
        for function in (digest._imported, digest._file, digest.code_digest):
            function.cache_clear()


@pytest.mark.parametrize(
    ("overlay", "rules"),
    [
        ("printers: {level: 0.04}", {"calibrate_printers", "printer_figures"}),
        ("methods: {test_points: 11}", {"compare_methods", "gather_methods", "method_figures"}),
        ("reproduce: {redraws: 4}", {"redraws", "published", "paper_a_figures"}),
        (
            "gap: {draws: 150}",
            {
                *("diagnose", "gather_gap"),
                *("withheld_diagnose", "withheld_score", "withheld_beliefs", "withheld_methods"),
                *("withheld_advice", "withheld_statements", "withheld_sentences"),
            },
        ),
    ],
)
def test_a_changed_number_reruns_the_rules_that_read_it(shared, overlay, rules):
    (shared / "changed.yaml").write_text(overlay + "\n")
    code, output = dry_run(shared, "all", "withheld", overlays=(MINIMAL, "field.yaml", "changed.yaml"))
    assert code == 0, output
    # rules downstream are listed as well
    rerun = set(re.findall(r"^rule (\w+):", output, re.MULTILINE)) - {"all", "withheld", "withheld_summary"}
    assert rerun - {"withheld_figures"} == rules


def test_a_study_goes_with_its_folder_its_rules_and_its_section(tmp_path):
    for name in ("Snakefile", "config.yaml"):
        shutil.copy(ROOT / name, tmp_path / name)
    for name in ("rrru", "workflow", "profiles", "data"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.rmtree(tmp_path / "rrru/studies/printers")
    (tmp_path / "workflow/rules/studies/printers.smk").unlink()
    text = (tmp_path / "config.yaml").read_text()
    section = re.compile(r"^printers:\n(?:[ ].*\n)+", re.MULTILINE)
    assert len(section.findall(text)) == 1
    (tmp_path / "config.yaml").write_text(section.sub("", text))
    done = subprocess.run(
        [SNAKEMAKE, "-n", "--cores", "1"],
        cwd=tmp_path,
        env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "rule diagnose:" in done.stdout + done.stderr and "printer" not in done.stdout
