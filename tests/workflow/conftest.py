"""The one run that the workflow's tests share."""

import pytest

from tests.workflow.folder import MINIMAL, run

_ANSWERS = "campaign,effects,leg\nfield_09,thermal_growth,0\n"
_CHECKED = "withheld: {field: [field_09], field_answers: answers.csv}\n"


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """Folder of a whole minimal run on two cores, the check on withheld effects and a twin's search included.

    `build/minimal` holds its results, `record` what its scripts have read, `output` what it has said.
    """
    folder = tmp_path_factory.mktemp("shared")
    (folder / "record").mkdir()
    (folder / "answers.csv").write_text(_ANSWERS)
    (folder / "field.yaml").write_text(_CHECKED)
    targets = ("all", "withheld", "build/minimal/twin/delta.yaml")
    code, output = run(folder, *targets, overlays=(MINIMAL, "field.yaml"), record=folder / "record")
    assert code == 0, output
    (folder / "output").write_text(output)
    return folder


@pytest.fixture(scope="session")
def results(shared):
    """Folder of the shared run's results."""
    return shared / "build/minimal"
