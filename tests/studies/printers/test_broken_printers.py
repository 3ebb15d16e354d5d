"""A broken file of a printer's is taken or refused with file, value and what is allowed, never with anything else.

RRRU_BROKEN_FILES is the number of files per form.
"""

import json
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rrru.errors import IngestError
from rrru.studies.printers import files
from tests.broken import COUNT, EDITS, SPLICES, counted, edited, edited_lines, many, spliced
from tests.studies.printers.simulated_printers import DISTANCES, ENTRIES, HEIGHTS
from tests.studies.printers.test_klipper import config
from tests.studies.printers.test_reprap import PLACES, session

PRINTERS = [ENTRIES[printer.name] for printer in (DISTANCES, HEIGHTS)]
INCLUDES = "[include printer.cfg]\n[include x*.cfg]\n"
FORMS = {
    "printers.json": lambda edits: json.dumps(edited(PRINTERS, edits)),
    "printer.cfg": lambda edits: edited_lines(INCLUDES + config(PRINTERS[0]), edits),
    "session.g": lambda edits: edited_lines(session([0.01 * k for k in range(len(PLACES))]), edits),
}


@pytest.mark.parametrize("name", FORMS)
def test_a_broken_printer_is_taken_or_refused(name, tmp_path):
    counts, path = Counter(), tmp_path / name
    path.write_text(FORMS[name]([]))
    files.read(path)

    @many()
    @given(edits=EDITS, splices=st.one_of(st.just([]), SPLICES))
    def one(edits, splices):
        path.write_bytes(spliced(FORMS[name](edits).encode("utf-8", "replace"), splices))
        counted(counts, IngestError, files.read, path)

    one()
    print(name, dict(counts))
    assert counts["refused"] and sum(counts.values()) >= COUNT


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("printer.cfg", "[include ]\n", ("printer.cfg", "column [include ]", "a pattern of names")),
        ("printer.cfg", f"[include {'x' * 300}]\n", ("printer.cfg", "too long", "a pattern of names")),
        ("printers.json", "[" * 100_000, ("no JSON", "JSON, a list of printers")),
        ("printers.json", json.dumps([PRINTERS[0] | {"radius_mm": 10**400}]), ("radius_mm", "a positive number")),
    ],
)
def test_what_leads_nowhere_is_refused(name, text, words, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(IngestError) as caught:
        files.read(tmp_path / name)
    assert all(word in str(caught.value) for word in words)
