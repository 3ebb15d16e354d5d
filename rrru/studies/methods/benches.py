"""Where all methods are compared: one virtual robot of each kind, the points to learn from and two sets to be judged
on. Lengths in mm.
"""

from dataclasses import dataclass, replace

import numpy as np

from rrru.campaign.stops import cylinder_points, nearest_first, stops
from rrru.effects.library import active_effects
from rrru.errors import ConfigError
from rrru.plant.virtual_tripod import VirtualTripod
from rrru.robots.protocol import make_mechanism
from rrru.seeds import stream
from rrru.studies import config as parts
from rrru.studies import setup
from rrru.studies.delta import virtual_delta
from rrru.studies.ptt3 import experiments as ptt_robot

ROBOTS = ("rrru3", "ptt3", "delta")
TESTS = ("inside", "outside")
# the richest set of error parameters that positions identify
FULL = {"rrru3": "identifiable", "ptt3": "rails", "delta": "legs"}


@dataclass(frozen=True)
class Bench:
    """One robot's comparison.

    robot: the virtual robot; section: the `methods` section of the configuration; train (n, 3): points to learn from,
    the first k of them for a shorter campaign; tests: name to points (m, 3), "inside" the region of these or "outside"
    of it.
    """

    name: str
    robot: object
    noise_mm: float
    train: np.ndarray
    tests: dict
    section: dict
    seed: int

    def generator(self, *labels):
        """Random stream of this comparison for a purpose."""
        return stream(self.seed, "methods", self.name, *labels)

    def plan(self, points_mm):
        """Plan that stops at points (n, 3), in an order of short ways."""
        return stops(
            "stops",
            nearest_first(points_mm),
            *(self.section["motion"][key] for key in ("speed_mm_s", "acceleration_mm_s2", "settle_s")),
        )

    def run(self, plan, label, controller=None):
        """Measurements and truth of a plan; the same label draws the same noise, whatever the controller."""
        return self.robot.run(plan, self.noise_mm, self.generator("run", label), controller)


def bench(config, name):
    """The comparison on one robot; raises ConfigError where a point of it is out of reach."""
    section, seed = config["methods"], config["seed"]
    region = section["regions"][name]
    robot = _robot(config, name)
    generator = stream(seed, "methods", name, "points")
    centre, radius, heights = region["centre_mm"], region["radius_mm"], region["z_mm"]
    middle, half = np.mean(heights), 0.5 * np.ptp(heights)
    wider = section["outside_factor"]
    train = cylinder_points(centre, radius, heights, max(section["points"]), generator)
    inside = cylinder_points(centre, radius, heights, section["test_points"], generator)
    shell = cylinder_points(
        centre, wider * radius, (middle - wider * half, middle + wider * half), 16 * section["test_points"], generator
    )
    away = (np.hypot(*(shell[:, :2] - centre).T) > radius) | (np.abs(shell[:, 2] - middle) > half)
    tests = {"inside": inside, "outside": shell[away][: section["test_points"]]}
    for points in (train, *tests.values()):
        out = ~np.isfinite(robot.mechanism.inverse(points)).all(axis=1)
        if out.any():
            raise ConfigError(
                f"methods.regions.{name}: {out.sum()} of {len(out)} points are out of reach, the first at {points[out][0].round(1)} mm"
            )
    return Bench(name, robot, region["noise_mm"], train, tests, section, seed)


def _robot(config, name):
    """The virtual robot of the kind that the studies use."""
    bounds = config["calibration"]["bounds"]
    limits = {"angle_limit_rad": bounds["angle_rad"], "length_limit_mm": bounds["length_mm"]}
    if name == "rrru3":
        campaign = config["reproduce"]["campaign"]
        return setup.virtual_campaign(parts.nominal(config, campaign), parts.virtual(config, campaign)).robot
    if name == "ptt3":
        robot = ptt_robot.robot(config)
        return replace(robot, mechanism=replace(robot.mechanism, **limits))
    twin = virtual_delta.twin(config)
    return VirtualTripod(
        make_mechanism("delta", config["robots"]["delta"], parameter_set="tied", **limits),
        twin.truth.parameters.mapping(twin.deviations),
        active_effects(config["methods"]["delta_effects"]),
    )
