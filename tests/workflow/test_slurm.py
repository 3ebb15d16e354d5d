"""The profile for Slurm: what it asks for, and by `make test-slurm` a study that runs through a Slurm of one node."""

import os
import re
import subprocess
import time

import pytest
import yaml

from tests.places import ROOT
from tests.workflow.folder import MINIMAL, SNAKEMAKE, digests, dry_run, link, run
from tests.workflow.slurm import cluster, left_over, missing, said

_PROFILE = ("--profile", "profiles/slurm")
# three chunks and what counts them
_TABLE = "build/minimal/tables/withheld_summary.parquet"
_PATIENCE_S = 900.0


def test_every_job_says_what_it_takes(tmp_path):
    code, output = dry_run(tmp_path, *_PROFILE, "all", "withheld", "real", overlays=(MINIMAL,))
    assert code == 0, output
    rules = re.findall(r"^ *(?:local)?rule (\w+):$", output, re.MULTILINE)
    resources = re.findall(r"^ *resources: (.*)$", output, re.MULTILINE)
    assert len(rules) == len(resources) and {"diagnose", "withheld_score", "study_series"} <= set(rules)
    for rule, taken in zip(rules, resources, strict=True):
        assert re.search(r"\bmem_mb=\d+", taken) and re.search(r"\bruntime=\d+", taken), (rule, taken)


def test_the_profile_names_rules_that_are_there(tmp_path):
    profile = yaml.safe_load((ROOT / "profiles/slurm/config.yaml").read_text())
    code, output = dry_run(tmp_path, "--list-rules")
    assert code == 0, output
    named = {*profile["groups"], *profile["set-resources"]}
    assert named and named <= set(output.split())
    assert set(profile["group-components"]) <= set(profile["groups"].values())
    # of a job array another task's outputs are deleted
    assert not any("array" in key for key in profile)


@pytest.mark.skipif("RRRU_SLURM" not in os.environ, reason="run by `make test-slurm`")
@pytest.mark.skipif(
    bool(missing()),
    reason=f"not installed: {', '.join(missing())}; of Debian: apt-get install --no-install-recommends slurm-wlm munge",
)
def test_a_study_through_slurm_ends_with_the_same_bytes_though_a_job_is_killed(tmp_path):
    code, output = run(tmp_path / "here", _TABLE)
    assert code == 0, output
    folder = tmp_path / "there"
    with cluster(tmp_path / "slurm") as environment:
        process = _submitted(folder, environment)
        try:
            # its second job is under way, the first has left files
            _until(lambda: (folder / "build/minimal/logs/withheld_diagnose").exists(), process)
            job = said(environment, "squeue", "--noheader", "--states=running", "--format", "%i").split()[0]
            said(environment, "scancel", "--signal=KILL", "--full", job)
            _until(lambda: process.poll() is not None, process)
        finally:
            process.kill()
            process.wait()
        states = said(environment, "squeue", "--noheader", "--states=all", "--format", "%i %T").splitlines()
    assert not left_over(tmp_path)
    log = (folder / "log").read_text()
    assert process.returncode == 0, log
    ended = dict(line.split() for line in states)
    assert ended.pop(job) != "COMPLETED" and set(ended.values()) == {"COMPLETED"}
    assert "Trying to restart job" in log
    assert digests(folder / "build/minimal") == digests(tmp_path / "here/build/minimal")


def _submitted(folder, environment):
    """A running snakemake whose jobs go to a cluster that keeps no accounts."""
    link(folder)
    options = ("--slurm-status-command", "squeue", "--slurm-init-seconds-before-status-checks", "2")
    command = [SNAKEMAKE, *_PROFILE, *options, _TABLE, "--configfile", MINIMAL]
    environment = environment | {"PYTHONPATH": str(ROOT)}
    with (folder / "log").open("w") as log:
        return subprocess.Popen(command, cwd=folder, env=environment, stdout=log, stderr=subprocess.STDOUT)


def _until(true, process):
    """Wait for something while a process runs, and for no longer."""
    end = time.monotonic() + _PATIENCE_S
    while not true() and process.poll() is None:
        assert time.monotonic() < end, "nothing came of it"
        time.sleep(0.2)
