"""Notebooks are compared by their words and numbers, and become pages with code and outputs."""

import json

import pytest

from docs import notebook


@pytest.mark.parametrize(
    ("saved", "found"),
    [
        ("0.141 mm", "0.151 mm"),
        ("drive_error_function 1.000 named", "drive_error_function 1.000 possible"),
        ("1.14 mm\n0.39 mm", "1.14 mm"),
        ("632 readings", "600 readings"),
        ("-0.011", "0.011"),
    ],
)
def test_a_stale_output_is_noticed(saved, found):
    assert notebook.differences(saved, found)


@pytest.mark.parametrize(("saved", "found"), [("0.141 mm", "0.142 mm"), ("a  0.50", "a 0.51"), ("9 rows", "9 rows")])
def test_rounding_of_another_machine_is_none(saved, found):
    assert not notebook.differences(saved, found)


def test_the_page_of_a_notebook_has_text_code_and_outputs(tmp_path):
    cells = [
        {"cell_type": "markdown", "source": "# Title"},
        {"cell_type": "code", "source": "print(1)\n2", "outputs": []},
    ]
    path = tmp_path / "one.ipynb"
    path.write_text(json.dumps({"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 5}))
    notebook.write(path)
    code, printed, value = "```python\nprint(1)\n2\n```", "```text\n1\n```", "```text\n2\n```"
    assert notebook.as_markdown(path) == "\n\n".join(["# Title", code, printed, value]) + "\n"
