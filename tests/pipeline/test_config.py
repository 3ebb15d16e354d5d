"""Parts of the configuration that campaigns get."""

import pytest
import yaml

from rrru.diagnosis.design.run_limits import StatedLimits
from rrru.errors import ConfigError
from rrru.pipeline import setup
from rrru.pipeline.config import check, limits, of_reproduced_study, robot, sets, source
from tests.places import ROOT

CONFIG = yaml.safe_load((ROOT / "config.yaml").read_text())


def _with_campaign(**section):
    return CONFIG | {"campaigns": CONFIG["campaigns"] | {"mine": section}}


def test_the_sets_of_the_reproduced_study_are_for_its_robot_alone():
    own = _with_campaign(robot="arm6_file", ingest="mine.csv")
    assert sets(own, "mine") == {"all": ["*"]} and not of_reproduced_study(own, "mine")
    assert set(sets(CONFIG, "paper")) == {"group_1", "lines", "spiral", "all"}
    assert sets(CONFIG, "field_01") == sets(CONFIG, "paper")


def test_a_measured_campaign_cannot_be_without_noise():
    with pytest.raises(ConfigError, match=r"campaigns\.mine\.noise_mm: 0, .*; allowed: .*leave the key out"):
        check(_with_campaign(robot="rrru3", ingest="mine.csv", noise_mm=0))
    check(_with_campaign(robot="rrru3", ingest="mine.csv", noise_mm=0.01))
    check(_with_campaign(robot="rrru3", virtual="twin", trajectories="paper", noise_mm=0))


def test_sets_of_an_overlay_are_for_every_campaign():
    own = _with_campaign(robot="arm6_file", ingest="mine.csv")
    own["calibration"] = CONFIG["calibration"] | {"sets": {"all": ["*"], "low": ["low_*"]}}
    assert list(sets(own, "mine")) == ["all", "low"] and {"low", "lines"} < set(sets(own, "paper"))


def test_limits_of_a_campaign_win_over_those_of_its_robot_and_change_no_robot():
    section = {"robot": "rrru3", "ingest": "mine.csv", "limits": {"speed_mm_s": 200.0}}
    own = _with_campaign(**section)
    own["robots"] = CONFIG["robots"] | {
        "rrru3": CONFIG["robots"]["rrru3"] | {"limits": {"payload_kg": 2.0, "minutes": 5}}
    }
    assert limits(own, section) == {"payload_kg": 2.0, "speed_mm_s": 200.0, "minutes": 5}
    own["campaigns"]["mine"]["limits"]["payload_kg"] = 0.0
    assert StatedLimits.from_config(limits(own, section)) == StatedLimits(0.0, 200.0, 5)
    assert limits(CONFIG, CONFIG["campaigns"]["field_01"]) == {}
    assert robot(own, section) == robot(CONFIG, {"robot": "rrru3"}) and "limits" not in source(own, "mine")
    assert setup.mechanism({"name": "rrru3", "dimensions": own["robots"]["rrru3"]}).name == "rrru3"
