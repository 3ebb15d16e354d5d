"""Words that readers of the field do not know are gone from the package, its pages and its documents."""

import re

import pytest

from tests.places import ROOT

# private words of earlier versions, each with the field's term
_GONE = {
    "told": "the name of what is stated or saved",
    "foretold|foretells?": "predicted, predicts",
    "kept": "cached, used",
    "beside": "next to, together with, compared with",
    "but for": "except",
    "gives? way": "is compliant",
    "stands? for": "replaces, represents",
    "takes? up": "absorbs",
    "nobody": "not stated, unknown",
    r"imitat\w*": "confounded with, rival",
    r"confusable\w*": "confounded with",
    "laws?": "effect model",
    "wobbles?": "random error",
    "mastering": "zero offsets",
    "what is what": "",
}
_FOLDERS = {"rrru": ("*.py", "*.html"), "workflow": ("*.py", "*.smk"), "docs": ("*.md",)}
_FILES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *(path for folder, kinds in _FOLDERS.items() for kind in kinds for path in sorted((ROOT / folder).rglob(kind))),
]
# written by a benchmark
_QUOTED = {"docs/benchmarks.md"}


@pytest.mark.parametrize("word", _GONE)
def test_a_private_word_is_gone(word):
    pattern = re.compile(rf"(?<![\w.])(?:{word})(?!\w)", re.IGNORECASE)
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()[:80]}"
        for path in _FILES
        if path.relative_to(ROOT).as_posix() not in _QUOTED
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if pattern.search(line)
    ]
    assert not found, f"say {_GONE[word] or 'what it is'}: {found[:10]}"
