"""Names of columns in exports of instruments."""

from types import SimpleNamespace

import pytest

from rrru.campaign.ingest.guess import axis_triples, guess_columns
from rrru.pipeline.read_config import read_config
from rrru.robots.catalogue import make_mechanism

_ROBOT = make_mechanism("rrru3", read_config()["robots"]["rrru3"])


_SLIDES = [{"name": name, "sliding": True, "range_mm": [-300, 300], "alpha_deg": 90} for name in "XYZ"]
_MACHINE = make_mechanism("machine", {"dh": _SLIDES})


def _guessed(*names, robot=_ROBOT, value=1.5):
    """Columns that are proposed for a file with these columns of numbers."""
    cells = SimpleNamespace(names=list(names), means={}, unused=[], cells={name: [value] for name in names})
    return guess_columns(cells, robot, {})


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


@pytest.mark.parametrize("slides", ["XYZ", ("X [mm]", "Y [mm]", "Z [mm]")])
def test_columns_named_as_the_slides_of_a_machine_are_not_what_an_instrument_measured(slides):
    """X, Y, Z next to Probe X .. were proposed as measured positions; without such columns they are."""
    probe = ("Probe X", "Probe Y", "Probe Z")
    measured, drives = ("measured_x_mm", "measured_y_mm", "measured_z_mm"), ("X_mm", "Y_mm", "Z_mm")
    found = _guessed(*slides, *probe, robot=_MACHINE)
    assert found == dict(zip(measured + drives, probe + tuple(slides), strict=True))
    assert _guessed(*slides, robot=_MACHINE) == dict(zip(measured, slides, strict=True))


@pytest.mark.parametrize(("value", "found"), [(0, {}), (1, {"point": "Nr"}), ("3", {"point": "Nr"}), (1.5, {})])
def test_a_count_from_zero_is_no_number_of_points(value, found):
    """It was proposed as `point` and then refused."""
    assert _guessed("Nr", value=value) == found


@pytest.mark.parametrize("name", ["Load kg", "load_kg", "Load [kg]", "payload"])
def test_a_unit_behind_a_space_is_a_unit(name):
    assert _guessed(name) == {"payload_kg": name}


@pytest.mark.parametrize("name", ["Ziel", "Reflektor", "Target", "Marke"])
def test_names_of_reflectors_are_proposed_as_targets(name):
    """A column "Ziel" was left out, so that the tool was taken to be what was read."""
    assert _guessed(name, value="smr") == {"target": name}
