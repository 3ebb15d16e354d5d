"""The user's own code behind `module:object`: its files, and digests that follow it."""

import pytest

from rrru.pipeline.config import own_effects, robot, virtual
from rrru.plugins import module_files, own_code_digest

_FILES = {
    "mine.py": "import numpy as np\nfrom helpers import size\n\n\ndef make():\n    from parts import arms\n",
    "helpers.py": "import mine\nsize = 1.0\n",
    "parts/__init__.py": "",
    "parts/arms.py": "from . import rods\nfrom .inner import one\n",
    "parts/rods.py": "",
    "parts/inner/__init__.py": "",
    "parts/inner/one.py": "from ..bolts import bolt\n",
    "parts/bolts.py": "",
    "unused.py": "",
}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    for name, text in _FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_files_of_a_module_are_all_that_it_imports_here():
    assert {str(file) for file in module_files(["mine:make"])} == set(_FILES) - {"unused.py"}
    assert {str(file) for file in module_files(["parts.bolts:bolt"])} == {"parts/__init__.py", "parts/bolts.py"}
    inner = {str(file) for file in module_files(["parts.inner:one"])}
    assert inner == {"parts/__init__.py", "parts/inner/__init__.py"}
    assert module_files(["numpy:array"]) == []


@pytest.mark.parametrize("name", _FILES)
def test_what_depends_on_own_code_changes_with_each_of_its_files(name, folder):
    config = {
        "seed": 1,
        "loads": {},
        "motion": {},
        "robots": {"own": {"module": "mine:make"}},
        "virtual_robots": {"worn": {"effects": {"mine:Creep": {}, "backlash": {}}}},
        "trajectories": {"lines": {}},
        "campaigns": {"c": {"robot": "own", "virtual": "worn", "trajectories": "lines", "noise_mm": 0.02}},
        "gap": {"effects": ["mine:Other"], "own_effects": ["mine:Third"]},
    }
    assert own_effects(config) == ["mine:Creep", "mine:Other", "mine:Third"]
    asked = (
        lambda: own_code_digest(own_effects(config)),
        lambda: robot(config, config["campaigns"]["c"]),
        lambda: virtual(config, "c"),
    )
    before = [one() for one in asked]
    (folder / name).write_text(_FILES[name] + "# touched\n")
    assert [one() != was for one, was in zip(asked, before, strict=True)] == 3 * [name != "unused.py"]
