"""The one run that the workflow's tests share."""

import fcntl
import os

import pytest

from tests.workflow.folder import MINIMAL, run

_ANSWERS = "campaign,effects,leg\nfield_09,thermal_growth,0\n"
_CHECKED = "withheld: {field: [field_09], field_answers: answers.csv}\n"


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """Folder of a whole minimal run on two cores, the check on withheld effects included.

    `build/minimal` holds its results, `record` what its scripts have read, `output` what it has said. It is made by the
    first of pytest's workers that asks; the others wait for it.
    """
    own = tmp_path_factory.getbasetemp()
    base = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own
    folder = base / "shared"
    with (base / "shared.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "output").exists():
            _make(folder)
    return folder


def _make(folder):
    """The shared run in a folder."""
    (folder / "record").mkdir(parents=True, exist_ok=True)
    (folder / "answers.csv").write_text(_ANSWERS)
    (folder / "field.yaml").write_text(_CHECKED)
    # a rule that takes two cores, see `test_dependencies`
    targets = ("all", "withheld", "report", "--set-threads", "published=2")
    code, output = run(folder, *targets, overlays=(MINIMAL, "field.yaml"), record=folder / "record")
    assert code == 0, output
    (folder / "output").write_text(output)


@pytest.fixture(scope="session")
def results(shared):
    """Folder of the shared run's results."""
    return shared / "build/minimal"
