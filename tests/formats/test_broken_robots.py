"""A broken URDF, MJCF or DH table is taken or refused with place and value, never with anything else.

RRRU_BROKEN_FILES is the number of robots per form.
"""

from collections import Counter

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from rrru.errors import ConfigError
from rrru.formats.robot_file import from_mjcf, from_urdf
from rrru.pipeline.checks import check_schema
from rrru.robots.catalogue import make_mechanism
from tests.broken import COUNT, EDITS, SPLICES, counted, edited, edited_xml, many, spliced
from tests.places import DATA, ROOT

MODELS = {"arm6.urdf": "", "arm6.xml": "tool0", "delta.xml": "plate", "hexapod.xml": "plate", "rrru3.xml": "plate"}
_ROWS = [
    {"name": "a", "d_mm": 340.0, "range_deg": [-170, 170], "home_deg": 10, "mass_kg": 2.0, "com_mm": [0.0, 0.0, 1.0]},
    {"alpha_deg": -90, "a_mm": 25.0, "theta_deg": 10.0, "range_deg": [-90, 120], "home_deg": 20},
    {"xyz_mm": [1.0, 2.0, 3.0], "rpy_deg": [1.0, 2.0, 3.0], "mass_kg": 1.0},
    {"a_mm": 300.0, "drives": {"a": 1.0, "q4": 1.0}, "range_deg": [-90, 120], "home_deg": 30},
    {"sliding": True, "range_mm": [0, 100], "home_mm": 30},
]
ARM = {"dh": _ROWS, "convention": "modified", "tool_mm": [0.0, 0.0, 50.0]}
HANDS = ARM | {
    "hands": {side: [_ROWS[1] | {"alpha_deg": turn, "name": side * 2}] for side, turn in (("r", 90), ("l", -90))}
}
HANDS["carries"] = {"r": ["r1", "r2"]}


def _stands(robot):
    """A robot that was taken can be asked where it stands."""
    assert np.isfinite(robot.forward(robot.legs.home_drives[None])).all() and np.isfinite(robot.drive_range).all()


def _of_file(path):
    """The robot of a file."""
    platform = MODELS[path.name]
    _stands(from_mjcf(path, platform) if platform else from_urdf(path))


@pytest.mark.parametrize("name", MODELS)
def test_a_broken_file_of_a_robot_is_taken_or_refused(name, tmp_path):
    counts, path, text = Counter(), tmp_path / name, (DATA / "models" / name).read_text()
    _of_file(DATA / "models" / name)

    @many()
    @given(edits=EDITS, splices=st.one_of(st.just([]), SPLICES))
    def one(edits, splices):
        path.write_bytes(spliced(edited_xml(text, edits).encode("utf-8", "replace"), splices))
        counted(counts, ConfigError, _of_file, path)

    one()
    print(name, dict(counts))
    assert counts["refused"] and sum(counts.values()) >= COUNT


@pytest.mark.parametrize("section", [ARM, HANDS], ids=["arm", "hands"])
def test_broken_rows_are_taken_or_refused(section, tmp_path):
    schema, counts = yaml.safe_load((ROOT / "rrru/pipeline/config.schema.yaml").read_text()), Counter()
    robots = schema["properties"]["robots"] | {"$defs": schema["$defs"], "required": []}
    (tmp_path / "schema.yaml").write_text(yaml.safe_dump(robots))

    def made(entries):
        check_schema(entries, tmp_path / "schema.yaml")
        for name, entry in entries.items():
            robot = make_mechanism(name, entry)
            robot.forward(robot.legs.home_drives[None])
            assert (robot.drive_range[:, 0] < robot.drive_range[:, 1]).all()

    made({"arm": section})

    @many()
    @given(edits=EDITS)
    def one(edits):
        counted(counts, ConfigError, made, edited({"arm": section}, edits))

    one()
    print("rows", dict(counts))
    assert counts["refused"] and sum(counts.values()) >= COUNT


@pytest.mark.parametrize(
    ("name", "old", "new", "pattern"),
    [
        (
            "arm6.xml",
            'name="tool0"',
            'name="tool0" pos="1e300 0 0"',
            "arm6.xml: body_pos has the value 1e.300; allowed: numbers",
        ),
        (
            "rrru3.xml",
            'axis="0 -1 0"',
            'axis="0 -1 1e308"',
            r"rrru3.xml: jnt_axis has the value .*; allowed: a direction",
        ),
        ("arm6.xml", "<", b"\xd8<", "arm6.xml: is no text in UTF-8; allowed: a file that can be read, in UTF-8"),
    ],
)
def test_numbers_that_nothing_can_be_reckoned_from_and_no_text_are_refused(name, old, new, pattern, tmp_path):
    path, data = tmp_path / name, (DATA / "models" / name).read_bytes()
    path.write_bytes(data.replace(old.encode(), new if isinstance(new, bytes) else new.encode(), 1))
    with pytest.raises(ConfigError, match=pattern):
        _of_file(path)


def test_a_range_from_high_to_low_is_refused():
    with pytest.raises(ConfigError, match="robot arm: row 1 has range_deg 170 to -170; allowed: low, then high"):
        make_mechanism("arm", {"dh": [{"range_deg": [170, -170]}]})
