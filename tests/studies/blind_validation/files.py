"""Robots of files as the check knows them, with campaigns of few points: what its tests share."""

from functools import cache

import numpy as np
import yaml

from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import from_config
from rrru.studies.blind_validation.chunks import Member, described
from rrru.studies.blind_validation.robots import Conditions, FileRobot
from tests.places import ROOT

FILES = ("rrru3_file", "delta_file", "hexapod_file", "arm6_file")
_PLAIN = {"reverse": False, "payload_kg": 0.0}


@cache
def conditions(file):
    """Conditions of an entry of the configuration."""
    config = yaml.safe_load((ROOT / "config.yaml").read_text())
    return Conditions.of_file(described(config, [Member("own", file, 0)])[file], config)


class Short(FileRobot):
    """A robot that drives one slanting line to and fro, and once more loaded: nine points by default."""

    def plan(self, conditions):
        """Three passes."""
        passes = [_PLAIN, _PLAIN | {"reverse": True}, _PLAIN | {"payload_kg": 3.0}]
        return make_plan(from_config(self.trajectories), passes, **conditions.motion)


def short(plant, file, acting=(), offsets=None, across_mm=(0.0,), points=3):
    """A Short robot of a file on a plant; its line, of so many points, may be driven at several places across."""
    known = conditions(file)
    home, reach = known.mechanism.legs.home_mm, 0.4 * known.model.half_mm
    ends = home + reach * np.array([[-1.0, 0.0, -1.0], [1.0, 0.3, 0.5]])
    lines = {
        "start_mm": ends[0].tolist(),
        "end_mm": ends[1].tolist(),
        "offsets_y_mm": list(across_mm),
        "points": points,
    }
    offsets = offsets or (0.0,) * len(known.mechanism.parts.columns)
    return Short("short", file, plant, {"lines": lines}, offsets, acting)
