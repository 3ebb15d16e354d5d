"""The wheel holds what the command needs, and runs without the extras, outside of the project."""

import os
import shutil
import subprocess
import sys
import zipfile

import pytest

from tests.places import ROOT

_EXTRAS = ("pygad", "snakemake", "cv2", "sklearn")


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The folder of an unpacked wheel."""
    folder = tmp_path_factory.mktemp("package")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder / name)
    shutil.copytree(ROOT / "rrru", folder / "rrru", ignore=shutil.ignore_patterns("__pycache__"))
    command = [sys.executable, "-m", "pip", "wheel", ".", "--no-deps", "--no-build-isolation", "--quiet", "-w", "made"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    with zipfile.ZipFile(next((folder / "made").glob("rrru-0.*.whl"))) as wheel:
        wheel.extractall(folder / "site")
    _take_compiled(folder / "site")
    return folder / "site"


def _take_compiled(site):
    """Give a site the kernels that Numba has compiled of the same sources, where there are any."""
    for file in (ROOT / "rrru").rglob("__pycache__/*.nb[ic]"):
        source = file.parents[1] / f"{file.name.partition('.')[0]}.py"
        own = site / source.relative_to(ROOT)
        if not own.is_file():
            # of a module that is gone
            continue
        assert own.read_bytes() == source.read_bytes()
        shutil.copystat(source, own)
        own.parent.joinpath("__pycache__").mkdir(exist_ok=True)
        shutil.copy2(file, own.parent / "__pycache__")


def test_the_command_of_the_wheel_needs_neither_the_project_nor_the_extras(installed, tmp_path):
    shutil.copy(ROOT / "data/field_12.csv", tmp_path / "mine.csv")
    code = "\n".join(
        [
            "import sys",
            f"sys.modules.update(dict.fromkeys({_EXTRAS}))",
            "from rrru import cli",
            "sys.exit(cli.main(['diagnose', 'mine.csv', '--robot', 'rrru3', '--noise', '0.02']))",
        ]
    )
    environment = os.environ | {"PYTHONPATH": str(installed)}
    ended = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert (tmp_path / "results/campaigns/mine/report.html").is_file() and not ended.stderr


def test_without_pygad_its_reading_of_the_paper_says_what_to_install(installed, tmp_path):
    code = "\n".join(
        [
            "import sys",
            "sys.modules['pygad'] = None",
            "from rrru.errors import ConfigError",
            "from rrru.genetic import pygad_run",
            "try:",
            "    pygad_run._pygad()",
            "except ConfigError as error:",
            "    print(error)",
        ]
    )
    environment = os.environ | {"PYTHONPATH": str(installed)}
    ended = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert "pip install 'rrru[genetic]'" in ended.stdout
