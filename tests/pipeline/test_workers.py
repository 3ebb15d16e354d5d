"""Processes of the command: the bytes of one process, its messages, and none that is left."""

import os
import signal
import subprocess
import sys
import time
from multiprocessing import active_children

import pytest

from rrru import api, cli
from rrru.errors import FitError
from rrru.pipeline.workers import usable_cores, workers
from tests.places import ROOT

_ARGUMENTS = ("--robot", "rrru3", "--noise", "0.02", "--effects", "backlash")


@pytest.fixture(autouse=True)
def _in_the_project(monkeypatch):
    monkeypatch.chdir(ROOT)


def _command(folder, cores, file="data/field_12.csv"):
    """Arguments of a diagnosis with few effects."""
    return ["diagnose", file, *_ARGUMENTS, "--out", str(folder), "--cores", str(cores)]


def _files(folder):
    """Bytes of the files in a folder by path; the times that a run took differ."""
    paths = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    return {str(path): (folder / path).read_bytes() for path in paths if path.parts[0] != "timings"}


def _fails(message):
    raise FitError(message)


def _waits(seconds):
    time.sleep(seconds)


def test_two_cores_write_the_bytes_of_one(tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    assert cli.main(_command(one, 1)) == cli.DONE
    # of an earlier run with other kinds of files
    earlier = two / "figures/field_12/workspace.pdf"
    earlier.parent.mkdir(parents=True)
    earlier.write_text("earlier")
    # Matplotlib is for the workers alone
    code = "import sys; from rrru.cli import main; code = main(); print('matplotlib' in sys.modules); sys.exit(code)"
    ended = subprocess.run([sys.executable, "-c", code, *_command(two, 2)], capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (cli.DONE, "") and ended.stdout.endswith("\nFalse\n")
    made = _files(two)
    assert len(made) > 30 and made == _files(one)


def test_what_an_earlier_run_wrote_stays_where_the_diagnosis_fails(tmp_path, monkeypatch, capsys):
    def fails(*_, **__):
        raise FitError("no answer")

    def earlier(kind):
        return tmp_path / f"campaigns/field_12/{kind}"

    earlier("").mkdir(parents=True)
    earlier("errors.parquet").write_text("earlier")
    monkeypatch.setattr(api, "diagnose", fails)
    assert cli.main(_command(tmp_path, 2)) == cli.REFUSED
    assert capsys.readouterr().err == "error: no answer\n"
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["errors.parquet"]
    assert earlier("errors.parquet").read_text() == "earlier"


def test_an_error_of_a_worker_is_that_of_the_command():
    with pytest.raises(FitError, match=r"^singular$"), workers(2) as working:
        list(working.call(_fails, ["singular"]))
    assert not active_children()


def test_nobody_waits_for_workers_after_a_failure():
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt), workers(2) as working:
        working.call(_waits, [300.0])
        raise KeyboardInterrupt
    assert time.monotonic() - began < 60.0 and not active_children()


def test_one_core_has_no_workers():
    with workers(1) as working:
        assert working is None
    assert usable_cores() >= 1


@pytest.mark.skipif(os.name != "posix", reason="signals and ps are those of POSIX")
def test_ctrl_c_leaves_no_process(tmp_path):
    code = "import sys, time; from rrru import api, cli\n"
    # a diagnosis without an end, while a worker calibrates
    code += "api.diagnose = lambda *_, **__: (print('diagnosed', flush=True), time.sleep(300.0))\n"
    command = [sys.executable, "-c", code + "sys.exit(cli.main())", *_command(tmp_path / "out", 2)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    started = subprocess.Popen(command, **pipes, text=True, start_new_session=True)
    assert started.stdout.readline() == "diagnosed\n"
    os.killpg(started.pid, signal.SIGINT)
    _, message = started.communicate(timeout=60.0)
    assert (started.returncode, message) == (cli.INTERRUPTED, "interrupted\n")
    running = subprocess.run(["ps", "-o", "stat=", "-s", str(started.pid)], capture_output=True, text=True).stdout
    assert not [state for state in running.split() if not state.startswith("Z")]


def test_other_kinds_of_figures_come_from_workers(tmp_path):
    assert cli.main([*_command(tmp_path, 2), "--figures", "png"]) == cli.DONE
    drawn = {path.suffix[1:] for path in (tmp_path / "figures/field_12").iterdir()}
    assert drawn == {"svg", "png"}
