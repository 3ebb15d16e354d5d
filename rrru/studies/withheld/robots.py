"""The virtual robots of the check on withheld effects: what acts in them, what they are told to do, what is measured.
Lengths mm, angles rad.
"""

import json
from dataclasses import asdict, dataclass, replace

import numpy as np

from rrru.campaign import measurements as rows
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import from_config
from rrru.effects.effect import ActiveEffect
from rrru.effects.library import EFFECTS
from rrru.errors import FitError
from rrru.fit.least_squares import least_squares
from rrru.fit.residuals import Residuals
from rrru.plant.virtual_robot import VirtualRobot
from rrru.robots.protocol import make_mechanism
from rrru.seeds import stream
from rrru.studies.withheld.outside import OUTSIDE, PREFIX

NOISE_MM = 0.02
NOISE_RMS_MM = NOISE_MM * np.sqrt(3.0)
_SPEED_MM_S, _ACCELERATION_MM_S2, _DWELL_S = 80.0, 40.0, 60.0
_WIDE_RAD, _WIDE_MM = 0.5, 400.0

_PLAIN = {"reverse": False, "payload_kg": 0.0}
_SOME = {"trajectories": ["line_1", "line_2", "line_3", "spiral"]}
_AGAIN = _PLAIN | {"trajectories": ["line_1"]}
# the paper drives every trajectory once; the full campaign adds reverse runs, a higher speed, a payload and repeats
PASSES = {
    "paper": (_PLAIN,),
    "full": (
        _PLAIN,
        _PLAIN | {"reverse": True},
        _PLAIN | _SOME | {"speed_mm_s": 300.0, "acceleration_mm_s2": 400.0},
        _PLAIN | _SOME | {"payload_kg": 5.0},
        _AGAIN,
        _AGAIN,
    ),
}


@dataclass(frozen=True)
class Acting:
    """One cause that acts.

    shape: values of the parameters that are no coordinates; coordinates (c,); leg: the one that it is on, or 0;
    strength: gap over noise.
    """

    effect: str
    shape: dict
    coordinates: tuple
    leg: int
    strength: float

    @property
    def law(self):
        """The cause itself, known in its true shape alone."""
        law = EFFECTS[self.effect] if self.effect in EFFECTS else OUTSIDE[self.effect]
        return replace(law, coordinates=replace(law.coordinates, shapes=(self.shape,)))

    @property
    def values(self):
        """Parameter values (p,)."""
        return self.law.coordinates.to_values(np.array(self.coordinates), self.shape)

    @property
    def active(self):
        """The cause with its parameter values, or None where these break their bounds."""
        law, values = self.law, self.values
        return ActiveEffect(law, law.parameters.mapping(values)) if law.parameters.hold(values) else None

    def scaled(self, factor):
        """The same cause, so many times as large."""
        return replace(self, coordinates=tuple((factor * np.array(self.coordinates)).tolist()))


@dataclass(frozen=True)
class Robot:
    """A robot of the check: its campaign's kind and trajectories (as in the configuration), its seven errors, and what
    acts.
    """

    name: str
    kind: str
    trajectories: dict
    errors: tuple
    acting: tuple = ()

    @property
    def plan(self):
        """What it is told to do."""
        return make_plan(from_config(self.trajectories), PASSES[self.kind], _SPEED_MM_S, _ACCELERATION_MM_S2, _DWELL_S)

    def virtual(self, mechanism):
        """The virtual robot, or None where a parameter breaks its bounds."""
        active = tuple(acting.active for acting in self.acting)
        if None in active:
            return None
        errors = dict(zip(("dtheta1", "dtheta2", "dtheta3", "dL1", "dL2", "dL3", "dr"), self.errors, strict=True))
        return VirtualRobot(mechanism=mechanism, deviations=errors, effects=active)

    def to_json(self):
        """The robot as text."""
        return json.dumps(asdict(self), sort_keys=True)

    @classmethod
    def from_json(cls, text):
        """The robot of a text of `to_json`."""
        section = json.loads(text)
        acting = tuple(Acting(**(one | {"coordinates": tuple(one["coordinates"])})) for one in section.pop("acting"))
        return cls(**(section | {"errors": tuple(section["errors"]), "acting": acting}))


def nominal(robots):
    """The nominal robot of the configuration's `robots`, its errors free of bounds that a calibration could hit."""
    return make_mechanism("rrru3", robots.get("rrru3", {}), angle_limit_rad=_WIDE_RAD, length_limit_mm=_WIDE_MM)


def truth_of(robot):
    """The truth in words: names joined by +, none, or outside:<name>."""
    names = sorted(acting.effect for acting in robot.acting)
    return "+".join(f"{PREFIX}:{name}" if name in OUTSIDE else name for name in names) or "none"


def answer(robot, mechanism):
    """The robot's row of `withheld_answers`."""
    return {
        "robot": robot.name,
        "kind": robot.kind,
        "truth": truth_of(robot),
        "leg": max((acting.leg for acting in robot.acting), default=0),
        "strength": true_gap_mm(robot, mechanism) / NOISE_RMS_MM if robot.acting else 0.0,
        "weakest": min((acting.strength for acting in robot.acting), default=0.0),
        "drawn": robot.to_json(),
    }


def simulate(robot, mechanism, noise_mm, generator):
    """Measurements and truth of a robot as frames, or None where a parameter breaks its bounds or a pose is lost."""
    virtual = robot.virtual(mechanism)
    if virtual is None:
        return None
    measurements, truth = virtual.run(robot.plan, noise_mm, generator)
    return (measurements, truth) if (measurements["status"] == "ok").all() else None


def measure(robot, seed, mechanism):
    """Measurements of a robot as a frame, with noise from its own stream."""
    measurements, _ = simulate(robot, mechanism, NOISE_MM, stream(seed, "withheld", "noise", robot.name))
    return measurements


def true_gap_mm(robot, mechanism):
    """Rms distance that the calibration leaves without noise, or None where the robot cannot drive its campaign."""
    driven = simulate(robot, mechanism, 0.0, np.random.default_rng(0))
    if driven is None:
        return None
    measurements, _ = driven
    residuals = Residuals(
        mechanism, rows.actuators(measurements), rows.measured(measurements), rows.command(measurements)
    )
    try:
        return least_squares(residuals).rms_mm
    except FitError:
        return None
