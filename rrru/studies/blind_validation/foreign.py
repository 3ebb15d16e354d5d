"""Robots of files on a plant of the caller's choice: MuJoCo, or our own effect models for comparison. mm, rad.

A number gives the same robot on every plant. Only the gap that a fault makes depends on the plant.
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
from rrru.pipeline import setup
from rrru.seeds import stream
from rrru.simulation.driven import SETTLE_S
from rrru.simulation.tracker import Sees
from rrru.studies.blind_validation.box import draw_trajectories
from rrru.studies.blind_validation.faults import Fault, draw_fault, kind_of, kinds_of
from rrru.studies.blind_validation.models import MODELS
from rrru.studies.blind_validation.noise import NoiseModel, with_noise
from rrru.studies.blind_validation.plants import PLANTS
from rrru.studies.blind_validation.robots import Conditions, WithheldCampaign
from rrru.studies.blind_validation.verdicts import NONE, UNEXPLAINED

# gap over noise: detectable at all, and large enough for the user's own tracker
WEAKEST, STRONGEST = 0.7, 10.0
OFFSET_SD = {"rad": 0.002, "mm": 0.5}
DRAWS, _STEPS = 20, 2
# gap over noise at the level of rounding errors
_NOTHING = 1e-6
# slow enough that inertia stays near 1 % of the weight for robots that are measured in motion
_MOTION = {"speed_mm_s": 40.0, "acceleration_mm_s2": 40.0, "dwell_s": 60.0}
_PLAIN = {"reverse": False, "payload_kg": 0.0}
# about 190 points: forward and reverse, faster, with payload
_PASSES = (
    _PLAIN,
    _PLAIN | {"reverse": True},
    _PLAIN | {"trajectories": ["line_1", "line_2", "line_3"], "speed_mm_s": 120.0, "acceleration_mm_s2": 80.0},
    _PLAIN | {"trajectories": ["line_1", "spiral"], "payload_kg": 3.0},
)


@dataclass(frozen=True)
class FileConditions(Conditions):
    """Conditions of all robots of one file: also name of its entry in `robots:`, file, and platform in it."""

    name: str
    file: str
    platform: str

    @property
    def model(self):
        """Its workspace, and the places in its file where causes act."""
        return MODELS[Path(self.file).stem]

    @classmethod
    def from_parts(cls, parts, settings):
        """The conditions of one robot from its parts of the configuration and the settings of the check."""
        nominal, masses = parts["robot"], Masses(**parts["masses"])
        mjcf, platform = (nominal["dimensions"][key] for key in ("mjcf", "platform"))
        noise_mm, seed = settings["withheld"]["noise_mm"], settings["seed"]
        robot = setup.mechanism(nominal)
        return cls(robot, _MOTION, masses, noise_mm, seed, nominal["name"], mjcf, platform)

    def seen(self, measurements):
        """The nominal robot with the parameters that a measurement table observes."""
        return setup.as_measured(self.mechanism, measurements, tuple(self.model.targets))


@dataclass(frozen=True)
class FileRobot:
    """A robot of a file.

    file: its entry in `robots:`; plant: in PLANTS; trajectories: as in the configuration; offsets: of its drives (K,),
    then errors of its other parameters if any; acting: faults; oracle_chi2: reduction of the chi-square of its
    measurements by its true displacement, the size fitted; noise: fields of the NoiseModel that are not as stated;
    rests: it is measured at rest unless a cause shows in motion alone.
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
        """All acting causes."""
        return self.acting

    @property
    def truth(self):
        """The correct answer."""
        return "+".join(sorted(one.truth for one in self.acting)) or NONE

    @property
    def also_allowed(self):
        """Names allowed together with the correct answer: the library has no effect model of an unknown payload."""
        return {UNEXPLAINED} if any("load_kg" in one.more for one in self.acting) else set()

    @property
    def cause(self):
        """The acting causes, as the plant names them."""
        return "+".join(sorted(one.kind for one in self.acting)) or NONE

    def numbers(self, conditions):
        """True values of the library's parameters by effect and name."""
        return {name: values for one in self.acting for name, values in one.numbers(conditions.mechanism).items()}

    def plan(self, conditions):
        """Its campaign plan."""
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
            noise_free(self, conditions), NoiseModel(**self.noise), conditions.noise_mm, campaign.generator()
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
        """The robot from its JSON fields."""
        acting = tuple(map(Fault.from_mapping, section["acting"]))
        return cls(**(section | {"acting": acting, "offsets": tuple(section["offsets"])}))


def noise_free(robot, conditions):
    """Measurements of a robot without noise, or None where a pose is lost."""
    measurements, _ = replace(robot.campaign(conditions), noise_mm=0.0).run()
    return measurements if (measurements["status"] == "ok").all() else None


def residual(measurements, conditions):
    """Residual of a calibration (m, 3) on a measurement table."""
    return calibrate(select(measurements, conditions.seen(measurements), ["*"])).residual_mm


def draw(member, conditions):
    """The robot of a Member, see `rrru.studies.blind_validation.chunks`, and its measurements.

    Fault and trajectories are drawn again where the plant loses a pose or does not come to rest, or where the fault
    exceeds the bounds of its effect model. Where no draw of its kind succeeds the fault is of the next kind. Raises the
    last of these errors where there is no such kind.
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
    """The fault scaled to a strength on our own plant.

    Raises UnreachableError where a calibration absorbs it, where a pose is lost, or where that strength exceeds the
    bounds of its effect model.
    """
    if kind_of(fault.kind).effect_model is None:
        return fault
    still = residual(noise_free(replace(robot, plant="own", acting=()), conditions), conditions)
    for _ in range(_STEPS):
        measurements = noise_free(replace(robot, plant="own", acting=(fault,)), conditions)
        if measurements is None:
            raise UnreachableError(f"{robot.name}: {fault.kind} of {fault.sizes} loses a pose")
        gap = _rms(residual(measurements, conditions) - still) / conditions.noise_rms_mm
        if not gap > _NOTHING:
            raise UnreachableError(f"{robot.name}: a calibration absorbs {fault.kind} of {fault.sizes}")
        fault = fault.scaled(strength / gap)
        # far beyond its bounds no calibration fits, so that the simulation stops here
        if fault.scaled(0.5).beyond(conditions.mechanism):
            break
    if fault.beyond(conditions.mechanism):
        raise UnreachableError(f"{robot.name}: {fault.kind} of {fault.sizes} exceeds the bounds of its effect model")
    return fault


def as_driven(robot, conditions):
    """The robot with the true strength of its fault, and its measurements.

    The strength is the rms distance between the calibration residuals with and without the fault, over the noise rms.
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
    """Rms distance between the calibration residuals with and without all acting causes, over that of the noise.

    NaN where a pose is lost.
    """
    driven = [noise_free(variant, conditions) for variant in (robot, replace(robot, acting=()))]
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
