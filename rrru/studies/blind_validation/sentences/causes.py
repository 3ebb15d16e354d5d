"""Causes that act in the own robots, by formulas of their own. Lengths mm, angles rad, N, kg, s.

Each changes where the drives stand, or how the instrument stands, at stops that are reached one after the other in the
drives. The names of those that the library of the diagnosis holds are its own; a step of a scale is an error over the
drive's value as a local one is.
"""

from dataclasses import dataclass, field, replace

import numpy as np


@dataclass(frozen=True)
class Stops:
    """Stops in the order driven: drive values (n, K), payload_kg (n,), time_s (n,), fresh (n,): not in the file."""

    drive: np.ndarray
    payload_kg: np.ndarray
    time_s: np.ndarray
    fresh: np.ndarray


@dataclass(frozen=True)
class Cause:
    """name; sizes (K,): of each drive, of base_drift (3,) in mm/s; more: further numbers by name."""

    name: str
    sizes: tuple
    more: dict = field(default_factory=dict)

    @property
    def leg(self):
        """Number from 1 on of the one drive at which it acts, 0 for several or none."""
        (acting,) = np.nonzero(self.sizes)
        return int(acting[0]) + 1 if len(acting) == 1 and self.name != "base_drift" else 0

    @property
    def effect(self):
        """Name of what the diagnosis should find."""
        return "drive_error_function" if self.name == "scale_step" else self.name

    def scaled(self, factor):
        """The same cause, so many times as large."""
        return replace(self, sizes=tuple((factor * np.array(self.sizes)).tolist()))

    def beyond(self, robot):
        """Whether it is larger than any robot has it."""
        if self.name == "base_drift":
            return bool(np.abs(self.sizes).max() > _MOST_DRIFT_MM_S)
        most = _MOST.get(self.name, _MOST[""])
        return bool((np.abs(self.sizes) > [most[unit] for unit in robot.units]).any())

    def at_drives(self, robot, stops):
        """By how much (n, K) the drives stand off."""
        sizes = np.array(self.sizes)
        if self.name == "base_drift":
            return np.zeros_like(stops.drive)
        return _AT_DRIVES[self.name](sizes, self.more, robot, stops)

    def of_base(self, stops):
        """By how much (n, 3) the robot is shifted against the instrument."""
        if self.name != "base_drift":
            return np.zeros((len(stops.drive), 3))
        return np.outer(stops.time_s - stops.time_s[0], self.sizes)

    def numbers(self, robot):
        """True numbers by the names under which the diagnosis gives them."""
        if self.name == "base_drift":
            return dict(zip(("speed_x", "speed_y", "speed_z"), self.sizes, strict=True))
        stem = _STEMS.get(self.name)
        if stem is None:
            return {}
        numbers = {f"{stem}{k}": size for k, size in enumerate(self.sizes, 1)}
        if stem == "amplitude":
            phases = self.more["phase"]
            numbers |= {f"phase{k}": phases[k - 1] for k, size in enumerate(self.sizes, 1) if size}
        if "waves" in self.more:
            waves = self.more["waves"]
            numbers |= {"ratio": waves} if "rad" in robot.units else {"lead": 2.0 * np.pi / waves}
        return numbers


_STEMS = {
    "backlash": "width",
    "drive_compliance": "compliance",
    "encoder_eccentricity": "amplitude",
    "transmission_error": "amplitude",
}


def _play(sizes, _more, _robot, stops):
    """A drive follows its motor once the play is used up; friction holds it else."""
    at, result = stops.drive[0].copy(), np.zeros_like(stops.drive)
    for k, wanted in enumerate(stops.drive):
        at = np.minimum(np.maximum(at, wanted - 0.5 * sizes), wanted + 0.5 * sizes)
        result[k] = at - wanted
    return result


def _wind_up(sizes, _more, robot, stops):
    """A drive gives way in proportion to the load that it bears."""
    return sizes * robot.loads(stops.drive, stops.payload_kg)


def _once_a_turn(sizes, more, _robot, stops):
    """An encoder's disc is off centre."""
    return sizes * np.sin(stops.drive + more["phase"])


def _waves(sizes, more, _robot, stops):
    """A gear or screw leads and lags with so many radians of the wave per rad or mm."""
    return sizes * np.sin(more["waves"] * stops.drive + more["phase"])


def _local(sizes, more, _robot, stops):
    """A scale is damaged over a short stretch of a drive's way."""
    return sizes * np.exp(-0.5 * ((stops.drive - more["at"]) / more["over"]) ** 2)


def _step(sizes, more, _robot, stops):
    """Two pieces of a scale were joined badly: behind the joint all values are off."""
    return sizes * (stops.drive > more["at"])


_AT_DRIVES = {
    "backlash": _play,
    "drive_compliance": _wind_up,
    "encoder_eccentricity": _once_a_turn,
    "transmission_error": _waves,
    "drive_error_function": _local,
    "scale_step": _step,
}
# largest sizes by the unit of a drive, and of a drift
_MOST = {
    "": {"rad": 5e-3, "mm": 0.5},
    "backlash": {"rad": 1e-2, "mm": 0.8},
    "drive_compliance": {"rad": 5e-7, "mm": 0.02},
}
_MOST_DRIFT_MM_S = 5e-3
# what MuJoCo can make of these
MUJOCO = {"backlash": "play", "drive_compliance": "actuator_stiffness"}
NAMES = (*_AT_DRIVES, "base_drift")


def draw_cause(name, robot, generator):
    """A Cause with the ratios of its sizes drawn, every other one at one drive alone."""
    count, spans = len(robot.units), robot.spans
    if name == "base_drift":
        return Cause(name, tuple(generator.standard_normal(3).tolist()))
    acts = np.ones(count, dtype=bool)
    if name in ("encoder_eccentricity", "transmission_error") and "rad" in robot.units:
        acts = np.array(robot.units) == "rad"
    sizes = np.abs(generator.normal(1.0, 0.4, count)) * acts
    # what a mm does at a slide a rad does at half a metre
    sizes = np.where(np.array(robot.units) == "rad", sizes / 500.0, sizes)
    if name in ("drive_error_function", "scale_step") or generator.random() < 0.5:
        sizes = np.where(np.arange(count) == generator.choice(np.flatnonzero(acts)), sizes, 0.0)
    more, width = {}, np.ptp(spans, axis=1)
    if name in ("encoder_eccentricity", "transmission_error"):
        more["phase"] = generator.uniform(-np.pi, np.pi, count).tolist()
    if name == "transmission_error":
        more["waves"] = 50.0 if "rad" in robot.units else float(2.0 * np.pi / generator.choice([5.0, 10.0, 20.0]))
    if name in ("drive_error_function", "scale_step"):
        more["at"] = (spans[:, 0] + width * generator.uniform(0.3, 0.7, count)).tolist()
    if name == "drive_error_function":
        more["over"] = (0.06 * width).tolist()
    return Cause(name, tuple(sizes.tolist()), more)
