"""Klipper's printer.cfg as owners have it: Klipper's defaults, its saved block, and what is refused."""

import json
import re

import numpy as np
import pytest

from rrru.errors import IngestError
from rrru.studies.printers import files
from tests.studies.printers.simulated_printers import DISTANCES, ENTRIES, HEIGHTS

PLACES = {
    "heights": (("z_mm", ""), ("stable", "_pos")),
    "distances": (("mm", ""), ("stable1", "_pos1"), ("stable2", "_pos2")),
}


def config(entry, drive="microsteps:{microsteps}\nrotation_distance: {rotation_distance_mm} # of the belt\n", above=""):
    """A printer.cfg with the numbers of a JSON entry in the block that SAVE_CONFIG writes."""
    owner, saved = ["[printer]\nkinematics: delta\n"], [f"[printer]\ndelta_radius = {entry['radius_mm']}\n"]
    for name, tower in entry["towers"].items():
        owner.append(f"[stepper_{name}]\n" + drive.format(**tower))
        numbers = (
            f"angle = {tower['angle_deg']}\narm_length = {tower['arm_mm']}\nposition_endstop = {tower['endstop_mm']}\n"
        )
        saved.append(f"[stepper_{name}]\n{numbers}")
    saved.append("[delta_calibrate]\n")
    for kind, places in PLACES.items():
        for number, reading in enumerate(entry[kind]):
            for key, ending in places:
                value = reading[key]
                text = value if not isinstance(value, list) else ",".join(str(one) for one in value)
                saved.append(f"{kind[:-1]}{number}{ending} = {text}\n")
    block = "\n".join("#*# " + line for line in "\n".join(saved).splitlines())
    head = (
        "#*# <---------------------- SAVE_CONFIG ---------------------->\n#*# DO NOT EDIT THIS BLOCK OR BELOW.\n#*#\n"
    )
    return "\n".join(owner) + above + "\n" + head + block + "\n"


def written(folder, text, name="printer.cfg"):
    path = folder / name
    path.write_text(text)
    return path


@pytest.mark.parametrize("printer", [HEIGHTS, DISTANCES], ids=lambda p: p.name)
def test_a_printer_cfg_is_the_same_printer_as_its_json(printer, tmp_path):
    (found,) = files.read(written(tmp_path, config(ENTRIES[printer.name])))
    assert found.name == "printer"
    for field in ("radius_mm", "angle_deg", "arm_mm", "endstop_mm", "height_mm", "distance_mm"):
        np.testing.assert_array_equal(getattr(found, field), getattr(printer, field))
    np.testing.assert_allclose(found.height_drop_mm, printer.height_drop_mm, rtol=1e-14)
    np.testing.assert_allclose(found.distance_drop_mm, printer.distance_drop_mm, rtol=1e-14)


def test_a_setting_above_wins_and_what_is_absent_is_klippers_own(tmp_path):
    """Old files give the step; towers b and c take arm and endstop of a; towers stand at 210, 330 and 90 degrees."""
    text = config(ENTRIES["printer_16"], "step_distance: 0.0125\n", "[printer]\ndelta_radius: 150.5 ; measured\n")
    text = re.sub(r"#\*# (angle|arm_length|position_endstop) = .*\n", "", text)
    text = text.replace("[stepper_a]\n", "[stepper_a]\narm_length=340#mm\nposition_endstop: 400\n", 1)
    (found,) = files.read(written(tmp_path, text))
    assert found.radius_mm == 150.5 and (found.step_mm == 0.0125).all()
    assert (found.arm_mm == 340.0).all() and (found.endstop_mm == 400.0).all()
    assert found.angle_deg.tolist() == [210.0, 330.0, 90.0]


def test_full_steps_and_gears(tmp_path):
    drive = "microsteps: 16\nrotation_distance: 40\nfull_steps_per_rotation: 400\ngear_ratio: 3:1, 2:1\n"
    (found,) = files.read(written(tmp_path, config(ENTRIES["printer_16"], drive)))
    np.testing.assert_allclose(found.step_mm, 40.0 / (400 * 16) / 6.0)


def test_where_the_probe_sat_at_every_height(tmp_path):
    """Heights of the probe's z_offset were probed, those of 0 and the manual ones were touched by the nozzle."""
    (tmp_path / "parts").mkdir()
    written(tmp_path / "parts", "[bltouch]\nx_offset: -12\ny_offset: 20.5\nz_offset: 2.5\n", "probe.cfg")
    text = config(ENTRIES["printer_16"], above="[include parts/*.cfg]\n[include nowhere.cfg]\n")
    text = re.sub(r"(#\*# height[0-5] =).*", r"\1 2.5", text)
    text = re.sub(r"(#\*# height6 =).*", r"\1 0.0", text)
    by_hand = re.search(r"#\*# height0_pos = (.*)", text)[1]
    (found,) = files.read(written(tmp_path, f"{text}#*# manual_height0 = 0.1\n#*# manual_height0_pos = {by_hand}\n"))
    assert found.probe_mm.tolist() == [[0.0, 0.0], *[[-12.0, 20.5]] * 6, [0.0, 0.0]]
    assert found.by_hand.tolist() == [True, *[False] * 6, True] and found.height_mm[0] == 0.1
    np.testing.assert_array_equal(found.height_drop_mm[0], found.height_drop_mm[1])


def test_an_include_by_an_absolute_path_is_followed(tmp_path):
    """As Klipper does; on another computer than the printer's, the file of this name next to printer.cfg."""
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "printer").mkdir()
    probe = written(tmp_path / "elsewhere", "[bltouch]\nx_offset: -12\ny_offset: 20.5\nz_offset: 2.5\n", "probe.cfg")

    def offsets(include):
        text = config(ENTRIES["printer_16"], above=f"[include {include}]\n")
        (found,) = files.read(written(tmp_path / "printer", text))
        return found.probe_mm[~found.by_hand].tolist()

    assert offsets(probe) == offsets(f"{probe.parent}/p*.cfg") and [-12.0, 20.5] in offsets(probe)
    assert [-12.0, 20.5] not in offsets("/home/pi/printer_data/config/probe.cfg")
    written(tmp_path / "printer", probe.read_text(), "probe.cfg")
    assert offsets("/home/pi/printer_data/config/probe.cfg") == offsets(probe)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.replace("kinematics: delta", "kinematics: corexy"), ("printer: kinematics", "corexy", "delta")),
        (lambda t: re.sub(r"#\*# delta_radius.*\n", "", t), ("printer: delta_radius", "nothing")),
        (lambda t: re.sub(r"microsteps:.*\n", "", t), ("stepper_c: microsteps", "nothing")),
        (lambda t: re.sub(r"(height3 =).*", r"\1 high", t), ("delta_calibrate: height3", "'high'", "a number")),
        (
            lambda t: re.sub(r"(height3_pos =).*", r"\1 1,2", t),
            ("delta_calibrate: height3_pos", "'1,2'", "three numbers"),
        ),
        (lambda t: re.sub(r"#\*# height0 =.*", "", t), ("delta_calibrate: height0", "DELTA_CALIBRATE")),
        (lambda t: re.sub(r"(height3 =).*", r"\1 nan", t), ("heights, number 4, z_mm", "nan")),
        (lambda t: "just text\n" + t, ("no printer.cfg",)),
    ],
)
def test_what_is_wrong_is_refused_by_its_setting(change, words, tmp_path):
    with pytest.raises(IngestError) as caught:
        files.read(written(tmp_path, change(config(ENTRIES["printer_16"]))))
    assert all(word in str(caught.value) for word in ("printer.cfg", *words)), str(caught.value)


def test_a_bad_file_or_printer_does_not_stop_the_others(tmp_path):
    good = written(tmp_path, config(ENTRIES["printer_16"]), "good.cfg")
    bad = written(tmp_path, "[printer]\nkinematics: delta\n", "bad.cfg")
    broken = dict(ENTRIES["printer_22"], radius_mm="wide")
    mixed = written(tmp_path, json.dumps([broken, ENTRIES["printer_08"]]), "mixed.json")
    found = {printer.name: printer for printer in files.read_all([good, bad, mixed])}
    assert list(found) == ["good", "bad", "printer_22", "printer_08"]
    assert "bad.cfg" in found["bad"].reason and "printer: delta_radius" in found["bad"].reason
    assert "printer_22: radius_mm" in found["printer_22"].reason and len(found["printer_08"].height_mm) == 7
    with pytest.raises(IngestError, match=r"(?s)bad.cfg.*nowhere.cfg"):
        files.read_all([bad, tmp_path / "nowhere.cfg"])
    with pytest.raises(IngestError, match="printer_08 twice"):
        files.read_all([mixed, written(tmp_path, json.dumps([ENTRIES["printer_08"]]), "again.json")])
