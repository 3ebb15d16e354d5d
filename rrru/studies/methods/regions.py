"""Setup of the comparison of methods: virtual robot, training points, targets inside and outside their region.

Every point is measured at rest, the commanded motion is straight from point to point. Lengths in mm, times in s.
"""

from dataclasses import dataclass

import numpy as np

from rrru.campaign.plan import Plan, Run
from rrru.campaign.speed_profile import Trapezoid
from rrru.errors import ConfigError
from rrru.pipeline import setup
from rrru.seeds import stream
from rrru.simulation.driven import DrivenRobot

TESTS = ("inside", "outside")

# points of the straight path between two stops
_STEPS = 8


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


def cylinder_points(centre_mm, radius_mm, z_mm, count, generator):
    """Points (count, 3) spread evenly over an upright cylinder about (x, y) between two heights: a Sobol sequence."""
    from scipy.stats import qmc

    share = qmc.Sobol(3, rng=generator).random_base2(int(np.ceil(np.log2(count))))[:count]
    radius, angle = radius_mm * np.sqrt(share[:, 0]), 2.0 * np.pi * share[:, 1]
    x, y = centre_mm[0] + radius * np.cos(angle), centre_mm[1] + radius * np.sin(angle)
    low, high = sorted(z_mm)
    return np.stack([x, y, low + share[:, 2] * (high - low)], axis=-1)


def nearest_first(points_mm):
    """The points (n, 3) in an order of short ways: from the first one always to the nearest that is left."""
    left, order = list(range(1, len(points_mm))), [0]
    while left:
        distance = np.linalg.norm(points_mm[left] - points_mm[order[-1]], axis=1)
        order.append(left.pop(int(distance.argmin())))
    return points_mm[order]


def stops(name, points_mm, speed_mm_s, acceleration_mm_s2, settle_s, payload_kg=0.0):
    """Plan of one run straight from point to point (n, 3), measured at rest, `settle_s` after each arrival."""
    points = np.asarray(points_mm, dtype=float)
    ways = np.linalg.norm(np.diff(points, axis=0), axis=1)
    durations = [Trapezoid(float(way), speed_mm_s, acceleration_mm_s2).duration_s if way > 0.0 else 0.0 for way in ways]
    at = np.arange(len(points)) * _STEPS
    path = np.stack([np.interp(np.arange(at[-1] + 1), at, points[:, axis]) for axis in range(3)], axis=-1)
    at_rest = np.zeros_like(points)
    time = np.concatenate([[0.0], np.cumsum(np.array(durations) + settle_s)]) + settle_s
    return Plan((Run(name, points, path, at, time, at_rest, at_rest, float(speed_mm_s), float(payload_kg)),), 0.0)
