"""A full disk and a folder that may not be written to: said with file and cause, earlier results as they were."""

import types

import pandas as pd
import pytest
from matplotlib.figure import Figure

from rrru.errors import WriteError
from rrru.figures import style
from rrru.store import job, json_files, overlay, tables
from rrru.store.atomic_write import write_text
from tests.schemas import TABLES

_ROWS = pd.DataFrame([["a", "x", "p", "q", 0.5]], columns=TABLES["correlations"].names)
# by file's name what writes it
WRITERS = {
    "table.parquet": lambda path: tables.write(TABLES["correlations"], _ROWS, path),
    "facts.json": lambda path: json_files.write({"a": 1.0}, path),
    "overlay.yaml": lambda path: overlay.write({"a": 1.0}, 0.1, path),
    "report.html": lambda path: write_text("<html></html>", path),
    "figure.png": lambda path: style.save(Figure(), {"png": path}),
    "figure.pdf": lambda path: style.save(Figure(), {"pdf": path}),
    "figure.svg": lambda path: style.save(Figure(), {"svg": path}),
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_what_was_there(name, tmp_path):
    """The first write goes to a device that is always full."""
    path = tmp_path / name
    path.write_bytes(b"earlier")
    (tmp_path / f".{path.stem}.partial{path.suffix}").symlink_to("/dev/full")
    with pytest.raises(WriteError) as caught:
        WRITERS[name](path)
    message = str(caught.value)
    assert message.startswith(f"{path}: cannot be written (") and "No space left" in message and "with room" in message
    assert path.read_bytes() == b"earlier" and list(tmp_path.iterdir()) == [path]
    WRITERS[name](path)
    assert path.read_bytes() != b"earlier" and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", WRITERS)
def test_a_place_that_may_not_be_written_to_is_named(name):
    """The kernel makes no folder there for any user; for root the mode of a folder of ours would have no effect."""
    with pytest.raises(
        WriteError, match=rf"^/proc/sys/rrru/{name}: cannot be written \(.*/proc/sys/rrru'\); allowed: "
    ):
        WRITERS[name](f"/proc/sys/rrru/{name}")


def test_a_job_whose_log_cannot_be_written_says_so():
    with pytest.raises(SystemExit, match=r"/proc/sys/rrru/job\.log: cannot be written .*; allowed: results_dir in a"):
        job.run(None, types.SimpleNamespace(log=["/proc/sys/rrru/job.log"]))
