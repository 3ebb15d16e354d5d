"""Causes that act in the robots of the check, each with the correct answer. Lengths mm, angles rad, times s.

`Acting` is an effect of the library or of OUTSIDE in a 3-RRRU, `Fault` a cause as an engineer names it in a robot of a
file. The causes in OUTSIDE are Effects like those of the library, but only the plant uses them: the correct verdict is
"unexplained". Their sizes and places are assumed.

The library has effect models of backlash, soft or slow servos, soft links, clearance and warming. A tilted base and an
unknown payload change only the gravity load. They reveal soft servos, so the drives' compliance is the correct answer.
(If the tracker were level and the base not, the frame would be the cause.) The length of one leg and a tilted axis are
parameters of a full calibration, not causes. A base on springs is a pedestal that rotates and does not translate. No
effect model of the library holds friction that grows with the square of the speed.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from rrru.effects.library import HOLDS, find, library
from rrru.effects.protocol import Effect, drive_parameters, leg_parameters, of_drives, plain_coordinates
from rrru.kinematics.legs import WORLD
from rrru.parameters import Parameter, ParameterSet
from rrru.robots.rrru3 import Rrru3
from rrru.studies.blind_validation.verdicts import NONE, PREFIX

# a rest this long ends a run
_REST_S = 10.0
_ANCHOR_MM = np.array([100.0, 900.0, 0.0])
_SLACK_MM = 1080.0
_PERIODS_S = (7.3, 19.0, 41.0)
_SHARES = (0.3, 0.5, 0.7)


# --- causes outside the library


def _shifted(motion, shift_mm):
    """The measured positions shifted by (n, 3)."""
    return motion.at({WORLD: np.concatenate([shift_mm, np.zeros_like(shift_mm)], axis=1)})


def _rehoming(motion, values):
    """The drives are homed before every run, with errors up to their switch's repeatability (rad)."""
    run = np.cumsum(np.diff(motion.time_s, prepend=motion.time_s[0]) > _REST_S)
    offset = np.random.default_rng(int(values[3])).uniform(-1.0, 1.0, (run[-1] + 1, 3))
    return motion.at_drives(values[:3] * offset[run])


def _tripod_sway(motion, values):
    """The tracker's tripod sways: a sine in time with an amplitude (mm) per axis."""
    return _shifted(motion, np.sin(2.0 * np.pi * motion.time_s / values[3])[:, None] * values[:3])


def _tracker_bump(motion, values):
    """The tracker is bumped once: after a fraction of the campaign's time its readings are shifted (mm) per axis."""
    passed = (motion.time_s - motion.time_s[0]) / np.ptp(motion.time_s)
    return _shifted(motion, (passed > values[3])[:, None] * values[:3])


def _cable_pull(motion, values):
    """A cable to a fixed anchor, slack when near, pulls the platform off like a spring: mm per mm of stretch."""
    reach = _ANCHOR_MM - motion.position_mm
    length = np.linalg.norm(reach, axis=1, keepdims=True)
    return _shifted(motion, values[0] * np.maximum(length - _SLACK_MM, 0.0) * reach / length)


def _make(contribution, parameters, typical, shapes=({},)):
    """The Effect of a contribution with its parameters, typical sizes of those that no shape fixes, and its shapes."""
    parameters = ParameterSet(parameters)
    coordinates = plain_coordinates(parameters, typical, shapes)
    return Effect(contribution.__name__.strip("_"), parameters, coordinates, contribution, ("time_s",))


def _axes(name, unit, limit):
    """Parameters along x, y and z."""
    return tuple(Parameter(f"{name}_{axis}", unit, 0.0, -limit, limit, "assumed") for axis in "xyz")


_REPEATABILITY = leg_parameters("assumed", ("repeatability", "rad", 0.0, 0.01))
_PATTERN = Parameter("pattern", "1", 1.0, 1.0, 1e6, "draw")
_PERIOD = Parameter("period", "s", 20.0, 1.0, 1e4, "assumed")
_YIELDING = Parameter("yielding", "mm/mm", 0.0, 0.0, 0.1, "assumed")
_BUMPED = Parameter("bumped", "1", 0.5, 0.0, 1.0, "assumed")

OUTSIDE = {
    cause.name: cause
    for cause in (
        _make(_rehoming, (*_REPEATABILITY, _PATTERN), 3e-4, tuple({"pattern": float(k)} for k in range(1, 9))),
        _make(_tripod_sway, (*_axes("amplitude", "mm", 5.0), _PERIOD), 0.1, tuple({"period": s} for s in _PERIODS_S)),
        _make(_tracker_bump, (*_axes("shift", "mm", 5.0), _BUMPED), 0.1, tuple({"bumped": at} for at in _SHARES)),
        _make(_cable_pull, (_YIELDING,), 1e-3),
    )
}
_LIBRARY = library(Rrru3())
# these campaigns cannot show them: no stops at points, no temperature recorded, all lengths calibrated
_UNSEEN = ("read_before_rest", "thermal_expansion", "tracker_scale")


def drawn_effects(known):
    """Effects by name of a robot's library that may be drawn as causes.

    An effect with others as special cases is a background and not drawn.
    """
    return {name: effect for name, effect in known.items() if name not in (*HOLDS, *_UNSEEN)}


# every effect, of the library and from outside it, that may act in a 3-RRRU of the check
EFFECTS = drawn_effects(_LIBRARY)
CAUSES = _LIBRARY | OUTSIDE


# --- causes of 3-RRRUs


@dataclass(frozen=True)
class Acting:
    """An effect of the library or of OUTSIDE that acts in a 3-RRRU.

    shape: values of the parameters that are not coordinates; coordinates (c,); leg: its single leg, or 0;
    strength: gap over noise.
    """

    effect: str
    shape: dict
    coordinates: tuple
    leg: int
    strength: float

    @property
    def outside(self):
        """Whether the library does not hold it."""
        return self.effect in OUTSIDE

    @property
    def effect_model(self):
        """The Effect with its true shape only."""
        effect = CAUSES[self.effect]
        return replace(effect, coordinates=replace(effect.coordinates, shapes=(self.shape,)))

    @property
    def values(self):
        """Parameter values (p,)."""
        return self.effect_model.coordinates.to_values(np.array(self.coordinates), self.shape)

    def numbers(self, _robot):
        """True values of the library's parameters by effect and name; empty for a cause outside the library."""
        return {} if self.outside else {self.effect: self.effect_model.parameters.mapping(self.values)}

    @classmethod
    def from_mapping(cls, section):
        """The cause from its JSON fields."""
        return cls(**(section | {"coordinates": tuple(section["coordinates"])}))

    def scaled(self, factor):
        """The same cause with its coordinates multiplied by a factor."""
        return replace(self, coordinates=tuple((factor * np.array(self.coordinates)).tolist()))


def draw_direction(name, coordinates, single, strength, generator):
    """A cause with random shape, legs and ratios of its coordinates, not yet scaled to its strength."""
    sizes = _draw_sizes(coordinates.typical, coordinates.positive, generator)
    shape = {key: _draw_value([shape[key] for shape in coordinates.shapes], generator) for key in coordinates.shapes[0]}
    per_leg = set(coordinates.legs.tolist()) == {1, 2, 3}
    leg = int(generator.integers(1, 4)) if single and per_leg and generator.random() < 1.0 / 3.0 else 0
    if leg:
        sizes = np.where(coordinates.legs == leg, sizes, 0.0)
    return Acting(name, shape, tuple(sizes.tolist()), leg, strength)


def _draw_sizes(typical, positive, generator):
    """Normal sizes (c,) about zero with s.d. typical (c,), without sign where positive (c,)."""
    sizes = typical * generator.standard_normal(len(typical))
    return np.where(positive, np.abs(sizes), sizes)


def draw_log_uniform(span, generator):
    """A positive number from a span, its logarithm uniform."""
    return float(np.exp(generator.uniform(*np.log(span))))


def _draw_value(tried, generator):
    """A value of a shape: one of at most two grid values of the library, else between its smallest and largest one."""
    known = sorted({float(value) for value in tried})
    low, high = known[0], known[-1]
    if len(known) <= 2:
        return float(generator.choice(known))
    if low > 0.0:
        return draw_log_uniform((low, high), generator)
    return float(generator.uniform(low, high))


# --- causes of robots of files

_FRICTION = {"rad": ("s^2/rad", 0.0, 1.0), "mm": ("s^2/mm", 0.0, 1e-2)}
_FRICTION_SOURCE = dict.fromkeys(_FRICTION, "friction over the servo's stiffness, assumed")
_FRICTION_SIZE = {"rad": 3e-3, "mm": 1e-5}


def _speed_friction(robot):
    """Friction that grows with the square of a drive's speed winds its servo up."""
    drives = robot.parts.drives
    parameters = ParameterSet(drive_parameters(drives, _FRICTION_SOURCE, ("friction", _FRICTION)))

    def held_back(motion, values):
        """Changes of the actuator values under frictions (K,)."""
        rate = np.nan_to_num(motion.drive_rate)
        return motion.at_drives(-values * rate * np.abs(rate))

    coordinates = plain_coordinates(parameters, of_drives(drives, _FRICTION_SIZE))
    return Effect("speed_friction", parameters, coordinates, held_back, ("drive_rate",))


def _leaning_base(robot):
    """The base rotates about its two horizontal axes under the moment of the whole weight."""
    effect = find("pedestal_compliance", robot)
    # the base rotates and does not translate
    typical = effect.coordinates.typical * [1.0, 1.0, 0.0, 0.0]
    positive = np.ones(len(typical), dtype=bool)
    return replace(effect, coordinates=replace(effect.coordinates, typical=typical, positive=positive))


@dataclass(frozen=True)
class Kind:
    """A kind of cause.

    effect_model: makes the Effect on our own plant from a robot, None where the cause is errors of geometric
    parameters; answer: name of the correct effect, empty where the calibration absorbs the cause, None where the
    library has no effect model of it; on: field of a Model that lists where it acts, empty for drives and the whole
    robot; typical: s.d. of such errors; more: further numbers by name, each with the interval that it is drawn from.
    """

    effect_model: Callable | None
    answer: str | None
    on: str = ""
    typical: float = 0.0
    more: dict = field(default_factory=dict)


def _named(name, on="", **more):
    """A kind for which the library has an effect model."""
    return Kind(partial(find, name), name, on, more=more)


_TILT = {"tilt_x_rad": (-0.03, 0.03), "tilt_y_rad": (-0.03, 0.03)}
KINDS = {
    "play": _named("backlash"),
    "soft_servo": _named("drive_compliance"),
    "slow_servo": _named("servo_lag"),
    "soft_link": _named("link_flexure", "links"),
    "clearance": _named("joint_clearance", "clearances"),
    "warming": _named("thermal_growth", "growth_mm", time_constant=(125.0, 500.0)),
    "soft_servo_on_a_slope": _named("drive_compliance", **_TILT),
    "soft_servo_under_a_load": _named("drive_compliance", load_kg=(0.5, 2.0)),
    "length": Kind(None, "", "lengths", 0.5),
    "tilted_axis": Kind(None, "", "tilts", 1e-3),
    "base_on_springs": Kind(_leaning_base, "pedestal_compliance"),
    "speed_friction": Kind(_speed_friction, None),
}
# causes outside the library that can act in every robot, by the name of their kind
OUTSIDE_OF_ANY = ("speed_friction", "tripod_sway", "tracker_bump")


def kind_of(name):
    """The Kind of a name in KINDS, of a cause in `OUTSIDE`, or of an effect of the library."""
    if name in OUTSIDE:
        return Kind(lambda _: OUTSIDE[name], None)
    return KINDS[name] if name in KINDS else _named(name)


# the robots of one model get these in turn
ORDER = (
    *("play", NONE, "soft_servo", "base_on_springs", "slow_servo", "length", NONE, "soft_link", "speed_friction"),
    *("clearance", "soft_servo_on_a_slope", NONE, "warming", "tilted_axis", "soft_servo_under_a_load"),
)


@dataclass(frozen=True)
class Fault:
    """A cause that acts in a robot of a file.

    sizes: (c,) in the coordinates of its effect model, or errors of the Model's list; more: further numbers by name;
    leg: number of the single place where it acts, or 0; strength: gap over noise.
    """

    kind: str
    sizes: tuple
    more: dict
    leg: int = 0
    strength: float = 0.0

    @classmethod
    def from_mapping(cls, section):
        """The fault from its JSON fields."""
        return cls(**(section | {"sizes": tuple(section["sizes"])}))

    @property
    def effect(self):
        """Its name as a part of a gap, empty where it makes no gap."""
        return self.kind if self.outside else kind_of(self.kind).answer

    @property
    def outside(self):
        """Whether the library has no effect model of it."""
        return kind_of(self.kind).answer is None

    @property
    def truth(self):
        """The correct answer in words."""
        return f"{PREFIX}:{self.kind}" if self.outside else kind_of(self.kind).answer or NONE

    def scaled(self, factor):
        """The same fault with its sizes multiplied by a factor."""
        return replace(self, sizes=tuple((factor * np.array(self.sizes)).tolist()))

    def moves(self, robot):
        """Whether it shows only while the robot moves; all others are measured at rest."""
        make_effect = kind_of(self.kind).effect_model
        return bool(make_effect and "drive_rate" in make_effect(robot).needs)

    def beyond(self, robot):
        """Whether it exceeds the bounds of the effect model that is the correct answer."""
        kind = kind_of(self.kind)
        return bool(
            kind.effect_model and kind.answer and (np.abs(self.sizes) > kind.effect_model(robot).coordinates.most).any()
        )

    def values(self, robot):
        """Its Effect on a robot, and the effect's parameter values by name."""
        effect = kind_of(self.kind).effect_model(robot)
        shape = {name: self.more.get(name, value) for name, value in effect.coordinates.shapes[0].items()}
        return effect, effect.parameters.mapping(effect.coordinates.to_values(np.array(self.sizes), shape))

    def numbers(self, robot):
        """True values of the library's parameters by effect and name; empty where the fault has no such values."""
        if not (kind_of(self.kind).effect_model and kind_of(self.kind).answer) or "load_kg" in self.more:
            return {}
        effect, values = self.values(robot)
        return {effect.name: values}


def kinds_of(model, robot):
    """The kinds of causes in ORDER that a robot of a Model can have."""
    return tuple(kind for kind in ORDER if kind == NONE or _fits(KINDS[kind], model, robot))


def _fits(kind, model, robot):
    """Whether a robot has a place for a kind, and its library an effect model."""
    return (not kind.on or len(getattr(model, kind.on)) > 0) and (
        not kind.effect_model or kind.effect_model(robot) is not None
    )


def draw_fault(name, model, robot, generator):
    """A fault of a kind with random ratios of its sizes; a third of those with several places act at one only."""
    kind = KINDS[name]
    if kind.effect_model:
        coordinates = kind.effect_model(robot).coordinates
        typical, positive = coordinates.typical, coordinates.positive
        several = bool(coordinates.legs.any())
    else:
        typical = np.full(len(getattr(model, kind.on)), kind.typical)
        positive, several = np.zeros(len(typical), dtype=bool), True
    sizes = _draw_sizes(typical, positive, generator)
    leg = int(generator.integers(1, len(sizes) + 1)) if several and generator.random() < 1.0 / 3.0 else 0
    if leg:
        sizes = np.where(np.arange(1, len(sizes) + 1) == leg, sizes, 0.0)
    more = {key: float(generator.uniform(*span)) for key, span in kind.more.items()}
    return Fault(name, tuple(sizes.tolist()), more, leg)
