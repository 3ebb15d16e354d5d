"""Virtual campaigns with a truth in the model's own family: readings = exact model at drawn parameters + noise.

Errors of a diagnosis on them come from its estimation, not from an incomplete model. The only exception is the scene
"discrepancy". Three robots: the 3-RRRU, a hexapod (6-UPS) and an arm of seven axes. Scenes: see
`SCENES`. The same seed gives the same readings. Lengths mm, angles rad.

The parameters are new for every draw: a credible interval of 95 % under a proper prior holds 95 % of the truths
that are drawn from this prior (Cook, Gelman and Rubin, Validation of software for Bayesian models using posterior
quantiles, J. Comput. Graph. Stat. 15, 2006).
"""

from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np
import pandas as pd
from scipy.fft import idct
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Line, Spiral
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.effects.library import find
from rrru.effects.motion import standing
from rrru.effects.protocol import ActiveEffect, is_compliant
from rrru.kinematics.base_parameters import MeasurementConfig
from rrru.kinematics.dynamics import Masses, carried_kg, level_axes
from rrru.kinematics.point_masses import PLATFORM
from rrru.robots.from_dh import from_dh
from rrru.robots.hexapod import hexapod
from rrru.robots.rrru3 import Rrru3
from rrru.seeds import stream

NOISE_MM = 0.02
# standard deviations of the true errors of geometric parameters, by unit
ERROR_SD = {"mm": 0.3, "rad": 5e-4}
# true coefficients of an effect: its typical size times a factor between these, so that legs clearly differ
EFFECT_FACTORS = (0.3, 2.5)
# prior of payload and tilt as in the docs: narrow or wide with equal odds, in standard deviations of the wide one
PAYLOAD_SHARE, TILT_SD_RAD, NARROW, NARROW_ODDS = 0.3, float(np.radians(1.0)), 0.1, 0.5
# rms of a discrepancy after the calibration over that of the noise
DISCREPANCY_OVER_NOISE = 3.0
# largest error by white noise alone of an identifiable combination of parameters
IDENTIFIABLE_MM = 1.0
# fixed-point iterations of loads and poses
_ROUNDS_OF_LOADS = 3
_STEP = {"mm": 1e-2, "rad": 1e-5}


@dataclass(frozen=True)
class Noise:
    """axis_mm: standard deviation of each axis; correlation: of an AR(1) along a run; run_mm: standard deviation of a
    run's offset; smooth_mm: that of a smooth discrepancy, drawn for every run.
    """

    axis_mm: tuple[float, float, float] = (NOISE_MM,) * 3
    correlation: float = 0.0
    run_mm: float = 0.0
    smooth_mm: float = 0.0

    @property
    def mean_mm(self):
        """Standard deviation per axis, root mean square over the axes, without offsets and discrepancy."""
        return float(np.sqrt(np.mean(np.square(self.axis_mm))))

    def covariances(self, count):
        """Covariances (3, count, count) of the errors of each axis along a run of count readings."""
        wave = np.arange(count)
        cosines = idct(np.eye(count), axis=0, norm="ortho")
        both = self.smooth_mm**2 * (cosines * _smooth_density(count)) @ cosines.T + self.run_mm**2
        along = self.correlation ** np.abs(wave[:, None] - wave) if self.correlation else np.eye(count)
        return np.square(self.axis_mm)[:, None, None] * along + both

    def draw(self, run, generator):
        """Errors (n, 3) of readings in runs (n,)."""
        result = np.empty((len(run), 3))
        for label in pd.unique(run):
            here = np.flatnonzero(run == label)
            white = generator.standard_normal((len(here), 3))
            result[here] = autoregressive(white, self.correlation) * self.axis_mm
            result[here] += self.run_mm * generator.standard_normal(3)
            result[here] += self.smooth_mm * smooth_function(len(here), generator)
        return result


def autoregressive(white, correlation):
    """Series (n, k) of unit variance and first-order autocorrelation from independent standard normal ones (n, k)."""
    result = white.copy()
    for k in range(1, len(result)):
        result[k] = correlation * result[k - 1] + np.sqrt(1.0 - correlation**2) * white[k]
    return result


def smooth_function(count, generator):
    """A smooth function (count, 3) of unit mean variance, with half of its spectral density at the third half-wave."""
    waves = np.sqrt(_smooth_density(count))[:, None] * generator.standard_normal((count, 3))
    return idct(waves, axis=0, norm="ortho")


def _smooth_density(count):
    """Variances (count,) of a smooth function by half-wave number, 1 on average."""
    density = 1.0 / (1.0 + (np.arange(count) / 3.0) ** 2)
    return density / density.mean()


@dataclass(frozen=True)
class Scene:
    """A scene of virtual campaigns.

    paths: poses along paths in several runs; two_targets: one run each over the same poses; removed: an effect outside
    the diagnosis' library acts; open: some parameters are not identifiable from the poses; payload: payload and tilt
    are unknown.
    """

    noise: Noise = field(default_factory=Noise)
    paths: bool = False
    two_targets: bool = False
    removed: bool = False
    open: bool = False
    payload: bool = False


SCENES = {
    "white": Scene(),
    "axes": Scene(Noise((0.02, 0.02, 0.10))),
    "ar1": Scene(Noise(correlation=0.7), paths=True),
    "offsets": Scene(Noise(run_mm=NOISE_MM), paths=True),
    "targets": Scene(two_targets=True),
    "discrepancy": Scene(removed=True, paths=True),
    "open": Scene(open=True),
    "payload": Scene(payload=True),
    # a control of "discrepancy": the function of the model's own prior, independent from run to run
    "smooth": Scene(Noise(smooth_mm=2.0 * NOISE_MM), paths=True),
}


@dataclass(frozen=True)
class Library:
    """Effects of a robot's campaigns.

    acting: the acting effect; offered: names in the library of the diagnosis; removed: an effect outside it; strong:
    factor of the effect over its typical size, so that the readings decide whether it is equal on all legs.
    """

    acting: str
    offered: tuple[str, ...]
    removed: str = ""
    strong: float = 1.0


_LIBRARIES = {
    "rrru3": Library("backlash", ("backlash", "thermal_growth", "transmission_error"), "encoder_eccentricity"),
    "hexapod": Library("backlash", ("backlash", "base_drift", "read_before_rest"), "thermal_growth", 4.0),
    "arm7": Library("encoder_eccentricity", ("encoder_eccentricity", "backlash", "thermal_growth"), "encoder_ovality"),
}
_UNDER_PAYLOAD = Library("drive_compliance", ("drive_compliance", "backlash", "thermal_growth"))
ROBOTS = tuple(_LIBRARIES)
_MASSES = {"rrru3": Masses(), "hexapod": Masses(12.0, 0.0, 0.0), "arm7": Masses(0.0, 0.0, 0.0)}
_PAYLOADS_KG = (0.0, 3.0)

# --- robots

_ARM7_ROWS = (
    {"d_mm": 340, "alpha_deg": -90, "range_deg": [-150, 150], "mass_kg": 6, "com_mm": [0, 150, 0]},
    {"alpha_deg": 90, "range_deg": [-90, 90], "mass_kg": 5, "com_mm": [0, 0, 120]},
    {"d_mm": 400, "alpha_deg": 90, "range_deg": [-150, 150], "mass_kg": 4, "com_mm": [0, -150, 0]},
    {"alpha_deg": -90, "range_deg": [-100, 100], "home_deg": 50, "mass_kg": 3, "com_mm": [0, 0, 100]},
    {"d_mm": 400, "alpha_deg": -90, "range_deg": [-150, 150], "mass_kg": 2, "com_mm": [0, 130, 0]},
    {"alpha_deg": 90, "range_deg": [-100, 100], "home_deg": 40, "mass_kg": 1.5, "com_mm": [0, 0, 30]},
    {"d_mm": 126, "range_deg": [-170, 170], "mass_kg": 1.0, "com_mm": [10, 0, 40]},
)
_TOOLS_MM = {"rrru3": (0.0, 0.0, 0.0), "hexapod": (60.0, 0.0, 40.0), "arm7": (50.0, 0.0, 80.0)}
_SECOND_TARGETS_MM = {"rrru3": (40.0, -30.0, 20.0), "hexapod": (-50.0, 70.0, 20.0), "arm7": (-40.0, 60.0, 110.0)}
_FEET_DEG, _PLATFORM_JOINTS_DEG = (-8, 8, 112, 128, 232, 248), (-52, 52, 68, 172, 188, 292)
# half ranges of the hexapod's poses
_SHIFT_MM, _TURN_RAD = 70.0, float(np.radians(10.0))


@cache
def nominal_robot(robot):
    """The nominal robot (one of ROBOTS) with all parameters that are identifiable from positions over its workspace."""
    if robot == "rrru3":
        return Rrru3()
    options = {"tool_mm": _TOOLS_MM[robot], "parameter_set": "full"}
    if robot == "arm7":
        return from_dh(_ARM7_ROWS, name=robot, **options)
    return hexapod(_ring(350.0, _FEET_DEG), _ring(180.0, _PLATFORM_JOINTS_DEG), 500.0, 160.0, **options)


def _ring(radius_mm, angles_deg):
    """Points (k, 3) on a circle about z."""
    angle = np.radians(angles_deg)
    return radius_mm * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)


@dataclass(frozen=True, eq=False)
class VirtualCampaign:
    """A campaign before any measurement.

    mechanism: with the fitted parameters; commands: table of n readings without measured columns; fresh: that of other
    runs, along the same paths or at other poses of the same range; library: acting effects and those of the
    diagnosis.
    """

    robot: str
    scene: Scene
    mechanism: object
    masses: Masses
    commands: pd.DataFrame
    fresh: pd.DataFrame
    library: Library

    @cached_property
    def cases(self):
        """The DiagnosisProblems of commands and fresh runs, measured without error."""
        tables = self.commands, self.fresh
        return tuple(
            make_diagnosis_problem(_read_as_commanded(table), self.mechanism, self.masses, 1.0, {}) for table in tables
        )

    @cached_property
    def jacobian(self):
        """Derivative (n, 3, p) of the readings by the nominal robot's geometric parameters: central differences."""
        columns = []
        for number, parameter in enumerate(self.mechanism.parameters):
            step = np.zeros(len(self.mechanism.parameters))
            step[number] = _STEP[parameter.unit]
            high, low = (exact_readings(self, Truth(sign * step)) for sign in (1.0, -1.0))
            columns.append((high - low) / (2.0 * _STEP[parameter.unit]))
        return np.stack(columns, axis=-1)

    @cached_property
    def scale(self):
        """Units (p,) in which a step of each parameter moves the tool by about a millimetre."""
        return np.where(
            np.array(self.mechanism.parameters.units) == "mm", 1.0, 1.0 / self.mechanism.characteristic_length_mm
        )

    @cached_property
    def still(self):
        """Numbers from 1 on of the drives that do not move: the calibration absorbs an effect of such a drive."""
        drive = rows.actuators(self.commands, self.mechanism)
        return frozenset((1 + np.flatnonzero(np.ptp(drive, axis=0) == 0.0)).tolist())

    @cached_property
    def identifiable(self):
        """Orthonormal identifiable combinations (p, r), in units of `scale`: see IDENTIFIABLE_MM."""
        flat = self.jacobian.reshape(-1, len(self.scale)) * self.scale
        _, size, turned = np.linalg.svd(flat, full_matrices=False)
        return turned[IDENTIFIABLE_MM * size > NOISE_MM].T


@cache
def virtual_campaign(robot, scene, size=1.0):
    """The VirtualCampaign of a robot (one of ROBOTS) and a scene (name); size: share of the usual number of poses."""
    chosen, library = SCENES[scene], _LIBRARIES[robot]
    if chosen.payload:
        library = _UNDER_PAYLOAD
    commands, fresh = (_commands(robot, chosen, size, seed) for seed in (1, 1 if chosen.paths else 2))
    mechanism = _with_parameters(robot, chosen, commands)
    library = library if chosen.removed else replace(library, removed="")
    return VirtualCampaign(robot, chosen, mechanism, _MASSES[robot], commands, fresh, library)


def pose_campaign(robot, count, noise_mm, acting, repeats, generator):
    """The VirtualCampaign of count random poses of a robot, with white noise; acting: the effect of its library.

    repeats: number of poses that are measured again after all others, and number of readings of each.
    """
    nominal, (again, times) = nominal_robot(robot), repeats
    drive, position = _poses(robot, count, False, generator)
    order = np.concatenate([np.arange(count), *[generator.choice(count, again, replace=False)] * (times - 1)])
    payload = generator.choice(_PAYLOADS_KG, count)[order]
    frame = _table(nominal, drive[order], position[order], np.ones(len(order), dtype=int), payload)
    mechanism = _with_parameters(robot, Scene(), frame)
    scene = Scene(Noise((noise_mm,) * 3))
    return VirtualCampaign(robot, scene, mechanism, _MASSES[robot], frame, frame, Library(acting, (acting,)))


def _with_parameters(robot, scene, commands):
    """The robot with the parameters identifiable from the commands; in an open scene also with others."""
    nominal, reads = nominal_robot(robot), rows.measurement_config(commands)
    if scene.open and robot == "rrru3":
        # with a platform that never rotates, the places of a target and of the frame are not separately identifiable
        reads = MeasurementConfig(("reflector a",), ("reflector a",), frame=True)
    if reads.reflectors:
        nominal = nominal.with_measurement_config(reads)
    if scene.open:
        return nominal
    readings = rows.readings(_read_as_commanded(commands), nominal.characteristic_length_mm)
    return nominal.with_identifiable_parameters(rows.actuators(commands, nominal), rows.command(commands), readings)


def _read_as_commanded(frame):
    """A table of commands with the commanded positions as readings."""
    return frame.assign(**rows.vector_columns("measured", rows.command(frame)))


# --- commands


def _commands(robot, scene, size, seed):
    """The table of commands of a campaign; seed: of its poses."""
    if robot == "rrru3":
        frame = _rrru3_commands(scene, size)
    else:
        frame = _pose_commands(robot, scene, size, stream(seed, "poses", robot))
    if scene.two_targets:
        return _with_targets(frame, {"a": _TOOLS_MM[robot], "b": _SECOND_TARGETS_MM[robot]})
    if scene.open and robot == "rrru3":
        return _with_targets(frame, {"a": _SECOND_TARGETS_MM[robot]})
    return frame


def _rrru3_commands(scene, size):
    """Three lines and a spiral, forward and reverse, and again with a payload: 12 runs of 222 points."""
    count, nominal = max(int(16 * size), 6), nominal_robot("rrru3")
    lines = [Line(f"line_{k}", (-600.0, y, 650.0), (0.0, y, 650.0), count) for k, y in enumerate((0.0, 110.0, -110.0))]
    spiral = Spiral("spiral", (0.0, 0.0), (50.0, 280.0), (560.0, 760.0), 4.5, max(int(26 * size), 10))
    passes = [{"reverse": False, "payload_kg": 0.0}, {"reverse": True, "payload_kg": 0.0}]
    passes.append({"reverse": False, "payload_kg": 5.0})
    plan = make_plan((*lines, spiral), passes[:1] if scene.two_targets else passes, 80.0, 40.0, 60.0)
    drive = nominal.inverse(plan.targets())
    return plan.commands(nominal).assign(**dict(zip(nominal.parts.columns, drive.T, strict=True)), status="ok")


def _pose_commands(robot, scene, size, generator):
    """240 poses of a robot whose tool rotates: in random order, or along ten paths, each both ways."""
    nominal, count = nominal_robot(robot), max(int(240 * size), 80) // (1 + scene.two_targets)
    if scene.paths:
        drive, run, trajectory = _along_ways(robot, count, generator)
        position = nominal.forward(drive)
    else:
        drive, position = _poses(robot, count, scene.open, generator)
        run, trajectory = np.ones(count, dtype=int), np.full(count, "poses")
    payload = generator.choice(_PAYLOADS_KG, len(drive)) if scene.payload else np.zeros(len(drive))
    return _table(nominal, drive, position, run, payload).assign(trajectory=trajectory)


def _table(nominal, drive, position, run, payload):
    """The table of commands at drive values (n, K) and positions (n, 3) in runs (n,) with payloads (n,)."""
    frame = pd.DataFrame({"run": run, "trajectory": "poses"})
    return frame.assign(
        point=frame.groupby("run").cumcount() + 1,
        time_s=np.cumsum(np.where(np.diff(run, prepend=0) != 0, 60.0, 4.0)) - 60.0,
        speed_mm_s=np.nan,
        payload_kg=payload,
        **rows.vector_columns("command", position),
        **dict(zip(nominal.parts.columns, drive.T, strict=True)),
        status="ok",
    )


def _along_ways(robot, count, generator, ways=10):
    """Drive values (n, K), runs and trajectories (n,): straight in the drives from one random pose to another."""
    each, drive, run, trajectory = count // (2 * ways), [], [], []
    share = np.linspace(0.0, 1.0, each)[:, None]
    for k in range(ways):
        ends, _ = _poses(robot, 2, False, generator)
        way = ends[0] + share * (ends[1] - ends[0])
        drive += [way, way[::-1]]
        run += [np.full(each, 2 * k + 1), np.full(each, 2 * k + 2)]
        trajectory += 2 * each * [f"way_{k + 1}"]
    return np.concatenate(drive), np.concatenate(run), np.array(trajectory)


def _poses(robot, count, constrained, generator):
    """Drive values (count, K) and positions (count, 3) of the tool in random order.

    constrained: an arm's last two axes do not move, a hexapod's platform rotates about z alone.
    """
    nominal = nominal_robot(robot)
    if robot == "arm7":
        low, high = nominal.drive_range.T
        drive = low + (high - low) * generator.random((count, len(low)))
        drive[:, 5 if constrained else 7 :] = 0.3
        return drive, nominal.forward(drive)
    place = nominal.legs.home_mm + _SHIFT_MM * generator.uniform(-1.0, 1.0, (count, 3))
    vector = _TURN_RAD * generator.uniform(-1.0, 1.0, (count, 3))
    turn = Rotation.from_rotvec(vector * [not constrained, not constrained, True]).as_matrix()
    tool = place + turn @ np.asarray(nominal.tool_mm)
    return nominal.inverse(tool, turn=turn), tool


def _with_targets(frame, places_mm):
    """The commands with targets by name, measured in sequence over the same poses, each in separate runs."""
    parts, last_s = [], 0.0
    for number, (name, place) in enumerate(places_mm.items()):
        columns = dict(zip(("target_x_mm", "target_y_mm", "target_z_mm"), place, strict=True))
        runs = frame.assign(run=frame["run"] + number * frame["run"].max(), target=name, **columns)
        parts.append(runs.assign(time_s=runs["time_s"] + last_s))
        last_s += frame["time_s"].max() + 60.0
    return pd.concat(parts, ignore_index=True)


# --- truth and readings


@dataclass(frozen=True)
class Truth:
    """The truth of a draw.

    deviations (p,) of the geometric parameters; effects: ActiveEffects of the diagnosis' library; discrepancy: of the
    effect outside it; payload: extra mass and tilt by name.
    """

    deviations: np.ndarray
    effects: tuple = ()
    discrepancy: tuple = ()
    payload: dict = field(default_factory=dict)


def draw_truth(campaign, generator, acts=True):
    """The Truth of one draw of a VirtualCampaign; acts: whether its effect does."""
    sizes = np.array([ERROR_SD[unit] for unit in campaign.mechanism.parameters.units])
    truth = Truth(sizes * generator.standard_normal(len(sizes)))
    if campaign.scene.payload:
        truth = replace(truth, payload=_draw_payload(campaign, generator))
    if acts:
        effect = find(campaign.library.acting, campaign.mechanism)
        coordinates = campaign.library.strong * _draw_coordinates(effect, generator)
        truth = replace(truth, effects=(_active(effect, coordinates),))
    if campaign.library.removed:
        truth = replace(truth, discrepancy=(_draw_discrepancy(campaign, generator),))
    return truth


def _active(effect, coordinates):
    """The effect at coordinates (c,) and the middle one of its shapes."""
    shapes = effect.coordinates.shapes
    values = effect.coordinates.to_values(coordinates, shapes[len(shapes) // 2])
    return ActiveEffect(effect, effect.parameters.mapping(values))


def _draw_coordinates(effect, generator):
    """Coordinates (c,) of an effect: its typical size times a factor, of any sign that it allows."""
    coordinates = effect.coordinates
    size = generator.uniform(*EFFECT_FACTORS, len(coordinates)) * coordinates.typical
    return size * np.where(coordinates.positive, 1.0, generator.choice([-1.0, 1.0], len(coordinates)))


def _draw_payload(campaign, generator):
    """Extra mass at the platform and tilt of the base by name, from their prior."""
    robot = campaign.mechanism
    stated = carried_kg(robot, campaign.masses, campaign.commands["payload_kg"].to_numpy())
    stated += sum(
        point_mass.mass_kg for point_mass in getattr(robot, "point_masses", ()) if point_mass.joint == PLATFORM
    )
    wide = np.array([PAYLOAD_SHARE * stated.max(), TILT_SD_RAD])
    mass_sd, tilt_sd = np.where(generator.random(2) < NARROW_ODDS, NARROW, 1.0) * wide
    # the mass is at least a tenth of the stated one
    extra = max(mass_sd * generator.standard_normal(), -0.9 * stated.min())
    names = ("extra_kg", *(f"lean_{'xyz'[axis]}" for axis in level_axes(robot)))
    return dict(zip(names, map(float, (extra, *tilt_sd * generator.standard_normal(2))), strict=True))


def _draw_discrepancy(campaign, generator):
    """The removed effect at random coordinates, scaled to DISCREPANCY_OVER_NOISE after the calibration."""
    effect = find(campaign.library.removed, campaign.mechanism)
    coordinates, nothing = _draw_coordinates(effect, generator), np.zeros(len(campaign.scale))
    change = exact_readings(campaign, Truth(nothing, (_active(effect, coordinates),)))
    change = (change - exact_readings(campaign, Truth(nothing))).ravel()
    base = campaign.jacobian.reshape(len(change), -1) * campaign.scale
    left = change - base @ np.linalg.lstsq(base, change, rcond=1e-9)[0]
    wanted = DISCREPANCY_OVER_NOISE * campaign.scene.noise.mean_mm
    return _active(effect, coordinates * wanted / np.sqrt((left**2).mean()))


def exact_readings(campaign, truth, fresh=False):
    """Noise-free readings (n, 3) of a Truth, for the commands or the fresh runs.

    Raises ValueError where the legs do not close.
    """
    problem, robot = campaign.cases[fresh], campaign.mechanism
    motion, readings, effects = problem.motion, problem.readings, truth.effects + truth.discrepancy
    commanded = rows.actuators(problem.measurements, robot), rows.command(problem.measurements)
    bearing = robot.orients and any(is_compliant(active.effect) for active in effects)
    for _ in range(_ROUNDS_OF_LOADS if bearing else 1):
        twists = robot.twists(truth.deviations) + _twists(effects, motion, truth.payload)
        poses = robot.solve(*commanded, twists)
        if bearing:
            at = standing(robot, commanded, (poses, twists), readings is not None)
            # as in the diagnosis: changes of the loads by the payload are evaluated at the nominal poses
            motion = replace(problem.motion_at(at), load_slopes=lambda: problem.motion.slopes)
    if not poses.closed.all():
        raise ValueError(f"{campaign.robot}: {(~poses.closed).sum()} poses do not close with the drawn errors")
    return robot.measured(poses, twists, readings) if readings is not None else robot.measured(poses, twists)


def _twists(effects, motion, payload):
    """Twists (n or 1, sites, 6) of active effects along a motion; compliances have the loads of the true payload."""
    heavy = motion.under(*payload.values()) if payload else motion
    return sum((active.contribute(heavy if is_compliant(active.effect) else motion).twists for active in effects), 0.0)


def measure(campaign, truth, generator, fresh=False):
    """The table of readings of a Truth with noise drawn from a generator."""
    frame = campaign.fresh if fresh else campaign.commands
    errors = campaign.scene.noise.draw(rows.series(frame), generator)
    return frame.assign(**rows.vector_columns("measured", exact_readings(campaign, truth, fresh) + errors))
