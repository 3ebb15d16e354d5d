"""Virtual robots of the check on withheld effects: what acts in each, and its campaign. Lengths mm, angles rad."""

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
from rrru.seeds import stream
from rrru.simulation.virtual_robot import VirtualRobot
from rrru.studies import setup
from rrru.studies.blind_validation.noise import NoiseLaw, with_noise
from rrru.studies.blind_validation.outside import CAUSES, OUTSIDE
from rrru.studies.blind_validation.verdicts import PREFIX

# no calibration shall hit a bound
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
    """What all robots share: nominal mechanism, motion as in the configuration, masses, noise per axis, seed."""

    mechanism: object
    motion: dict
    masses: Masses
    noise_mm: float
    seed: int

    @classmethod
    def from_config(cls, settings):
        """The conditions from what a rule is told: robot, masses, motion, withheld.noise_mm, seed."""
        mechanism, masses = setup.mechanism(settings["robot"] | {"bounds": _WIDE}), Masses(**settings["masses"])
        return cls(mechanism, settings["motion"], masses, settings["withheld"]["noise_mm"], settings["seed"])

    @property
    def noise_rms_mm(self):
        """Rms distance of the noise."""
        return self.noise_mm * np.sqrt(3.0)

    def seen(self, _):
        """The nominal robot with the numbers that a measurement table tells."""
        return self.mechanism


class WithheldCampaign(setup.VirtualCampaign):
    """The campaign of one robot of the check."""

    def generator(self, *labels):
        """The robot's own stream for its noise."""
        return stream(self.seed, "withheld", "noise", self.name)


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
    def outside(self):
        """Whether the library does not hold it."""
        return self.effect in OUTSIDE

    @property
    def law(self):
        """The cause itself, known in its true shape alone."""
        law = CAUSES[self.effect]
        return replace(law, coordinates=replace(law.coordinates, shapes=(self.shape,)))

    @property
    def values(self):
        """Parameter values (p,)."""
        return self.law.coordinates.to_values(np.array(self.coordinates), self.shape)

    @classmethod
    def from_mapping(cls, section):
        """The cause of its fields, as JSON holds them."""
        return cls(**(section | {"coordinates": tuple(section["coordinates"])}))

    def scaled(self, factor):
        """The same cause, so many times as large."""
        return replace(self, coordinates=tuple((factor * np.array(self.coordinates)).tolist()))


@dataclass(frozen=True)
class Robot:
    """A robot of the check: kind of campaign, trajectories as in the configuration, deviations (7,), what acts.

    background: what acts besides as in every robot, no cause that is asked for; noise: fields of the NoiseLaw that are
    not as stated.
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
        """All that acts, the background last."""
        return self.acting + self.background

    def plan(self, conditions):
        """What it is told to do."""
        return make_plan(from_config(self.trajectories), PASSES[self.kind], **conditions.motion)

    def campaign(self, conditions):
        """The virtual robot and its plan, or None where a parameter of what acts breaks its bounds."""
        if not all(one.law.parameters.hold(one.values) for one in self.causes):
            return None
        deviations = conditions.mechanism.parameters.mapping(self.deviations)
        # of r - R, which alone is identifiable, r has the whole
        deviations["dr"] = deviations.pop("da")
        robot = VirtualRobot(
            conditions.mechanism,
            deviations,
            effects=tuple(ActiveEffect(one.law, one.law.parameters.mapping(one.values)) for one in self.causes),
            masses=conditions.masses,
        )
        return WithheldCampaign(robot, self.plan(conditions), conditions.noise_mm, conditions.seed, self.name)

    def measured(self, conditions):
        """The measurement table that the diagnosis is given."""
        campaign = self.campaign(conditions)
        if not self.noise:
            return campaign.run()[0]
        law = NoiseLaw(**self.noise)
        return with_noise(noise_free(self, conditions), law, conditions.noise_mm, campaign.generator())

    @property
    def truth(self):
        """The truth in words: names joined by +, none, or outside:<name>."""
        names = sorted(acting.effect for acting in self.acting)
        return "+".join(f"{PREFIX}:{name}" if name in OUTSIDE else name for name in names) or "none"

    @property
    def cause(self):
        """What acts, as a plant names it."""
        return self.truth

    def numbers(self, _):
        """True values of the library's parameters by effect and name."""
        return {one.effect: one.law.parameters.mapping(one.values) for one in self.causes if not one.outside}

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
        """The robot of its fields, as JSON holds them."""
        causes = {key: tuple(map(Acting.from_mapping, section[key])) for key in ("acting", "background")}
        return cls(**(section | causes | {"deviations": tuple(section["deviations"])}))


def noise_free(robot, conditions):
    """Measurements of a robot without noise, or None where a parameter breaks its bounds or a pose is lost."""
    campaign = robot.campaign(conditions)
    if campaign is None:
        return None
    measurements, _ = replace(campaign, noise_mm=0.0).run()
    return measurements if (measurements["status"] == "ok").all() else None


def true_gap_mm(robot, conditions):
    """Rms distance that the calibration leaves without noise, or None where the robot cannot drive its campaign."""
    measurements = noise_free(robot, conditions)
    if measurements is None:
        return None
    try:
        return calibrate(select(measurements, conditions.mechanism, ["*"])).rms_mm
    except FitError:
        return None
