"""Virtual robots with one effect each, driven along the same lines: what the tests of the effects share."""

import numpy as np

from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Line, Spiral
from rrru.effects.library import active_effects, library
from rrru.robots.from_dh import from_dh
from rrru.robots.ptt3 import Ptt3
from rrru.robots.rrru3 import Rrru3
from rrru.simulation.virtual_robot import VirtualRobot

ROBOT = Rrru3()
# a robot along lines does not stop, and has no thermometer; effects of many waves have tests of their own
ELSEWHERE = ("drive_error_function", "transmission_orders", "read_before_rest", "thermal_expansion")
EFFECTS = {name: effect for name, effect in library(ROBOT).items() if name not in ELSEWHERE}
SLIDER_EFFECTS = {name: effect for name, effect in library(Ptt3()).items() if name not in ELSEWHERE}
TURN_AND_SLIDE = from_dh(
    [{"d_mm": 300, "a_mm": 200, "range_deg": [-90, 90]}, {"sliding": True, "range_mm": [0, 200]}], name="arm"
)
LINE = Line("line", (-450.0, -100.0, 600.0), (350.0, 150.0, 700.0), 60)
SPIRAL = Spiral("spiral", (0.0, 0.0), (50.0, 300.0), (560.0, 760.0), 4.0, 60)
FORWARD = {"reverse": False, "payload_kg": 0.0}
REVERSE = FORWARD | {"reverse": True}
LOADED = FORWARD | {"payload_kg": 5.0}


def plan_of(*passes, trajectories=(LINE,)):
    """Plan of passes at 80 mm/s and 40 mm/s^2, a minute of rest between the runs."""
    return make_plan(trajectories, passes, 80.0, 40.0, 60.0)


def drive(effects, plan, **options):
    """Motion, true positions (n, 3) without noise, and the platform's rotation (n,) under {effect: {parameter:
    value}}.
    """
    robot = VirtualRobot(effects=active_effects(effects, ROBOT), **options)
    motion = robot.motion(plan, ROBOT.inverse)
    position, turned = robot.positions(motion, plan.targets())
    assert np.isfinite(position).all()
    return motion, position, turned


def drive_error(motion, position):
    """Drive-angle errors (n, 3) that explain the positions of a robot whose platform does not turn."""
    return ROBOT.inverse(position) - motion.drive


def at_site(contribution, site):
    """Twists (n or 1, 6) of a contribution at one of the robot's sites."""
    return contribution.twists[:, ROBOT.legs.site_numbers[site]]


def at_legs(contribution, kind, component):
    """One component (n or 1, 3) of a contribution's twists at the legs' sites of one kind."""
    return np.stack([at_site(contribution, f"leg {leg} {kind}")[:, component] for leg in (1, 2, 3)], axis=-1)


def per_leg(name, values):
    """{name1: .., name2: .., name3: ..} of three values, or of one for all."""
    return {f"{name}{k}": float(value) for k, value in zip((1, 2, 3), np.broadcast_to(values, 3), strict=True)}
