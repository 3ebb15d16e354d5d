"""Broken causes of a simulated robot are taken or refused with place and value, never with anything else.

RRRU_BROKEN_FILES is the number of entries of `virtual_robots` per robot.
"""

from collections import Counter

import pytest
import yaml
from hypothesis import given

from rrru.errors import ConfigError
from rrru.pipeline.checks import check_schema
from rrru.simulation import mujoco_robot
from tests.broken import COUNT, EDITS, counted, edited, many
from tests.places import ROOT
from tests.simulation.simulated import MODELS, file_of, mechanism

CAUSES = {
    "arm6": {
        "zero_offset": {"axis1": 0.001},
        "placement": {"forearm.x": 0.1, "elbow.ry": 0.001},
        "warming": {"forearm.x": 0.1, "time_s": 100.0},
        "actuator_stiffness": {"axis2": 2e8},
        "servo_lag": {"axis1": 0.01},
        "speed_friction": {"axis1": 1.0},
        "joint_friction": {"axis2": 100.0},
        "play": {"axis1": 1e-3},
        "play_friction": {"axis1": 1.0},
        "link_stiffness": {"forearm.ry": 1e7},
        "clearance": {"axis3": 0.01},
        "payload": {"tool0": 1.0},
        "base_tilt": {"x": 0.001},
        "base_stiffness": {"rx": 1e9},
    },
    "hexapod": {"clearance": {"ball1": 0.01}, "play": {"leg3": 0.1}, "placement": {"ball1.x": 0.1}},
}


@pytest.mark.parametrize("name", CAUSES)
def test_broken_causes_are_taken_or_refused(name, tmp_path):
    schema, counts = yaml.safe_load((ROOT / "rrru/pipeline/config.schema.yaml").read_text()), Counter()
    own = schema["properties"]["virtual_robots"] | {"$defs": schema["$defs"]}
    (tmp_path / "schema.yaml").write_text(yaml.safe_dump(own))
    base, given_as = {"real": {"mujoco": {"causes": CAUSES[name]}}}, {"mjcf": file_of(name), "platform": MODELS[name]}

    def made(entries):
        check_schema(entries, tmp_path / "schema.yaml")
        for entry in entries.values():
            if "mujoco" in entry:
                mujoco_robot.from_config(mechanism(name), given_as, entry)

    made(base)

    @many()
    @given(edits=EDITS)
    def one(edits):
        counted(counts, ConfigError, made, edited(base, edits))

    one()
    print(name, dict(counts))
    assert counts["refused"] and sum(counts.values()) >= COUNT


def test_a_zero_offset_of_what_is_no_drive_is_refused():
    entry = {"mujoco": {"causes": {"zero_offset": {"forearm": 0.1}}}}
    with pytest.raises(ConfigError, match="'forearm' is not a drive; allowed: axis1, axis2"):
        mujoco_robot.from_config(mechanism("arm6"), {"mjcf": file_of("arm6"), "platform": MODELS["arm6"]}, entry)
