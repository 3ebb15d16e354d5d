"""Pages of the validation: what holds comes first, paragraphs are short, and numbers name their commit and seed."""

import re
import subprocess

import pytest

from tests.places import ROOT

_NAMES = ("trust", "mujoco", "mujoco-withheld", "real-robots", "reproduction", "benchmarks")
_PAGES = {name: (ROOT / f"docs/{name}.md").read_text() for name in (*_NAMES, "concepts", "diagnosis")}
_MAX_WORDS = 120
# sections that describe how something is done, and hold no number that was measured
_WITHOUT_MEASUREMENT = {
    "trust": {"What these counts are worth"},
    "mujoco": {"Causes", "How it is driven"},
    "mujoco-withheld": {"How it is counted"},
    "real-robots": {"A robot of your own"},
    "reproduction": {"How it was made", "Sources"},
    "benchmarks": {"How it is measured"},
}
_COMMIT = re.compile(r"commits? ([0-9a-f]{7})\b|(?:,|and|;) ([0-9a-f]{7})\b")


def _sections(page):
    """Text below each heading of the second level, by its heading."""
    _, *parts = re.split(r"^## ", _PAGES[page], flags=re.MULTILINE)
    return {heading: text for heading, _, text in (part.partition("\n") for part in parts)}


@pytest.mark.parametrize("page", _PAGES)
def test_no_paragraph_is_longer_than_120_words(page):
    prose = re.sub(r"```.*?```", "", _PAGES[page], flags=re.DOTALL)
    paragraphs = [one for one in re.split(r"\n\s*\n|\n(?=- |\d\. |#)", prose) if not one.lstrip().startswith("|")]
    assert not [one for one in paragraphs if len(one.split()) > _MAX_WORDS]


@pytest.mark.parametrize("page", _NAMES)
def test_a_page_says_first_what_holds_by_a_table_and_a_figure(page):
    first = _sections(page).get("In one minute", "")
    assert re.search(r"^\| question \| answer \|", first, re.MULTILINE)
    assert re.search(r"^!\[[^\]]+\]\(\w+\.png\)$", _PAGES[page].partition("## ")[0] + first, re.MULTILINE)


@pytest.mark.parametrize("page", _NAMES)
def test_every_section_with_measured_numbers_names_commit_and_seed(page):
    sections = _sections(page)
    assert _WITHOUT_MEASUREMENT[page] <= sections.keys()
    for heading in sections.keys() - _WITHOUT_MEASUREMENT[page] - {"In one minute"}:
        recorded = re.findall(r"^\*Recorded: [^*]+\*$", sections[heading], re.MULTILINE)
        assert recorded and all(_COMMIT.search(one) for one in recorded), f"{page}, {heading}: no *Recorded: commit ..*"
        assert page == "benchmarks" or any(re.search("seed|no random numbers", one) for one in recorded), heading


def test_the_commits_of_the_pages_are_in_the_history():
    git = ["git", "-C", str(ROOT)]
    whole = subprocess.run([*git, "rev-parse", "--is-shallow-repository"], capture_output=True, text=True, check=False)
    if whole.stdout.strip() != "false":
        pytest.skip("no whole history here")
    named = {one for page in _NAMES for pair in _COMMIT.findall(_PAGES[page]) for one in pair if one}
    assert len(named) > 10
    for commit in sorted(named):
        found = subprocess.run([*git, "cat-file", "-e", f"{commit}^{{commit}}"], capture_output=True, check=False)
        assert found.returncode == 0, f"commit {commit}: not in this history"
