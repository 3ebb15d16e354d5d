"""What the drives of robots are called, and of what kind they are."""

import numpy as np

from rrru.robots.cable import cable
from rrru.robots.catalogue import make_mechanism
from rrru.robots.drive_words import LENGTH, SLIDING, TURNING, drive_words
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from tests.places import ROOT


def test_legs_are_numbered_and_drives_of_an_arm_have_their_own_names():
    arm = drive_words(make_mechanism("arm", {"urdf": str(ROOT / "data/models/arm6.urdf")}, parameter_set="zero"))
    assert arm.place(2) == "at axis2" and arm.noun == "drive" and set(arm.kinds) == {TURNING}
    assert arm.place(9) == "at driven joint 9"
    legs = drive_words(Rrru3())
    assert legs.place(2) == "in leg 2" and legs.noun == "leg" and set(legs.kinds) == {TURNING}


def test_legs_are_in_the_order_of_the_actuators_and_have_the_name_of_a_drive_that_says_more(tmp_path):
    text = (ROOT / "data/models/rrru3.xml").read_text()
    first = '    <position name="servo1" class="drive" joint="drive1"/>\n'
    last = '    <position name="servo3" class="drive" joint="drive3"/>\n'
    text = text.replace(first, "").replace(last, last + first).replace('"drive3"', '"left"')
    (tmp_path / "own.xml").write_text(text)
    own = make_mechanism("own", {"mjcf": str(tmp_path / "own.xml"), "platform": "plate"}, parameter_set="zero")
    assert [drive.site for drive in own.parts.drives] == ["drive2", "left", "drive1"]
    for number, leg in enumerate(own.legs.legs):
        assert leg.name == f"leg {number + 1}" and number in {joint.drive for joint in leg.joints}
    words = drive_words(own)
    assert words.all_names == ("leg 1 (drive2)", "leg 2 (left)", "leg 3 (drive1)")
    assert words.place(2) == "in leg 2 (left)" and words.name(4) == "leg 4"


def test_rails_struts_and_cables_are_no_turning_drives():
    assert set(drive_words(Ptt3()).kinds) == {SLIDING}
    hexapod = {"mjcf": str(ROOT / "data/models/hexapod.xml"), "platform": "plate"}
    assert drive_words(make_mechanism("six", hexapod, parameter_set="zero")).kinds == (LENGTH,) * 6
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(8)], axis=1)
    lift = np.array([0.0, 0.0, 1.0]) * (np.arange(8) % 2)[:, None]
    strung = cable(2000.0 * (ring + lift), 100.0 * ring[::-1], [0.0, 0.0, 800.0])
    assert set(drive_words(strung).kinds) == {LENGTH}


def test_a_gantry_has_drives_and_no_legs():
    rows = [{"sliding": True, "alpha_deg": 90.0, "range_mm": [0.0, 500.0], "name": name} for name in ("x", "y", "z")]
    words = drive_words(make_mechanism("gantry", {"dh": rows}))
    assert words.kinds == (SLIDING,) * 3 and words.place(1) == "at x" and words.noun == "drive"
