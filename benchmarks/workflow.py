"""The workflow: seconds inside its rules compared with seconds around them.

Four campaigns from their files or plans to their verdicts, on one core, each run in a separate folder. Inside is from
a job's start to its end, Python's start and imports included, as Snakemake records it; around is the rest of the run by
the clock: planning, checks of the configuration, and what Snakemake does between two jobs.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks import harness
from benchmarks.harness import RESULTS, Task

_ROUNDS, _CAMPAIGNS = 2, ("paper", "crooked", "field_01", "field_09")
_LINKED = ("Snakefile", "config.yaml", "profiles", "workflow", "data")


def seconds_of_jobs(folder):
    """Seconds of every job of a folder's last run."""
    spans = {}
    for path in (folder / ".snakemake" / "metadata").rglob("*"):
        if path.is_file():
            record = json.loads(path.read_text())
            # a job has one log, and a record for every output
            spans.setdefault(record["log"][0], []).append((record["starttime"], record["endtime"]))
    return [max(end for _, end in span) - min(start for start, _ in span) for span in spans.values()]


def once():
    """Seconds inside and around the rules of a run, and how many jobs it had."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for linked in _LINKED:
            (folder / linked).symlink_to(RESULTS.parent / linked)
        command = [str(Path(sys.executable).parent / "snakemake"), "--cores", "1", "--quiet", "all", "--"]
        verdicts = [f"results/campaigns/{campaign}/verdict.json" for campaign in _CAMPAIGNS]
        start = perf_counter()
        environment = os.environ | {"PYTHONPATH": str(RESULTS.parent)}
        subprocess.run([*command, *verdicts], cwd=folder, check=True, env=environment)
        whole, jobs = perf_counter() - start, seconds_of_jobs(folder)
    return sum(jobs), whole - sum(jobs), len(jobs)


def rows():
    """Rows of the group."""
    inside, around, jobs = np.array([once() for _ in range(_ROUNDS)]).T
    task = Task("workflow", "a run of the workflow", int(jobs[0]))
    return [
        task.row("inside rules", np.median(inside), [1.0], note="jobs one after the other"),
        task.row("around rules", np.median(around), around / inside, note="ratio: seconds around over inside"),
    ]


if __name__ == "__main__":
    harness.store("workflow", rows())
