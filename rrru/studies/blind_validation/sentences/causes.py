"""Causes that act in the own robots, independently of the package's effect models. mm, rad, N, kg, s.

Each changes the actuator positions, or the pose of the instrument, at stops that are reached in order in the drives.
Causes in the library of the diagnosis have the library's names. A step of a scale and a local error are both errors as
a function of the actuator position.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from rrru.studies.blind_validation.sentences.own_robots import Rods


@dataclass(frozen=True)
class Stops:
    """Stops in order: actuator positions drive (n, K), payload_kg (n,), time_s (n,), fresh (n,): not in the file."""

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
        """Number, from 1 on, of the single drive at which it acts; 0 for several or none."""
        (acting,) = np.nonzero(self.sizes)
        return int(acting[0]) + 1 if len(acting) == 1 and self.name != "base_drift" else 0

    @property
    def effect(self):
        """Name of the effect that the diagnosis should find."""
        return "drive_error_function" if self.name == "scale_step" else self.name

    def scaled(self, factor):
        """The same cause with its sizes multiplied by a factor."""
        return replace(self, sizes=tuple((factor * np.array(self.sizes)).tolist()))

    def beyond(self, robot):
        """Whether it is larger than in any real robot."""
        if self.name == "base_drift":
            return bool(np.abs(self.sizes).max() > _MAX_DRIFT_MM_S)
        bounds = _MAX_SIZE.get(self.name, _MAX_SIZE[""])
        return bool((np.abs(self.sizes) > [bounds[unit] for unit in robot.units]).any())

    def at_drives(self, robot, stops, zeros=0.0):
        """Errors (n, K) of the actuator positions; zeros (K,): zero offsets of the drives, which change the loads."""
        sizes = np.array(self.sizes)
        if self.name == "base_drift":
            return np.zeros_like(stops.drive)
        # encoders and screws err by the value that they read
        at = replace(stops, drive=stops.drive + zeros) if self.name == "drive_compliance" else stops
        return _AT_DRIVES[self.name](sizes, self.more, robot, at)

    def of_base(self, stops):
        """Translations (n, 3) of the robot relative to the instrument."""
        if self.name != "base_drift":
            return np.zeros((len(stops.drive), 3))
        return np.outer(stops.time_s - stops.time_s[0], self.sizes)

    def numbers(self, robot):
        """True parameter values by their names in the diagnosis."""
        if self.name == "base_drift":
            return dict(zip(("speed_x", "speed_y", "speed_z"), self.sizes, strict=True))
        stem = _STEMS.get(self.name)
        if stem is None:
            return {}
        unit = _UNITS.get(self.name)
        numbers = {f"{stem}{k}": size for k, size in enumerate(self.sizes, 1) if unit in (None, robot.units[k - 1])}
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
    "gain_error": "gain_error",
    "lead_error": "lead_error",
}
# unit of the drives at which a cause can act, where it is one of two
_UNITS = {"encoder_eccentricity": "rad", "gain_error": "rad", "lead_error": "mm"}


def _backlash(sizes, _more, _robot, stops):
    """A drive follows its motor once the backlash is crossed; until then friction holds it."""
    position, result = stops.drive[0].copy(), np.zeros_like(stops.drive)
    for k, commanded in enumerate(stops.drive):
        position = np.minimum(np.maximum(position, commanded - 0.5 * sizes), commanded + 0.5 * sizes)
        result[k] = position - commanded
    return result


def _wind_up(sizes, _more, robot, stops):
    """A compliant drive deflects in proportion to its load, which is that of the deflected robot."""
    deflected = np.zeros_like(stops.drive)
    for _ in range(_DEFLECTIONS):
        deflected = sizes * robot.loads(stops.drive + deflected, stops.payload_kg)
    return deflected


def _once_a_turn(sizes, more, _robot, stops):
    """The disc of an encoder is eccentric."""
    return sizes * np.sin(stops.drive + more["phase"])


def _waves(sizes, more, _robot, stops):
    """Periodic transmission error of a gear or screw; more["waves"]: rad of the wave per rad or mm."""
    return sizes * np.sin(more["waves"] * stops.drive + more["phase"])


def _local(sizes, more, _robot, stops):
    """A scale is damaged over a short part of a drive's travel."""
    return sizes * np.exp(-0.5 * ((stops.drive - more["at"]) / more["over"]) ** 2)


def _step(sizes, more, _robot, stops):
    """Two pieces of a scale were joined with an offset: beyond the joint all values have the same error."""
    return sizes * (stops.drive > more["at"])


def _in_proportion(sizes, _more, _robot, stops):
    """The ratio of a gear, belt or screw differs from the nominal one."""
    return sizes * stops.drive


_AT_DRIVES = {
    "backlash": _backlash,
    "drive_compliance": _wind_up,
    "encoder_eccentricity": _once_a_turn,
    "transmission_error": _waves,
    "drive_error_function": _local,
    "scale_step": _step,
    "gain_error": _in_proportion,
    "lead_error": _in_proportion,
}
# largest sizes by the unit of a drive, and of a drift
_MAX_SIZE = {
    "": {"rad": 5e-3, "mm": 0.5},
    "backlash": {"rad": 1e-2, "mm": 0.8},
    "drive_compliance": {"rad": 5e-7, "mm": 0.02},
    "gain_error": {"rad": 2e-2, "mm": 0.0},
    "lead_error": {"rad": 0.0, "mm": 1e-2},
}
_MAX_DRIFT_MM_S = 5e-3
# loads next to a singular pose change with the deflection; each repetition adds a power of that share
_DEFLECTIONS = 3
# causes that MuJoCo can simulate, with their names there
MUJOCO = {"backlash": "play", "drive_compliance": "actuator_stiffness"}
NAMES = (*_AT_DRIVES, "base_drift")


def fits(name, robot):
    """Whether a cause can act in a robot.

    Of cranks of parallel robots, which swing through small angles, a gain is the slope of an eccentricity.
    """
    return _UNITS.get(name) in (None, *robot.units) and not (name == "gain_error" and isinstance(robot, Rods))


def draw_cause(name, robot, generator):
    """A Cause with random ratios of its sizes, half of them at one drive alone."""
    count, spans = len(robot.units), robot.spans
    if name == "base_drift":
        return Cause(name, tuple(generator.standard_normal(3).tolist()))
    # waves per millimetre need drives of one unit
    unit = "rad" if name == "transmission_error" and "rad" in robot.units else _UNITS.get(name)
    acts = np.array([unit in (None, own) for own in robot.units])
    sizes = np.abs(generator.normal(1.0, 0.4, count)) * acts
    # 1 mm at a slide and 1 / 500 rad at a rotary drive displace a tool at half a metre alike
    sizes = np.where(np.array(robot.units) == "rad", sizes / 500.0, sizes)
    if name in ("gain_error", "lead_error"):
        sizes = sizes * generator.choice([-1.0, 1.0], count)
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
