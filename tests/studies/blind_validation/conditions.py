"""What the robots of these tests share, and robots on which nothing acts."""

from dataclasses import replace

import numpy as np

from rrru.kinematics.dynamics import Masses
from rrru.robots.catalogue import make_mechanism
from rrru.studies.blind_validation import draw
from rrru.studies.blind_validation.robots import Conditions

_MECHANISM = make_mechanism("rrru3", {}, angle_limit_rad=0.5, length_limit_mm=400.0)
_MOTION = {"speed_mm_s": 80.0, "acceleration_mm_s2": 40.0, "dwell_s": 60.0}
CONDITIONS = Conditions(_MECHANISM, _MOTION, Masses(), 0.02, 2021)


_COUNTED = ("robots", "per_effect", "per_noise", "many", "background", "as_robots_are", "mujoco", "own")


def section(**stated):
    """The section `withheld` with what is stated: nothing else is counted or listed."""
    lists = {"effects": [], "field": [], "files": [], "as_robots_are_files": [], "chunk": 4}
    return dict.fromkeys(_COUNTED, 0) | lists | stated


def bare(number, kind="paper", name="bare"):
    """A robot that deviates from the nominal one, and nothing more."""
    return replace(draw.bare(name, np.random.default_rng(number), CONDITIONS), kind=kind)


def acting(robot, name, single=False, span=(2.0, 2.001), seed=1):
    """A cause of a robot of a strength in a span; single: on one leg in a third of the draws."""
    return draw.draw_acting(robot, name, single, span, np.random.default_rng(seed), CONDITIONS)
