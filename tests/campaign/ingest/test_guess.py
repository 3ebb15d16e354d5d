"""Names of columns in exports of instruments."""

from types import SimpleNamespace

import pytest

from rrru.campaign.ingest.guess import axis_triples, guess_columns
from rrru.pipeline.read_config import read_config
from rrru.robots.catalogue import make_mechanism

_ROBOT = make_mechanism("rrru3", read_config()["robots"]["rrru3"])


def _guessed(*names):
    """Columns that are proposed for a file with these columns of numbers."""
    cells = SimpleNamespace(names=list(names), means={}, unused=[], cells={name: [1.5] for name in names})
    return guess_columns(cells, _ROBOT, {})


@pytest.mark.parametrize(
    "names",
    [
        *(("SMR X", "SMR Y", "SMR Z"), ("SMR1 X [mm]", "SMR1 Y [mm]", "SMR1 Z [mm]"), ("LT_X", "LT_Y", "LT_Z")),
        *(
            ("Reflector X", "Reflector Y", "Reflector Z"),
            ("Prism E", "Prism N", "Prism H"),
            ("meas X", "meas Y", "meas Z"),
        ),
        *(("X Tracker", "Y Tracker", "Z Tracker"), ("Act X", "Act Y", "Act Z"), ("AT960 X", "AT960 Y", "AT960 Z")),
    ],
)
def test_columns_of_an_instrument_are_proposed_as_the_measured_position(names):
    assert _guessed(*names) == dict(zip(("measured_x_mm", "measured_y_mm", "measured_z_mm"), names, strict=True))


@pytest.mark.parametrize(
    ("names", "triples"),
    [
        (("SMR1 X", "SMR1 Y", "SMR1 Z", "SMR2 X", "SMR2 Y", "SMR2 Z"), 2),
        (("Target X", "Target Y", "Target Z"), 1),
        (("foo X", "foo Y", "foo Z"), 1),
        (("LT X", "LT Y"), 0),
    ],
)
def test_what_may_mean_several_things_is_not_proposed_but_asked_about(names, triples):
    assert _guessed(*names) == {} and len(axis_triples(names)) == triples
