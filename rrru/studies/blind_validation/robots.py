"""Virtual robots of the check on withheld effects: their acting causes and campaigns. Lengths mm, angles rad."""

import json
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from rrru.calibration.calibrate import calibrate
from rrru.calibration.campaign_fit import select
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import from_config
from rrru.effects.protocol import ActiveEffect
from rrru.errors import FitError
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.seeds import stream
from rrru.simulation.virtual_robot import VirtualRobot
from rrru.studies.blind_validation.noise import NoiseModel, with_noise
from rrru.studies.blind_validation.outside import CAUSES, OUTSIDE
from rrru.studies.blind_validation.verdicts import PREFIX

# wide, so that no calibration ends at a bound
_WIDE = {"angle_rad": 0.5, "length_mm": 400.0}

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
class Conditions:
    """Conditions of all robots: nominal mechanism, motion as in the configuration, masses, noise per axis, seed."""

    mechanism: object
    motion: dict
    masses: Masses
    noise_mm: float
    seed: int

    @classmethod
    def from_config(cls, settings):
        """The conditions from the settings of a rule: robot, masses, motion, withheld.noise_mm, seed."""
        mechanism, masses = setup.mechanism(settings["robot"] | {"bounds": _WIDE}), Masses(**settings["masses"])
        return cls(mechanism, settings["motion"], masses, settings["withheld"]["noise_mm"], settings["seed"])

    @property
    def noise_rms_mm(self):
        """Rms distance of the noise."""
        return self.noise_mm * np.sqrt(3.0)

    def seen(self, _):
        """The nominal robot with the parameters that a measurement table observes."""
        return self.mechanism


class WithheldCampaign(setup.VirtualCampaign):
    """The campaign of one robot of the check."""

    def generator(self, *labels):
        """The robot's own stream for its noise."""
        return stream(self.seed, "withheld", "noise", self.name)


@dataclass(frozen=True)
class Acting:
    """One acting cause.

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

    @classmethod
    def from_mapping(cls, section):
        """The cause from its JSON fields."""
        return cls(**(section | {"coordinates": tuple(section["coordinates"])}))

    def scaled(self, factor):
        """The same cause with its coordinates multiplied by a factor."""
        return replace(self, coordinates=tuple((factor * np.array(self.coordinates)).tolist()))


@dataclass(frozen=True)
class Robot:
    """A robot of the check: kind of campaign, trajectories as in the configuration, deviations (7,), acting causes.

    background: causes that act in every robot and that the diagnosis need not find; noise: fields of the NoiseModel
    that are not as stated.
    """

    name: str
    kind: str
    trajectories: dict
    deviations: tuple
    acting: tuple = ()
    background: tuple = ()
    noise: dict = field(default_factory=dict)
    file = ""

    @property
    def causes(self):
        """All acting causes, the background last."""
        return self.acting + self.background

    def plan(self, conditions):
        """Its campaign plan."""
        return make_plan(from_config(self.trajectories), PASSES[self.kind], **conditions.motion)

    def campaign(self, conditions):
        """The virtual robot and its plan, or None where a parameter of an acting cause violates its bounds."""
        if not all(one.effect_model.parameters.hold(one.values) for one in self.causes):
            return None
        deviations = conditions.mechanism.parameters.mapping(self.deviations)
        # only r - R is identifiable; its whole error is given to r
        deviations["dr"] = deviations.pop("da")
        robot = VirtualRobot(
            conditions.mechanism,
            deviations,
            effects=tuple(
                ActiveEffect(one.effect_model, one.effect_model.parameters.mapping(one.values)) for one in self.causes
            ),
            masses=conditions.masses,
        )
        return WithheldCampaign(robot, self.plan(conditions), conditions.noise_mm, conditions.seed, self.name)

    def measured(self, conditions):
        """The measurement table that the diagnosis is given."""
        campaign = self.campaign(conditions)
        if not self.noise:
            return campaign.run()[0]
        noise = NoiseModel(**self.noise)
        return with_noise(noise_free(self, conditions), noise, conditions.noise_mm, campaign.generator())

    @property
    def truth(self):
        """The truth in words: names joined by +, none, or outside:<name>."""
        names = sorted(acting.effect for acting in self.acting)
        return "+".join(f"{PREFIX}:{name}" if name in OUTSIDE else name for name in names) or "none"

    @property
    def cause(self):
        """The acting causes, as the plant names them."""
        return self.truth

    def numbers(self, _):
        """True values of the library's parameters by effect and name."""
        return {one.effect: one.effect_model.parameters.mapping(one.values) for one in self.causes if not one.outside}

    def answer(self, conditions):
        """The robot's row of `withheld_answers`."""
        return {
            "robot": self.name,
            "kind": self.kind,
            "truth": self.truth,
            "truth_leg": max((acting.leg for acting in self.acting), default=0),
            "strength": true_gap_mm(self, conditions) / conditions.noise_rms_mm if self.causes else 0.0,
            "weakest": min((acting.strength for acting in self.acting), default=0.0),
            "drawn": json.dumps(asdict(self), sort_keys=True),
        }

    @classmethod
    def from_mapping(cls, section):
        """The robot from its JSON fields."""
        causes = {key: tuple(map(Acting.from_mapping, section[key])) for key in ("acting", "background")}
        return cls(**(section | causes | {"deviations": tuple(section["deviations"])}))


def noise_free(robot, conditions):
    """Measurements of a robot without noise, or None where a parameter violates its bounds or a pose is lost."""
    campaign = robot.campaign(conditions)
    if campaign is None:
        return None
    measurements, _ = replace(campaign, noise_mm=0.0).run()
    return measurements if (measurements["status"] == "ok").all() else None


def true_gap_mm(robot, conditions):
    """Rms residual distance of the calibration without noise, or None where the robot cannot drive its campaign."""
    measurements = noise_free(robot, conditions)
    if measurements is None:
        return None
    try:
        return calibrate(select(measurements, conditions.mechanism, ["*"])).rms_mm
    except FitError:
        return None
