"""Printers of a file: what they say of themselves holds, and a wrong file is refused with the printer and the field."""

import copy
import json

import numpy as np
import pytest

from rrru.errors import ConfigError, IngestError
from rrru.robots.linear_delta import linear_delta
from rrru.studies.printers.readings import read
from tests.places import DATA

SOURCE = DATA / "linear_delta.json"
CONTENT = json.loads(SOURCE.read_text())
WITH_DISTANCES = next(k for k, entry in enumerate(CONTENT) if entry["distances"])


def changed(place, value, number=0):
    """The file's content with one printer, one field of which is changed or, for a value of ..., taken out."""
    entry = copy.deepcopy(CONTENT[number])
    inner = entry
    for key in place[:-1]:
        inner = inner[key]
    if value is ...:
        del inner[place[-1]]
    else:
        inner[place[-1]] = value
    return [entry]


def written(folder, content):
    """Path of a file with that content."""
    path = folder / "mine.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def test_the_saved_numbers_leave_the_residuals_that_the_file_states():
    printers = read(SOURCE)
    assert len(printers) == 32
    for printer, entry in zip(printers, CONTENT, strict=True):
        robot = printer.mechanism()
        off = robot.forward(-printer.height_drop_mm)[:, 2] - printer.height_mm
        np.testing.assert_allclose(np.sqrt((off**2).mean()), entry["program_height_rms_mm"], rtol=1e-9)
        if entry["distances"]:
            first, second = (robot.forward(-printer.distance_drop_mm[:, k]) for k in (0, 1))
            off = np.linalg.norm(first - second, axis=1) - printer.distance_mm
            np.testing.assert_allclose(np.sqrt((off**2).mean()), entry["program_distance_rms_mm"], rtol=1e-9)


@pytest.mark.parametrize(
    ("drive", "step_mm"),
    [
        ({}, 40.0 / (200.0 * 128.0)),
        ({"gear_ratio": "3:1"}, 40.0 / (200.0 * 128.0) / 3.0),
        ({"gear_ratio": "57:11, 2:1"}, 40.0 / (200.0 * 128.0) / (57.0 / 11.0 * 2.0)),
        ({"step_mm": 0.0015625, "rotation_distance_mm": None}, 0.0015625),
    ],
)
def test_a_microstep_is_the_turn_over_steps_and_gears_or_as_given(drive, step_mm, tmp_path):
    content = copy.deepcopy(CONTENT[:1])
    del content[0]["distances"], content[0]["source"]
    content[0]["towers"]["b"] |= drive
    if step_mm < 1e-3:
        # geared carriages make more steps for the same way
        for reading in content[0]["heights"]:
            reading["stable"][1] *= 40.0 / (200.0 * 128.0) / step_mm
    (printer,) = read(written(tmp_path, content))
    np.testing.assert_allclose(printer.step_mm, [0.0015625, step_mm, 0.0015625], rtol=1e-15)
    np.testing.assert_allclose(printer.height_drop_mm, read(SOURCE)[0].height_drop_mm, rtol=1e-12)
    assert printer.parameter_set == "heights" and printer.source == ""


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (("towers", "b"), ..., ("printer_01: towers.b", "nothing")),
        (("towers", "d"), {}, ("printer_01: towers.d", "unknown field")),
        (("towers", "a", "arm_mm"), -3.0, ("printer_01: towers.a.arm_mm", "-3.0", "positive")),
        (("towers", "a", "arm_mm"), 100.0, ("printer_01: towers", "an arm of 100 mm", "longer than radius_mm")),
        (("towers", "a", "angle_deg"), "left", ("printer_01: towers.a.angle_deg", "'left'", "finite")),
        (("towers", "c", "endstop_mm"), float("nan"), ("printer_01: towers.c.endstop_mm", "nan", "finite")),
        (("towers", "c", "microsteps"), 0, ("printer_01: towers.c.microsteps", "0", "positive")),
        (("towers", "c", "microsteps"), None, ("printer_01: towers.c.microsteps", "nothing", "step_mm")),
        (("towers", "c", "gear_ratio"), "three", ("printer_01: towers.c.gear_ratio", "'three'", "3:1")),
        (("towers", "c", "gear_ratio"), "0:1", ("printer_01: towers.c.gear_ratio", "'0:1'")),
        (("towers", "a"), 5, ("printer_01: towers.a", "5", "a mapping")),
        (("radius_mm",), True, ("printer_01: radius_mm", "True", "positive")),
        (("radius_mm",), ..., ("printer_01: radius_mm", "nothing")),
        (
            ("heights",),
            [],
            ("printer_01: heights", "0 heights and 0 distances", "at least 6 heights and 7 readings for 6 numbers"),
        ),
        (("heights",), CONTENT[0]["heights"][:6], ("6 heights and 0 distances", "7 readings for 6 numbers")),
        (("heights",), "none", ("printer_01: heights", "'none'", "a list")),
        (("heights", 2), 7, ("printer_01: heights, number 3", "7", "a mapping")),
        (
            ("heights", 2, "stable"),
            [1.0, 2.0],
            ("printer_01: heights, number 3, stable", "[1.0, 2.0]", "three numbers"),
        ),
        (("heights", 2, "stable"), [1.0, None, 2.0], ("printer_01: heights, number 3, stable", "null", "finite")),
        (("probe_offset_mm",), [20.0], ("printer_01: probe_offset_mm", "[20.0]", "two numbers")),
        (("heights", 2, "probe_offset_mm"), [0.0, "left"], ("heights, number 3, probe_offset_mm", "'left'", "finite")),
        (("heights", 2, "z_mm"), float("inf"), ("printer_01: heights, number 3, z_mm", "inf", "finite")),
        (("heights", 2, "z"), 1.0, ("printer_01: heights, number 3.z", "unknown field", "z_mm, stable")),
        (("hieghts",), [], ("printer_01: hieghts", "unknown field")),
    ],
)
def test_what_is_wrong_is_refused_with_printer_and_field(place, value, words, tmp_path):
    with pytest.raises(IngestError) as caught:
        read(written(tmp_path, changed(place, value)))
    assert all(word in str(caught.value) for word in ("mine.json", *words)), str(caught.value)


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (("distances", 4, "stable2"), ..., ("distances, number 5.stable2", "nothing")),
        (("distances", 4, "mm"), 0.0, ("distances, number 5, mm", "0.0", "positive")),
        (
            ("distances",),
            CONTENT[WITH_DISTANCES]["distances"][:2],
            ("7 heights and 2 distances", "10 readings for 9 numbers"),
        ),
    ],
)
def test_wrong_distances_are_refused_too(place, value, words, tmp_path):
    with pytest.raises(IngestError) as caught:
        read(written(tmp_path, changed(place, value, WITH_DISTANCES)))
    assert all(word in str(caught.value) for word in words), str(caught.value)


@pytest.mark.parametrize(
    ("content", "word"),
    [
        ("{not json", "no JSON"),
        ("[]", "a list of at least one printer"),
        ('{"id": "mine"}', r"put the mapping in \[ \]"),
        ([CONTENT[0], CONTENT[0]], "an id of several printers"),
        ([{"heights": []}], "number 1: id"),
    ],
)
def test_files_that_are_no_list_of_printers_are_refused(content, word, tmp_path):
    with pytest.raises(IngestError, match=word):
        read(written(tmp_path, content))
    with pytest.raises(IngestError, match="No such file"):
        read(tmp_path / "nowhere.json")


def test_all_problems_of_a_file_are_named_at_once(tmp_path):
    content = changed(("radius_mm",), "wide") + changed(("towers", "a", "full_steps"), -200, 1)
    with pytest.raises(IngestError, match=r"(?s)printer_01: radius_mm.*printer_02: towers.a.full_steps"):
        read(written(tmp_path, content))


def test_the_carriage_s_height_is_the_one_that_the_firmware_assumes():
    """Endstop plus sqrt(arm^2 - radius^2) less the way down, tower by tower, and every arm spans carriage and
    nozzle.
    """
    robot = linear_delta(
        100.0, np.radians([210.0, 330.0, 90.0]), [215.0, 216.0, 217.0], [250.0, 251.0, 252.0], "distances"
    )
    down = np.array([[180.0, 200.0, 190.0]])
    (place,) = robot.forward(-down)
    for tower, (angle, arm, endstop) in enumerate(
        zip((210.0, 330.0, 90.0), (215.0, 216.0, 217.0), (250.0, 251.0, 252.0), strict=True)
    ):
        height = endstop + np.sqrt(arm**2 - 100.0**2) - down[0, tower]
        carriage = [100.0 * np.cos(np.radians(angle)), 100.0 * np.sin(np.radians(angle)), height]
        assert np.linalg.norm(place - carriage) == pytest.approx(arm, abs=1e-9) and place[2] < height
    with pytest.raises(ConfigError, match="an arm of 90 mm"):
        linear_delta(100.0, np.zeros(3), [90.0, 216.0, 217.0], np.zeros(3), "heights")
