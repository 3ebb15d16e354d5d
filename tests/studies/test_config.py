"""Parts of the configuration that campaigns get."""

import yaml

from rrru.studies.config import of_reproduced_study, sets
from tests.places import ROOT

CONFIG = yaml.safe_load((ROOT / "config.yaml").read_text())


def _with_campaign(**section):
    return CONFIG | {"campaigns": CONFIG["campaigns"] | {"mine": section}}


def test_the_sets_of_the_reproduced_study_are_for_its_robot_alone():
    own = _with_campaign(robot="arm6_file", ingest="mine.csv")
    assert sets(own, "mine") == {"all": ["*"]} and not of_reproduced_study(own, "mine")
    assert set(sets(CONFIG, "paper")) == {"group_1", "lines", "spiral", "all"}
    assert sets(CONFIG, "field_01") == sets(CONFIG, "paper")


def test_sets_of_an_overlay_are_for_every_campaign():
    own = _with_campaign(robot="arm6_file", ingest="mine.csv")
    own["calibration"] = CONFIG["calibration"] | {"sets": {"all": ["*"], "low": ["low_*"]}}
    assert list(sets(own, "mine")) == ["all", "low"] and {"low", "lines"} < set(sets(own, "paper"))
