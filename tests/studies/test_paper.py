"""Rows that all papers share: numbers compared with a study's, and findings decided by their numbers."""

import numpy as np
import pytest

from rrru.errors import ConfigError
from rrru.studies import paper
from rrru.studies.delta import audit as audit_c
from rrru.studies.ptt3 import audit as audit_b
from rrru.studies.rrru3 import audit as audit_a
from tests.schemas import check

NUMBERS = (
    paper.Number("length", "Table 1", "mm", 4.0, "chosen"),
    paper.Number("width", "Table 1", "mm", 0.0, "chosen"),
    paper.Number("length", "abstract", "mm", 5.0),
    paper.Number("angle", "Fig. 2", "deg", 30.0),
)
FINDINGS = (*audit_a.COMPUTED, *audit_a.READ, *audit_b.COMPUTED, *audit_c.COMPUTED, audit_c.READ[0])


def test_numbers_stand_beside_the_printed_ones_and_are_null_without_a_study():
    here, spread, notes = {"length": 2.0, "width": 1}, {"length": (2.0, 1.0, 4.0)}, {"length": "twice", "angle": "none"}
    frame = check("published", paper.published_rows("A", NUMBERS, here, spread, notes))
    assert frame["note"].tolist() == ["chosen; twice", "chosen", "twice", "none"]
    np.testing.assert_array_equal(frame["here"], [2.0, 1.0, 2.0, np.nan])
    # nothing is a share of zero
    np.testing.assert_array_equal(frame["ratio"], [0.5, np.nan, 0.4, np.nan])
    drawn = frame[["here_median", "here_low", "here_high"]].iloc[[0, 3]]
    np.testing.assert_array_equal(drawn, [[2.0, 1.0, 4.0], [np.nan, np.nan, np.nan]])
    assert frame["inside"].tolist() == ["inside", "no draws", "above", "no draws"]
    assert check("published", paper.published_rows("A", NUMBERS, {}))[["here", "ratio"]].isna().all(axis=None)


def test_an_item_that_the_paper_does_not_print_is_refused():
    with pytest.raises(ConfigError, match=r"paper C prints no height; known: length, width, angle"):
        paper.published_rows("C", NUMBERS, {"height": 0.2})


def test_findings_are_judged_by_their_values_and_show_them():
    finding = paper.Finding(
        "eq. (1)", "a", "b", "{2:.1f} of {0:.0f}", "1", lambda: (1.0, 2.0, 0.25), lambda a, b, _: a > b
    )
    frame = check(
        "audit", paper.audit_rows("B", [finding], [paper.Finding("eq. (2)", "c", "d")], {"eq. (3)": ("e", "f")})
    )
    assert frame["kind"].tolist() == ["computed", "as printed", "lost"] and frame["shown"].tolist() == [
        False,
        True,
        False,
    ]
    assert frame["check"][0] == "0.2 of 1" and frame["printed"][2] == "lost: e"
    assert frame[["value_printed", "value_right"]].iloc[1:].isna().all(axis=None)


@pytest.mark.parametrize("finding", FINDINGS, ids=lambda finding: finding.where)
def test_every_misprint_shows_by_its_numbers_alone(finding):
    """All show but the one claim that holds; none shows when its numbers are gone, or where both are what is right."""
    values = finding.values()
    holds = finding.right == "they do, in rank"
    assert bool(finding.shows(*values)) != holds
    assert not finding.shows(*np.full(len(values), np.nan))
    equality = ("= +-112", "R and r shift", "upright links", "only a travel", "det J vanishes", "is on the line")
    if not any(text in finding.right for text in equality):
        assert not finding.shows(values[1], values[1], *values[2:])


def test_findings_from_the_text_alone_are_marked():
    rows = {module.__name__: module.audit_rows() for module in (audit_a, audit_b, audit_c)}
    counts = {name: (len(frame), int(frame["shown"].sum())) for name, frame in rows.items()}
    assert list(counts.values()) == [(21, 21), (28, 8), (18, 8)]
    for frame in rows.values():
        check("audit", frame)
        assert (frame["printed"].str.len() > 0).all() and (frame["right"].str.len() > 0).all()
