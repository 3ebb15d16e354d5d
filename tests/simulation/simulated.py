"""The models of data/models driven by MuJoCo from stop to stop, for tests."""

from functools import cache

import numpy as np

from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Line
from rrru.formats.robot_file import from_mjcf
from rrru.simulation.mujoco_robot import MujocoRobot
from rrru.studies.methods.regions import stops
from tests.places import ROOT

MODELS = {"arm6": "tool0", "rrru3": "plate", "delta": "plate", "hexapod": "plate"}
G = 9.80665


def file_of(name):
    return ROOT / f"data/models/{name}.xml"


@cache
def mechanism(name):
    return from_mjcf(file_of(name), platform=MODELS[name])


def simulated(name, **causes):
    """The robot of a model with causes."""
    return MujocoRobot(mechanism(name), file_of(name), MODELS[name], causes)


def near_home(name, *offsets_mm):
    """Points (n, 3) about a model's home position."""
    return mechanism(name).legs.home_mm + np.array(offsets_mm, dtype=float)


def standing(robot, points_mm, payload_kg=0.0):
    """Motion and true positions (n, 3) at stops."""
    plan = stops("stops", points_mm, 80.0, 40.0, 1.0, payload_kg)
    motion = robot.motion(plan, robot.mechanism.inverse)
    return motion, robot.positions(motion)[0]


def on_line(robot, start_mm, end_mm, points, speed_mm_s=80.0, passes=({"reverse": False, "payload_kg": 0.0},)):
    """Motion and true positions (n, 3) along a line, at the plan's times."""
    plan = make_plan((Line("line", tuple(start_mm), tuple(end_mm), points),), passes, speed_mm_s, 400.0, 5.0)
    motion = robot.motion(plan, robot.mechanism.inverse)
    return motion, robot.positions(motion)[0]
