"""Setup of the comparison of methods: virtual robot, training points, targets inside and outside their region. mm."""

from dataclasses import dataclass

import numpy as np

from rrru.campaign.stops import cylinder_points, nearest_first, stops
from rrru.errors import ConfigError
from rrru.pipeline import setup
from rrru.seeds import stream
from rrru.simulation.driven import DrivenRobot

TESTS = ("inside", "outside")


@dataclass(frozen=True)
class Region:
    """Vertical cylinder of the training points, about (x, y) between two heights, and the tracker's noise there."""

    centre_mm: tuple[float, float]
    radius_mm: float
    z_mm: tuple[float, float]
    noise_mm: float

    def points(self, count, generator, factor=1.0):
        """Points (count, 3) spread evenly over the cylinder, scaled about its middle by a factor."""
        middle, half = np.mean(self.z_mm), 0.5 * np.ptp(self.z_mm)
        heights = (middle - factor * half, middle + factor * half)
        return cylinder_points(self.centre_mm, factor * self.radius_mm, heights, count, generator)

    def holds(self, points_mm):
        """Flags (n,) of the points inside."""
        near = np.hypot(*(points_mm[:, :2] - self.centre_mm).T) <= self.radius_mm
        return near & (np.abs(points_mm[:, 2] - np.mean(self.z_mm)) <= 0.5 * np.ptp(self.z_mm))


@dataclass(frozen=True)
class Trial:
    """The comparison on one virtual robot.

    train_mm (n, 3): points to learn from, the first k of them for a shorter campaign; tests_mm: points (m, 3) by TESTS;
    motion: speed_mm_s, acceleration_mm_s2 and settle_s of the moves between them.
    """

    name: str
    robot: DrivenRobot
    noise_mm: float
    train_mm: np.ndarray
    tests_mm: dict
    motion: dict
    seed: int

    def generator(self, *labels):
        """Random stream of this comparison for a purpose."""
        return stream(self.seed, "methods", self.name, *labels)

    def plan(self, points_mm):
        """Plan that stops at points (n, 3), in an order of short moves."""
        return stops("stops", nearest_first(points_mm), **self.motion)

    def run(self, plan, label, controller=None):
        """Measurements and truth of a plan; the same label draws the same noise, whatever the controller."""
        return self.robot.run(plan, self.noise_mm, self.generator("run", label), controller)


def trial(settings):
    """The comparison of `parts.settings`; raises ConfigError where one of its points is out of reach."""
    name, count, wider = settings["robot"], settings["test_points"], settings["outside_factor"]
    region, generator = Region(**settings["region"]), stream(settings["seed"], "methods", name, "points")
    robot = setup.real_robot(settings["nominal"], settings["real"])
    train, inside = (region.points(n, generator) for n in (max(settings["points"]), count))
    shell = region.points(16 * count, generator, wider)
    tests = {"inside": inside, "outside": shell[~region.holds(shell)][:count]}
    for points in (train, *tests.values()):
        out = ~np.isfinite(robot.mechanism.inverse(points)).all(axis=1)
        if out.any():
            lost = f"{out.sum()} of {len(out)} points are out of reach, the first at {points[out][0].round(1)} mm"
            raise ConfigError(f"methods.regions.{name}: {lost}")
    return Trial(name, robot, region.noise_mm, train, tests, settings["motion"], settings["seed"])
