"""The lines that docs/reading.md tells a user to run, one after the other, on the results of a run."""

import re

from tests.places import ROOT

_BLOCKS = re.compile(r"^\*\*(\d+)\. .*?```python\n(.*?)```", re.MULTILINE | re.DOTALL)


def test_every_question_is_answered_by_its_lines(results, tmp_path, monkeypatch, capsys):
    (tmp_path / "results").symlink_to(results)
    monkeypatch.chdir(tmp_path)
    names = {}
    blocks = _BLOCKS.findall((ROOT / "docs/reading.md").read_text())
    assert [number for number, _ in blocks] == [str(k) for k in range(1, 11)]
    for number, lines in blocks:
        exec(lines, names)
        assert len(capsys.readouterr().out.strip()) > 20, f"question {number} has no answer"
