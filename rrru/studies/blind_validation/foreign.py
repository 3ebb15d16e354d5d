"""Robots of files that are driven by a plant of the caller's choice: MuJoCo, or our own laws for comparison. mm, rad.

The same number is the same robot on every plant, but that each plant makes its own gap of the fault.
"""

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from rrru.calibration.calibrate import calibrate
from rrru.calibration.campaign_fit import select
from rrru.campaign import measurements as rows
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import from_config
from rrru.errors import SimulationError, UnreachableError
from rrru.kinematics.dynamics import Masses
from rrru.seeds import stream
from rrru.simulation.driven import SETTLE_S
from rrru.simulation.tracker import Sees
from rrru.studies import setup
from rrru.studies.blind_validation.box import draw_trajectories
from rrru.studies.blind_validation.faults import Fault, draw_fault, kind_of, kinds_of
from rrru.studies.blind_validation.models import MODELS
from rrru.studies.blind_validation.noise import NoiseLaw, with_noise
from rrru.studies.blind_validation.plants import PLANTS
from rrru.studies.blind_validation.robots import Conditions, WithheldCampaign
from rrru.studies.blind_validation.verdicts import NONE, UNEXPLAINED

# what can be seen at all, and what an own tracker would find
WEAKEST, STRONGEST = 0.7, 10.0
OFFSET_SD = {"rad": 0.002, "mm": 0.5}
DRAWS, _STEPS = 20, 2
# a gap over the noise that is rounding
_NOTHING = 1e-6
# so slow that inertia, of those that are read as they move, stays about a hundredth of the weight
_MOTION = {"speed_mm_s": 40.0, "acceleration_mm_s2": 40.0, "dwell_s": 60.0}
_PLAIN = {"reverse": False, "payload_kg": 0.0}
# some 190 points: there and back, faster, loaded
_PASSES = (
    _PLAIN,
    _PLAIN | {"reverse": True},
    _PLAIN | {"trajectories": ["line_1", "line_2", "line_3"], "speed_mm_s": 120.0, "acceleration_mm_s2": 80.0},
    _PLAIN | {"trajectories": ["line_1", "spiral"], "payload_kg": 3.0},
)


@dataclass(frozen=True)
class FileConditions(Conditions):
    """What all robots of one file share: beside the rest name of its entry in `robots:`, file, and platform in it."""

    name: str
    file: str
    platform: str

    @property
    def model(self):
        """Where it goes, and where causes act in its file."""
        return MODELS[Path(self.file).stem]

    @classmethod
    def from_parts(cls, parts, settings):
        """The conditions of one robot from its parts of the configuration, and what all share."""
        nominal, masses = parts["robot"], Masses(**parts["masses"])
        told = {key: nominal["dimensions"][key] for key in ("mjcf", "platform")}
        noise_mm, seed = settings["withheld"]["noise_mm"], settings["seed"]
        robot = setup.mechanism(nominal)
        return cls(robot, _MOTION, masses, noise_mm, seed, nominal["name"], told["mjcf"], told["platform"])

    def seen(self, measurements):
        """The nominal robot with the numbers that a measurement table tells."""
        return setup.as_measured(self.mechanism, measurements, tuple(self.model.targets))


@dataclass(frozen=True)
class FileRobot:
    """A robot of a file: the file's entry in `robots:`, plant, trajectories as in the configuration, offsets of its
    drives (K,) and errors of its other numbers if any, the faults if any.

    oracle_chi2: what its own displacement, the size fitted, takes off the chi-square of its measurements; noise: fields
    of the NoiseLaw that are not as stated; rests: it is read at rest unless what acts shows in motion alone.
    """

    name: str
    file: str
    plant: str
    trajectories: dict
    offsets: tuple
    acting: tuple = ()
    oracle_chi2: float = 0.0
    noise: dict = field(default_factory=dict)
    rests: bool = True
    kind = "full"
    background = ()

    @property
    def causes(self):
        """All that acts."""
        return self.acting

    @property
    def truth(self):
        """The right answer."""
        return "+".join(sorted(one.truth for one in self.acting)) or NONE

    @property
    def beside(self):
        """What may be named beside the right answer: a load that nobody told of is no law of the library."""
        return {UNEXPLAINED} if any("load_kg" in one.more for one in self.acting) else set()

    @property
    def cause(self):
        """What acts, in the plant's words."""
        return "+".join(sorted(one.kind for one in self.acting)) or NONE

    def numbers(self, conditions):
        """True values of the library's parameters by effect and name."""
        return {name: values for one in self.acting for name, values in one.numbers(conditions.mechanism).items()}

    def plan(self, conditions):
        """What it is told to do."""
        return make_plan(from_config(self.trajectories), _PASSES, **conditions.motion)

    def campaign(self, conditions):
        """The robot on its plant, with its plan."""
        robot = PLANTS[self.plant](conditions, self.offsets, *self.acting)
        sees = Sees(conditions.model.targets)
        plan, noise_mm = self.plan(conditions), conditions.noise_mm
        if self.rests and not any(one.moves(conditions.mechanism) for one in self.acting):
            plan = plan.resting(SETTLE_S)
        return WithheldCampaign(robot, plan, noise_mm, conditions.seed, self.name, sees=sees)

    def measured(self, conditions):
        """The measurement table that the diagnosis is given."""
        campaign = self.campaign(conditions)
        if not self.noise:
            return campaign.run()[0]
        return with_noise(
            noise_free(self, conditions), NoiseLaw(**self.noise), conditions.noise_mm, campaign.generator()
        )

    def answer(self, conditions):
        """The robot's row of `withheld_answers`."""
        strengths = [one.strength for one in self.acting]
        strength = gap_over_noise(self, conditions) if len(strengths) > 1 else max(strengths, default=0.0)
        return {
            "robot": self.name,
            "kind": self.kind,
            "truth": self.truth,
            "truth_leg": max((one.leg for one in self.acting), default=0),
            "strength": strength,
            "weakest": min(strengths, default=0.0),
            "drawn": json.dumps(asdict(self), sort_keys=True),
        }

    @classmethod
    def from_mapping(cls, section):
        """The robot of its fields, as JSON holds them."""
        acting = tuple(map(Fault.from_mapping, section["acting"]))
        return cls(**(section | {"acting": acting, "offsets": tuple(section["offsets"])}))


def noise_free(robot, conditions):
    """Measurements of a robot without noise, or None where a pose is lost."""
    measurements, _ = replace(robot.campaign(conditions), noise_mm=0.0).run()
    return measurements if (measurements["status"] == "ok").all() else None


def residual(measurements, conditions):
    """What a calibration leaves (m, 3) of a measurement table."""
    return calibrate(select(measurements, conditions.seen(measurements), ["*"])).residual_mm


def draw(member, conditions):
    """The robot of a Member, see `rrru.studies.blind_validation.chunks`, and its measurements.

    A fault that the plant cannot drive, because a pose is lost or nothing comes to rest, or that nobody's robot has, is
    drawn again, and with it the trajectories; where none of its kind can be driven it is one of the next kind. Raises
    the last of these errors where there is no such kind.
    """
    generator = stream(conditions.seed, "withheld", "files", conditions.name, member.number)
    offsets = [OFFSET_SD[unit] * generator.standard_normal() for unit in conditions.mechanism.parts.units]
    trajectories = draw_trajectories(generator, conditions)
    robot = FileRobot(member.name, member.file, member.check, trajectories, tuple(offsets))
    kinds = kinds_of(conditions.model, conditions.mechanism)
    for step in range(len(kinds)):
        kind = kinds[(member.number + step) % len(kinds)]
        if kind == NONE:
            return robot, robot.measured(conditions)
        for _ in range(DRAWS):
            fault = draw_fault(kind, conditions.model, conditions.mechanism, generator)
            strength = float(np.exp(generator.uniform(*np.log([WEAKEST, STRONGEST]))))
            try:
                return as_driven(replace(robot, acting=(sized(robot, fault, strength, conditions),)), conditions)
            except (SimulationError, UnreachableError) as error:
                failed = error
            robot = replace(robot, trajectories=draw_trajectories(generator, conditions))
    raise failed


def sized(robot, fault, strength, conditions):
    """A fault of a strength on our own plant, where a calibration does not take it up.

    Raises UnreachableError where none has that strength, or one only that is larger than the library has causes.
    """
    if kind_of(fault.kind).law is None:
        return fault
    still = residual(noise_free(replace(robot, plant="own", acting=()), conditions), conditions)
    for _ in range(_STEPS):
        measurements = noise_free(replace(robot, plant="own", acting=(fault,)), conditions)
        if measurements is None:
            raise UnreachableError(f"{robot.name}: {fault.kind} of {fault.sizes} loses a pose")
        gap = _rms(residual(measurements, conditions) - still) / conditions.noise_rms_mm
        if not gap > _NOTHING:
            raise UnreachableError(f"{robot.name}: a calibration takes up {fault.kind} of {fault.sizes}")
        fault = fault.scaled(strength / gap)
        # far beyond its bounds it is not simulated: no calibration fits such readings
        if fault.scaled(0.5).beyond(conditions.mechanism):
            break
    if fault.beyond(conditions.mechanism):
        raise UnreachableError(f"{robot.name}: {fault.kind} of {fault.sizes} is more than its law allows")
    return fault


def as_driven(robot, conditions):
    """A robot with the strength that its fault truly has, and its measurements.

    The strength is the rms distance between what a calibration leaves with the fault and without, over the noise's.
    """
    campaign = robot.campaign(conditions)
    measurements, truth = campaign.run()
    exact = rows.vector_columns("measured", truth[[f"true_{axis}_mm" for axis in "xyz"]].to_numpy())
    still = noise_free(replace(robot, acting=()), conditions)
    left = residual(measurements.assign(**exact), conditions) - residual(still, conditions)
    (fault,) = robot.acting
    fault = replace(fault, strength=float(_rms(left) / conditions.noise_rms_mm))
    read = residual(measurements, conditions) - residual(still, conditions)
    chi2 = float((left * read).sum() ** 2 / (left**2).sum() / conditions.noise_mm**2) if left.any() else 0.0
    return replace(robot, acting=(fault,), oracle_chi2=chi2), measurements


def gap_over_noise(robot, conditions):
    """Rms distance between what a calibration leaves of a robot with all that acts and without, over the noise's.

    NaN where a pose is lost.
    """
    driven = [noise_free(one, conditions) for one in (robot, replace(robot, acting=()))]
    if any(measurements is None for measurements in driven):
        return np.nan
    acting, still = (residual(measurements, conditions) for measurements in driven)
    return float(_rms(acting - still) / conditions.noise_rms_mm)


def _rms(residual_mm):
    """Root of the mean square of distances (m, 3)."""
    return float(np.sqrt((residual_mm**2).sum(axis=1).mean()))


def fresh(robot, conditions):
    """The same robot on other lines and another spiral of the same region."""
    generator = stream(conditions.seed, "withheld", "files fresh", robot.name)
    return replace(robot, trajectories=draw_trajectories(generator, conditions))
