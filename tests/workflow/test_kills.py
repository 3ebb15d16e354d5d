"""kill -9 at moments that a seed draws, restarted: the same bytes. RRRU_KILLS is how often, 0 by default."""

import contextlib
import os
import signal
import time

import numpy as np
import pytest

from tests.workflow.folder import digests, run, start

COUNT = int(os.environ.get("RRRU_KILLS", "0"))
# of one campaign: read, calibrated, compensated, diagnosed and drawn
_TARGETS = tuple(f"build/minimal/campaigns/field_09/{name}.parquet" for name in ("gap_verdicts", "error_summary"))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Digests of an undisturbed run."""
    folder = tmp_path_factory.mktemp("whole")
    code, output = run(folder, *_TARGETS)
    assert code == 0, output
    return digests(folder / "build/minimal")


@pytest.mark.parametrize("number", range(COUNT))
def test_a_run_killed_at_any_moment_goes_on_to_the_same_bytes(made, tmp_path, number):
    """Killed when so many of its files are there, and up to two seconds later."""
    generator, results = np.random.default_rng(number), tmp_path / "build/minimal"
    wanted, later_s = generator.integers(len(made)), generator.uniform(0.0, 2.0)
    process = start(tmp_path, *_TARGETS)
    # counted, not read: a file that is being written may go while it is looked at
    while process.poll() is None and sum(1 for _ in results.rglob("*.*")) < wanted:
        time.sleep(0.05)
    time.sleep(later_s)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    print(f"killed where {len(digests(results))} of {len(made)} files were there")
    code, output = run(tmp_path, "--unlock")
    assert code == 0, output
    code, output = run(tmp_path, *_TARGETS)
    assert code == 0, output
    assert digests(results) == made
