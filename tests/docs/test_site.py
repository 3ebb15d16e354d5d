"""The site of the documents: every page is in its navigation, every link leads somewhere, nothing needs a network."""

import re
import subprocess

import pytest
import yaml

from tests.places import ROOT

_MKDOCS = ROOT / ".venv-docs/bin/mkdocs"
# pages that the build makes of other files
_MADE = {"index.md", "tutorial.md", "configuration.md", "tables.md", "contributing.md", "changes.md"}
_PAGES = sorted([ROOT / "README.md", ROOT / "results/README.md", *(ROOT / "docs").glob("*.md")])


def _names(entries):
    """Pages of a navigation, however deep."""
    for entry in entries:
        for value in entry.values():
            yield from [value] if isinstance(value, str) else _names(value)


def _anchors(path):
    """Names of a page's headings, as GitHub and MkDocs make them."""
    text = re.sub(r"^```.*?^```$", "", path.read_text(), flags=re.MULTILINE | re.DOTALL)
    headings = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", line) for line in re.findall(r"^#+ (.+)$", text, re.MULTILINE)]
    return {re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", heading).strip().lower()) for heading in headings}


def test_the_navigation_has_every_page_once_and_no_other():
    named = list(_names(yaml.safe_load((ROOT / "mkdocs.yml").read_text())["nav"]))
    assert sorted(named) == sorted(_MADE | {path.name for path in (ROOT / "docs").glob("*.md")})


def test_every_link_to_a_heading_leads_to_it():
    broken = []
    for page in _PAGES:
        for target, anchor in re.findall(r"\]\(([^)#\s]*)#([^)]+)\)", page.read_text()):
            if "://" not in target:
                path = page.parent / target if target else page
                broken += [f"{page.name}: {target}#{anchor}"] if anchor not in _anchors(path) else []
    assert not broken


def test_the_build_counts_warnings():
    """`--quiet` hides the warnings of broken links from `--strict`."""
    line = next(line for line in (ROOT / "Makefile").read_text().splitlines() if "mkdocs build" in line)
    assert "--strict" in line and "--quiet" not in line and "-q" not in line.split()


@pytest.mark.skipif(not _MKDOCS.is_file(), reason="make docs sets up .venv-docs")
def test_the_site_is_built_and_loads_nothing_from_the_network(tmp_path):
    command = [_MKDOCS, "build", "--strict", "--site-dir", tmp_path / "site"]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    pages = list((tmp_path / "site").glob("*.html"))
    assert len(pages) > 30
    loaded = re.compile(r"<(?:script|img|iframe)[^>]*\ssrc=\"(?:https?:)?//|<link[^>]*href=\"(?:https?:)?//")
    assert not [page.name for page in pages if loaded.search(page.read_text())]
    assert "&gt;&gt;&gt;" in (tmp_path / "site/api.html").read_text()
