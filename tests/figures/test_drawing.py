"""Drawing in processes of its own: the same files, the same errors, and none on a single core."""

import os
import subprocess
import sys

import pytest

from rrru.errors import ConfigError
from rrru.figures import processes
from rrru.figures.drawing import draw_all, requests
from rrru.pipeline.jobs.outputs import CAMPAIGN_FIGURES
from rrru.store import tables
from tests.figures import synthetic_tables as synthetic
from tests.schemas import TABLES


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    """Paths of the tables of two figures by name."""
    folder, frames = tmp_path_factory.mktemp("tables"), synthetic.all_tables()
    needed = {name: frames[name] for figure in ("cross", "observability") for name in CAMPAIGN_FIGURES[figure][1]}
    paths = {name: str(folder / f"{name}.parquet") for name in needed}
    tables.write_all(TABLES.values(), needed, paths)
    return paths


def asked(folder, paths, *names, options=None):
    figures = {name: CAMPAIGN_FIGURES[name] for name in names}
    outputs = {f"{name}_{kind}": str(folder / f"{name}.{kind}") for name in names for kind in ("pdf", "png", "svg")}
    return requests(figures, paths, {**synthetic.OPTIONS, **(options or {})}, outputs, ("svg",))


def test_processes_write_the_same_bytes(paths, tmp_path, monkeypatch):
    monkeypatch.setattr(processes, "_cores", lambda: 2)
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir(), there.mkdir()
    (there / "cross.pdf").write_text("of an earlier run")
    draw_all(asked(here, paths, "cross", "observability"))
    with processes.drawing_processes() as executor:
        draw_all(asked(there, paths, "cross", "observability"), executor)
        with pytest.raises(ConfigError, match="nobody"):
            draw_all(asked(there, paths, "observability", options={"campaign": "nobody"}), executor)
    assert sorted(path.name for path in there.iterdir()) == ["cross.svg", "observability.svg"]
    for path in here.iterdir():
        assert path.read_bytes() == (there / path.name).read_bytes()


def test_a_single_core_draws_itself(monkeypatch):
    monkeypatch.setattr(processes, "_cores", lambda: 1)
    with processes.drawing_processes() as executor:
        assert executor is None


def test_a_system_that_cannot_synchronise_processes_draws_itself(monkeypatch):
    def refuse(*_):
        raise NotImplementedError("no semaphores")

    monkeypatch.setattr(processes, "_cores", lambda: 2)
    monkeypatch.setattr(processes, "ProcessPoolExecutor", refuse)
    with processes.drawing_processes() as executor:
        assert executor is None


def test_the_command_computes_without_matplotlib_and_a_program_that_calls_it_is_not_run_again(tmp_path):
    # a process that draws would import this program anew, and call the command for ever
    (tmp_path / "program.py").write_text(
        "import sys; print('begins'); from rrru.cli import main\n"
        "print(main(['diagnose', 'missing.csv', '--robot', 'rrru3']), 'matplotlib' in sys.modules)\n"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    ended = subprocess.run(
        [sys.executable, "program.py"], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert ended.stdout.split() == ["begins", "2", "False"]
