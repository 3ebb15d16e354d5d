"""Every code block of README and docs does what a reader would do with it.

A page's Python runs as one program, next to the results of the workflow's shared run. YAML is an overlay of which a dry
run makes a plan; keys under "# part of a campaign" are tried in one. Of a shell's lines `snakemake` is run dry, and
`make` says what it would do. A comment `<!-- file: name -->` before a block is the name that a reader saves it under.
`text` and `math` are not for running.
"""

import contextlib
import io
import re
import shlex
import subprocess
import sys
import textwrap

import pandas as pd
import pytest

from rrru import cli
from tests.places import ROOT
from tests.studies.printers.simulated_printers import ENTRIES
from tests.studies.printers.test_klipper import config
from tests.workflow.folder import dry_run, link

PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")])
_BLOCK = re.compile(r"(?:<!-- file: (\S+) -->\n)?^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)

_KINDS = ("python", "yaml", "sh", "text", "json", "xml", "math")


_PART, _CAMPAIGN = "# part of a campaign\n", "campaigns:\n  my_run:\n    robot: rrru3\n    ingest: my_file.csv\n"


def blocks(page):
    """File name or "", language and text of every block of a page."""
    return [match.groups(default="") for match in _BLOCK.finditer(page.read_text())]


def _readers_folder(folder, results):
    """What a reader has: the project, results of a run, and a file of a tracker and of a printer."""
    link(folder)
    for name in ("Makefile", "pyproject.toml", "requirements.lock"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "results").symlink_to(results)
    table = pd.read_csv(ROOT / "data/field_01.csv")
    table.to_csv(folder / "my_file.csv", index=False)
    names = {"trajectory": "path", "measured_x_mm": "X", "measured_y_mm": "Y", "measured_z_mm": "Z"}
    table.rename(columns=names).to_csv(folder / "tracker.csv", index=False)
    (folder / "mine.yaml").write_text("campaigns:\n  mine: {robot: rrru3, ingest: my_file.csv}\n")
    (folder / "printer.cfg").write_text(config(ENTRIES["printer_22"]))


def _command(arguments, folder):
    """Exit code and output of `rrru` in a folder, within this process."""
    output = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        try:
            code = cli.main(arguments)
        except SystemExit as stopped:
            code = stopped.code
    return code or 0, output.getvalue()


def _shell(line, folder):
    """Exit code and output of a line, run dry."""
    words = shlex.split(line, comments=True)
    if not words or words[0] == ".":
        return 0, ""
    if words[0] == "make":
        finished = subprocess.run(["make", "-n", *words[1:]], cwd=folder, capture_output=True, text=True, check=False)
        return finished.returncode, finished.stdout + finished.stderr
    if words[0] in ("rrru", "rrru-printer"):
        arguments = ["printer", *words[1:]] if words[0] == "rrru-printer" else words[1:]
        # a diagnosis takes its time: what it would read is read
        arguments = ["check", *arguments[1:]] if arguments[0] == "diagnose" else arguments
        return _command(arguments, folder)
    assert words[0] == "snakemake" and words[1] in ("--cores", "--profile"), f"no way to try {line!r}"
    arguments = words[3:] if words[1] == "--cores" else words[1:]
    split = arguments.index("--configfile") if "--configfile" in arguments else len(arguments)
    return dry_run(folder, *arguments[:split], overlays=tuple(arguments[split + 1 :]))


def _overlay(text, folder, name):
    """Plan a run with an overlay."""
    if text.startswith(_PART):
        text = _CAMPAIGN + textwrap.indent(text, "    ")
    (folder / name).write_text(text)
    code, output = dry_run(folder, overlays=(name,))
    assert code == 0, f"{text}\n{output}"


def _commands(text, folder):
    """Say what every line would do."""
    for line in text.splitlines():
        code, output = _shell(line, folder)
        assert code == 0, f"{line}\n{output}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_blocks_of_a_page_do_what_they_say(page, results, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    _readers_folder(tmp_path, results)
    program = []
    for name, kind, text in blocks(page):
        assert kind in ("python", "yaml", "sh", "text", "json", "xml", "math"), (
            f"{page.name}: a block of language {kind!r}"
        )
        if name:
            (tmp_path / name).write_text(text)
        if kind == "python":
            program.append(text)
        elif kind == "yaml":
            _overlay(text, tmp_path, name or "mine.yaml")
        elif kind == "sh":
            _commands(text, tmp_path)
    finished = subprocess.run(
        [sys.executable, "-"], input="\n".join(program), cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert finished.returncode == 0, finished.stderr


def test_every_link_of_a_page_leads_somewhere():
    """Files and headings that README and docs point to are there."""
    broken = []
    for page in PAGES:
        for target in re.findall(r"\]\(([^)]+)\)", page.read_text()):
            path = target.partition("#")[0]
            if "://" not in target and not (page.parent / path).exists():
                broken.append(f"{page.name}: {target}")
    assert not broken
