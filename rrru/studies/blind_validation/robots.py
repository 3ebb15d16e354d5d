"""Virtual robots of the check on withheld effects: conditions, acting causes, plants, campaigns. mm, rad, N, kg.

Two kinds: 3-RRRUs, which our own effect models simulate, and robots of files on a plant of the caller's choice: MuJoCo,
or our own effect models for comparison. A number gives the same robot of a file on every plant; only the gap that a
fault makes depends on the plant.
"""

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.calibration.calibrate import calibrate
from rrru.calibration.campaign_fit import select
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import from_config
from rrru.effects.protocol import ActiveEffect
from rrru.errors import FitError
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.seeds import stream
from rrru.simulation.driven import SETTLE_S
from rrru.simulation.tracker import Sees
from rrru.simulation.virtual_robot import VirtualRobot
from rrru.studies.blind_validation.causes import KINDS, OUTSIDE, Acting, Fault, kind_of
from rrru.studies.blind_validation.models import MODELS
from rrru.studies.blind_validation.noise import NoiseModel, with_noise
from rrru.studies.blind_validation.verdicts import NONE, PREFIX, UNEXPLAINED

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
# of robots of files, about 190 points: forward and reverse, faster, with payload
_FILE_PASSES = (
    _PLAIN,
    _PLAIN | {"reverse": True},
    _PLAIN | {"trajectories": ["line_1", "line_2", "line_3"], "speed_mm_s": 120.0, "acceleration_mm_s2": 80.0},
    _PLAIN | {"trajectories": ["line_1", "spiral"], "payload_kg": 3.0},
)
# slow enough that inertia stays near 1 % of the weight for robots that are measured in motion
_FILE_MOTION = {"speed_mm_s": 40.0, "acceleration_mm_s2": 40.0, "dwell_s": 60.0}
# servo stiffnesses at which friction shows and weight does not, in N mm/rad or N/mm
_STIFF = {"rad": 4e9, "mm": 2e3}


# --- conditions


@dataclass(frozen=True)
class Conditions:
    """Conditions of all robots of one kind: nominal mechanism, motion, masses, noise per axis, seed.

    Of robots of a file also the name of its entry in `robots:`, file, and platform in it.
    """

    mechanism: object
    motion: dict
    masses: Masses
    noise_mm: float
    seed: int
    name: str = ""
    file: str = ""
    platform: str = ""

    @classmethod
    def from_config(cls, settings):
        """The conditions from the settings of a rule: robot, masses, motion, withheld.noise_mm, seed."""
        mechanism, masses = setup.mechanism(settings["robot"] | {"bounds": _WIDE}), Masses(**settings["masses"])
        return cls(mechanism, settings["motion"], masses, settings["withheld"]["noise_mm"], settings["seed"])

    @classmethod
    def of_file(cls, parts, settings):
        """The conditions of one robot of a file from its parts of the configuration and the settings of the check."""
        nominal, masses = parts["robot"], Masses(**parts["masses"])
        named = nominal["name"], *(nominal["dimensions"][key] for key in ("mjcf", "platform"))
        noise_mm, seed = settings["withheld"]["noise_mm"], settings["seed"]
        return cls(setup.mechanism(nominal), _FILE_MOTION, masses, noise_mm, seed, *named)

    @property
    def model(self):
        """Workspace of a robot of a file, and the places in its file where causes act; None of a 3-RRRU."""
        return MODELS[Path(self.file).stem] if self.file else None

    @property
    def noise_rms_mm(self):
        """Rms distance of the noise."""
        return self.noise_mm * np.sqrt(3.0)

    def seen(self, measurements):
        """The nominal robot with the parameters that a measurement table observes."""
        if self.model is None:
            return self.mechanism
        return setup.as_measured(self.mechanism, measurements, tuple(self.model.targets))


def all_conditions(settings):
    """Conditions by the entry in `robots:` of a file, and with an empty name that of our own 3-RRRU."""
    files = settings["files"].items()
    own = Conditions.from_config(settings)
    return {"": own} | {name: Conditions.of_file(parts, settings) for name, parts in files}


# --- robots


class WithheldCampaign(setup.VirtualCampaign):
    """The campaign of one robot of the check."""

    def generator(self, *labels):
        """The robot's own stream for its noise."""
        return stream(self.seed, "withheld", "noise", self.name)


class WithheldRobot:
    """What 3-RRRUs and robots of files share.

    name; kind: of campaign; trajectories: as in the configuration; acting: causes; background: causes that act in every
    robot and that the diagnosis need not find; noise: fields of the NoiseModel that are not as stated.
    """

    @property
    def causes(self):
        """All acting causes, the background last."""
        return self.acting + self.background

    def numbers(self, conditions):
        """True values of the library's parameters by effect and name."""
        return {name: values for one in self.causes for name, values in one.numbers(conditions.mechanism).items()}

    def plan(self, conditions):
        """Its campaign plan."""
        return make_plan(from_config(self.trajectories), self.passes, **conditions.motion)

    def measured(self, conditions):
        """The measurement table that the diagnosis is given."""
        campaign = self.campaign(conditions)
        if not self.noise:
            return campaign.run()[0]
        noise = NoiseModel(**self.noise)
        return with_noise(noise_free(self, conditions), noise, conditions.noise_mm, campaign.generator())

    def answer(self, conditions):
        """The robot's row of `withheld_answers`."""
        return {
            "robot": self.name,
            "kind": self.kind,
            "truth": self.truth,
            "truth_leg": max((one.leg for one in self.acting), default=0),
            "strength": self.strength(conditions),
            "weakest": min((one.strength for one in self.acting), default=0.0),
            "drawn": json.dumps(asdict(self), sort_keys=True),
        }


@dataclass(frozen=True)
class Robot(WithheldRobot):
    """A 3-RRRU of the check; deviations (7,)."""

    name: str
    kind: str
    trajectories: dict
    deviations: tuple
    acting: tuple = ()
    background: tuple = ()
    noise: dict = field(default_factory=dict)
    file = ""

    @property
    def passes(self):
        """Passes of its campaign."""
        return PASSES[self.kind]

    def campaign(self, conditions):
        """The virtual robot and its plan, or None where a parameter of an acting cause violates its bounds."""
        if not all(one.effect_model.parameters.contains(one.values) for one in self.causes):
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

    @property
    def truth(self):
        """The truth in words: names joined by +, none, or outside:<name>."""
        names = sorted(acting.effect for acting in self.acting)
        return "+".join(f"{PREFIX}:{name}" if name in OUTSIDE else name for name in names) or NONE

    @property
    def cause(self):
        """The acting causes, as the plant names them."""
        return self.truth

    def strength(self, conditions):
        """Gap over noise of all causes together."""
        return true_gap_mm(self, conditions) / conditions.noise_rms_mm if self.causes else 0.0

    @classmethod
    def from_mapping(cls, section):
        """The robot from its JSON fields."""
        causes = {key: tuple(map(Acting.from_mapping, section[key])) for key in ("acting", "background")}
        return cls(**(section | causes | {"deviations": tuple(section["deviations"])}))


@dataclass(frozen=True)
class FileRobot(WithheldRobot):
    """A robot of a file.

    file: its entry in `robots:`; plant: in PLANTS; offsets: of its drives (K,), then errors of its other parameters if
    any; oracle_chi2: reduction of the chi-square of its measurements by its true displacement, the size fitted; rests:
    it is measured at rest unless a cause shows in motion alone.
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
    passes = _FILE_PASSES

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

    def campaign(self, conditions):
        """The robot on its plant, with its plan."""
        robot = PLANTS[self.plant](conditions, self.offsets, *self.acting)
        sees = Sees(conditions.model.targets)
        plan, noise_mm = self.plan(conditions), conditions.noise_mm
        if self.rests and not any(one.moves(conditions.mechanism) for one in self.acting):
            plan = plan.resting(SETTLE_S)
        return WithheldCampaign(robot, plan, noise_mm, conditions.seed, self.name, sees=sees)

    def strength(self, conditions):
        """Gap over noise of all causes together."""
        if len(self.acting) > 1:
            return gap_over_noise(self, conditions)
        return max((one.strength for one in self.acting), default=0.0)

    @classmethod
    def from_mapping(cls, section):
        """The robot from its JSON fields."""
        acting = tuple(map(Fault.from_mapping, section["acting"]))
        return cls(**(section | {"acting": acting, "offsets": tuple(section["offsets"])}))


def robot_of(text):
    """The robot of the column `drawn` of `withheld_answers`."""
    section = json.loads(text)
    return (FileRobot if "plant" in section else Robot).from_mapping(section)


# --- gaps


def noise_free(robot, conditions):
    """Measurements of a robot without noise, or None where a parameter violates its bounds or a pose is lost."""
    campaign = robot.campaign(conditions)
    if campaign is None:
        return None
    measurements, _ = replace(campaign, noise_mm=0.0).run()
    return measurements if (measurements["status"] == "ok").all() else None


def _calibration(measurements, conditions):
    """A calibration on all points of a measurement table."""
    return calibrate(select(measurements, conditions.seen(measurements), ["*"]))


def true_gap_mm(robot, conditions):
    """Rms residual distance of the calibration without noise, or None where the robot cannot drive its campaign."""
    measurements = noise_free(robot, conditions)
    if measurements is None:
        return None
    try:
        return _calibration(measurements, conditions).rms_mm
    except FitError:
        return None


def residual(measurements, conditions):
    """Residual of a calibration (m, 3) on a measurement table."""
    return _calibration(measurements, conditions).residual_mm


def gap_over_noise(robot, conditions):
    """Rms distance between the calibration residuals with and without all acting causes, over that of the noise.

    NaN where a pose is lost.
    """
    driven = [noise_free(variant, conditions) for variant in (robot, replace(robot, acting=()))]
    if any(measurements is None for measurements in driven):
        return np.nan
    acting, still = (residual(measurements, conditions) for measurements in driven)
    return float(rms(acting - still) / conditions.noise_rms_mm)


def rms(residual_mm):
    """Root of the mean square of distances (m, 3)."""
    return float(np.sqrt((residual_mm**2).sum(axis=1).mean()))


# --- plants of robots of files


def own_plant(conditions, offsets, *faults):
    """The VirtualRobot of a file with Faults.

    offsets: errors of its first candidate parameters; the (K,) of the drives come first.
    """
    robot, masses, effects = conditions.mechanism, conditions.masses, []
    deviations = {one.name: offset for one, offset in zip(robot.candidates, offsets, strict=False)}
    for fault in faults:
        kind = kind_of(fault.kind)
        if kind.effect_model:
            effects.append(ActiveEffect(*fault.values(conditions.mechanism)))
        else:
            for error, size in zip(getattr(conditions.model, kind.on), fault.sizes, strict=True):
                deviations |= {number: deviations.get(number, 0.0) + size for _, number in error}
        if "load_kg" in fault.more:
            masses = replace(masses, platform_kg=masses.platform_kg + fault.more["load_kg"])
        if "tilt_x_rad" in fault.more:
            robot = replace(robot, up=tuple(_turned(fault).apply(robot.up).tolist()))
    return VirtualRobot(robot, deviations, effects=tuple(effects), masses=masses)


def _turned(fault):
    """Rotation of the direction of gravity in the frame of a base that is not level."""
    return Rotation.from_rotvec([fault.more["tilt_x_rad"], fault.more["tilt_y_rad"], 0.0]).inv()


def mujoco_plant(conditions, offsets, fault=None):
    """The MujocoRobot of a file with a Fault; offsets (K,) as for `own_plant`."""
    from rrru.simulation.mujoco_robot import MujocoRobot

    causes = {"zero_offset": dict(zip(_drives(conditions.mechanism), offsets, strict=True))}
    if fault is not None:
        causes |= _mujoco_causes(conditions, fault)
    return MujocoRobot(conditions.mechanism, Path(conditions.file), conditions.platform, causes)


PLANTS = {"own": own_plant, "mujoco": mujoco_plant}


def _drives(robot):
    """Names of the driven joints."""
    return [column.rpartition("_")[0] for column in robot.parts.columns]


def _mujoco_causes(conditions, fault):
    """Sizes by site by the name of a cause, as `rrru.simulation.mujoco_causes` has them, of a Fault."""
    model, named = conditions.model, _drives(conditions.mechanism)
    if not KINDS[fault.kind].effect_model:
        errors = _acting(getattr(model, KINDS[fault.kind].on), fault.sizes)
        return {"placement": {place: size for error, size in errors for place, _ in error}}
    if fault.kind == "warming":
        (strain,), moved = fault.sizes, model.growth_mm.items()
        grown = {f"{body}.{axis}": strain * mm for body, by in moved for axis, mm in zip("xyz", by, strict=True) if mm}
        return {"warming": {"time_s": fault.more["time_constant"]} | grown}
    if fault.kind == "speed_friction":
        stiff = {drive: _STIFF[one.unit] for drive, one in zip(named, conditions.mechanism.parts.drives, strict=True)}
        slowed = {drive: size * stiff[drive] for drive, size in _acting(named, fault.sizes)}
        return {"actuator_stiffness": stiff, "speed_friction": slowed}
    if fault.kind == "base_on_springs":
        return {"base_stiffness": {f"r{axis}": 1.0 / size for axis, size in _acting("xy", fault.sizes[:2])}}
    if fault.kind == "soft_link":
        given = _acting(model.links, fault.sizes)
        return {"link_stiffness": {place: 1.0 / size for places, size in given for place in places}}
    if fault.kind == "clearance":
        return {"clearance": dict(_acting(model.clearances, fault.sizes))}
    by_drive = dict(_acting(named, fault.sizes))
    if fault.kind in ("play", "slow_servo"):
        return {{"play": "play", "slow_servo": "servo_lag"}[fault.kind]: by_drive}
    causes = {"actuator_stiffness": {drive: 1.0 / size for drive, size in by_drive.items()}}
    if "load_kg" in fault.more:
        causes["payload"] = {conditions.platform: fault.more["load_kg"]}
    if "tilt_x_rad" in fault.more:
        causes["base_tilt"] = {axis: fault.more[f"tilt_{axis}_rad"] for axis in "xy"}
    return causes


def _acting(sites, sizes):
    """Pairs of a site and its size where that is not zero."""
    return [(site, size) for site, size in zip(sites, sizes, strict=True) if np.abs(size) > 0.0]
