"""Own robots driven with a hidden cause or none, and the files that a user would provide. mm, rad, s, kg."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.errors import UnreachableError
from rrru.robots.catalogue import make_mechanism
from rrru.seeds import stream
from rrru.studies.blind_validation.causes import draw_log_uniform
from rrru.studies.blind_validation.models import TARGETS_MM
from rrru.studies.blind_validation.sentences.causes import MUJOCO, NAMES, Cause, Stops, draw_cause, fits
from rrru.studies.blind_validation.sentences.kinds import KINDS

# errors of a robot as built relative to its file, 1 sigma
_LENGTH_MM, _ANGLE_RAD = 0.2, 4e-4
_ZERO = {"rad": 0.002, "mm": 0.3}
# errors between the frames of instrument and robot where the file states that they are the same, 1 sigma
_FRAME_MM, _FRAME_RAD = 0.2, 2e-4
NOISE_MM, NOISE_RAD = (0.01, 0.05), 2e-5
# rms displacement of a cause over the noise
_STRENGTHS = (2.0, 25.0)
_FEWEST, _FRESH, _AGAIN = 60, 200, 10
_SETTLED_S = 8.0
_PAYLOAD_KG = 5.0
# what is measured: tool, targets with stated places, targets with places to find, pose
READINGS = ("tool", "stated", "found", "pose")
_INSIDE = 0.9
# first size of a cause, small enough for a linear displacement, and number of rescalings
_SMALL, _SIZINGS = 1e-6, 3
_ATTEMPTS, _ACTING = 30, 0.65


@dataclass(frozen=True)
class Draw:
    """A robot as in its file and as built, and how it is measured.

    plant: numpy or mujoco; kind: of the file; zeros (K,): zero offsets of the drives; cause: None where nothing acts;
    stops; reading: one of READINGS; targets: places by name, None for the tool; frame: rotation and translation from
    the robot's frame to the instrument's; registered: the file does not state that both are the same; noise_mm, per
    axis; driven: poses by whether the cause acts, of a robot simulated by MuJoCo, see `driven`.
    """

    name: str
    robot_kind: str
    plant: str
    kind: str
    nominal: object
    built: object
    zeros: np.ndarray
    cause: Cause | None
    stops: Stops
    reading: str
    frame: tuple
    registered: bool
    noise_mm: float
    seed: int
    driven: dict = field(default_factory=dict)

    @property
    def targets(self):
        """Places (3,) of the measured targets on the platform, by name."""
        return {"": (0.0, 0.0, 0.0)} if self.reading in ("tool", "pose") else TARGETS_MM

    def poses(self, cause=True, stops=None):
        """Exact positions (n, 3) and rotations (n, 3, 3) of the platform, robot frame; cause: whether it acts."""
        stops = stops or self.stops
        acting = self.cause if cause else None
        if self.plant == "mujoco":
            return self.driven[acting is not None]
        off = acting.at_drives(self.built, stops, self.zeros) if acting else 0.0
        place, turn = self.built.poses(stops.drive + self.zeros + off)
        return place + (acting.of_base(stops) if acting else 0.0), turn

    def readings(self, poses):
        """Exact positions (m, 3) and turns (m, 3) in the instrument's frame, a row for every target of every stop."""
        place, turn = poses
        rotation, shift = self.frame
        seen = np.stack([place + turn @ np.array(target) for target in self.targets.values()], axis=1)
        vectors = Rotation.from_matrix(rotation @ turn).as_rotvec()
        return seen.reshape(-1, 3) @ rotation.T + shift, np.repeat(vectors, len(self.targets), axis=0)

    def table(self, readings, noisy):
        """The file's rows of exact readings, with noise or without."""
        seen, vectors = readings
        generator = stream(self.seed, "sentences noise", self.name)
        row = np.repeat(np.arange(len(self.stops.drive)), len(self.targets))
        position = seen + noisy * self.noise_mm * generator.standard_normal(seen.shape)
        columns = {"trajectory": "stops", "time_s": self.stops.time_s[row]}
        columns |= dict(zip(self.nominal.columns, self.stops.drive[row].T, strict=True))
        columns |= {f"measured_{axis}_mm": values for axis, values in zip("xyz", position.T, strict=True)}
        if self.reading == "pose":
            small = noisy * NOISE_RAD * generator.standard_normal(vectors.shape)
            turned = (Rotation.from_rotvec(small) * Rotation.from_rotvec(vectors)).as_rotvec()
            columns |= {f"measured_r{axis}_rad": values for axis, values in zip("xyz", turned.T, strict=True)}
        elif self.reading != "tool":
            columns["target"] = np.tile([*self.targets], len(self.stops.drive))
        return pd.DataFrame(columns | {"payload_kg": self.stops.payload_kg[row]})

    def section(self, folder, file):
        """The campaign's section of the configuration of a file of rows in a folder."""
        section = {"robot": "own", "ingest": str(Path(folder) / file), "errors": "full", "noise_mm": self.noise_mm}
        if self.registered:
            section["frame"] = "register"
        if self.reading == "pose":
            section["noise_rad"] = NOISE_RAD
        if self.reading == "stated":
            section["targets"] = {name: list(place) for name, place in self.targets.items()}
        return section

    @property
    def in_words(self):
        """The truth in words: cause, plant, file, reading and frame."""
        cause = "none"
        if self.cause is not None:
            cause = self.cause.name + (f" at drive {self.cause.leg}" if self.cause.leg else "")
        frame = "registered" if self.registered else "in the robot's frame"
        return f"{cause}; {self.plant}, {self.kind}, {self.reading}, {frame}"

    @property
    def robot_file(self):
        """Name of the robot's file."""
        return "own.urdf" if self.kind == "urdf" else "own.xml"

    @property
    def file_rows(self):
        """The noisy rows of the file: those of all stops but the fresh ones."""
        return self.table(self.readings(self.poses()), True)[np.repeat(~self.stops.fresh, len(self.targets))]

    def write(self, folder, rows, file="stops.csv"):
        """Write the robot's file and a file of rows; returns the sections of the campaign and of the robot."""
        robot = Path(folder) / self.robot_file
        robot.write_text(self.nominal.text(self.kind))
        rows.to_csv(Path(folder) / file, index=False)
        return self.section(folder, file), self.nominal.section(str(robot), self.kind)


def draw(number, seed, most_stops, mujoco_share):
    """The Draw of a number: kinds of robots take turns; plants, causes and readings are random.

    Repeated where the robot as built has no pose at a stop, or where the cause is larger than in any real robot.
    """
    for attempt in range(_ATTEMPTS):
        generator = stream(seed, "sentences", number, attempt)
        plant = "mujoco" if generator.random() < mujoco_share else "numpy"
        own = _still(number, seed, plant, most_stops, generator)
        names = [*MUJOCO] if plant == "mujoco" else [name for name in NAMES if fits(name, own.nominal)]
        if generator.random() < _ACTING:
            cause = draw_cause(str(generator.choice(names)), own.nominal, generator)
            own = _sized(own, cause, draw_log_uniform(_STRENGTHS, generator))
        if np.isfinite(replace(own, plant="numpy").poses()[0]).all() and not (
            own.cause and own.cause.beyond(own.nominal)
        ):
            return own
    raise UnreachableError(f"robot {number}: no pose at some stop, or a cause too large, in {_ATTEMPTS} draws")


def _still(number, seed, plant, most_stops, generator):
    """The Draw of a robot without a cause."""
    kind = [*KINDS][number % len(KINDS)]
    nominal = KINDS[kind](generator)
    built = nominal.built(generator, _LENGTH_MM, _ANGLE_RAD)
    zeros = np.array([_ZERO[unit] for unit in nominal.units]) * generator.standard_normal(len(nominal.units))
    registered = bool(generator.random() < 0.5)
    # MuJoCo needs long from stop to stop
    count = _FEWEST if plant == "mujoco" else int(draw_log_uniform((_FEWEST, most_stops), generator))
    reading = str(generator.choice(READINGS))
    # with a constant orientation, frame and tool are confounded
    reading = "tool" if reading in ("pose", "found") and not _turns(nominal) else reading
    return Draw(
        name=f"{kind}_{number:04d}",
        robot_kind=kind,
        plant=plant,
        kind="mjcf" if plant == "mujoco" else str(generator.choice(nominal.formats)),
        nominal=nominal,
        built=built,
        zeros=zeros,
        cause=None,
        stops=_stops(nominal, count, plant, generator),
        reading=reading,
        frame=_frame(generator, registered),
        registered=registered,
        noise_mm=draw_log_uniform(NOISE_MM, generator),
        seed=seed,
    )


def _turns(robot):
    """Whether a robot rotates its platform."""
    _, turn = robot.poses(robot.spans.T)
    return bool(np.abs(turn[0] - turn[1]).max() > 1e-3)


def _sized(draw, cause, strength):
    """The Draw with a cause whose rms displacement is `strength` times that of the noise."""
    plain = replace(draw, plant="numpy", cause=cause.scaled(_SMALL))
    still = plain.poses(cause=False)[0]
    for _ in range(_SIZINGS):
        moved = plain.poses()[0] - still
        size = np.sqrt((moved**2).sum(axis=1).mean())
        plain = replace(plain, cause=plain.cause.scaled(strength * np.sqrt(3.0) * draw.noise_mm / size))
    return replace(draw, cause=plain.cause)


def _frame(generator, registered):
    """Rotation and translation from the robot's frame to the instrument's."""
    if registered:
        # four normal numbers give a uniformly distributed rotation
        turn = Rotation.from_quat(generator.standard_normal(4)).as_matrix()
        return turn, generator.uniform(-3000.0, 3000.0, 3)
    turn = Rotation.from_rotvec(_FRAME_RAD * generator.standard_normal(3)).as_matrix()
    return turn, _FRAME_MM * generator.standard_normal(3)


def _stops(robot, count, plant, generator):
    """`count` stops, some of them measured again, followed by the fresh ones."""
    fresh = 20 if plant == "mujoco" else _FRESH
    low, high = robot.spans.T
    middle, half = 0.5 * (low + high), 0.5 * _INSIDE * (high - low) * (0.5 if plant == "mujoco" else 1.0)
    drive = middle + half * generator.uniform(-1.0, 1.0, (3 * (count + fresh), len(half)))
    # poses out of reach are left out
    drive = drive[np.isfinite(robot.poses(drive)[0]).all(axis=1)][: count + fresh]
    if generator.random() < 0.5:
        drive[count - _AGAIN : count] = drive[:_AGAIN]
    payload = np.zeros(len(drive))
    if generator.random() < 0.6:
        payload[count // 2 : count] = _PAYLOAD_KG
        payload[count + fresh // 2 :] = _PAYLOAD_KG
        # so that repeated stops have the same payload
        payload[count - _AGAIN : count] = 0.0
    is_fresh = np.arange(len(drive)) >= count
    time = _SETTLED_S * np.arange(len(drive))
    time[is_fresh] = np.linspace(0.0, time[count - 1], is_fresh.sum())
    return Stops(drive, payload, time, is_fresh)


# --- robots that MuJoCo drives


@dataclass(frozen=True)
class DriveList:
    """The input of `rrru.simulation.mujoco_run.Machine.drive`: linear in the drives from stop to stop."""

    path_drive: np.ndarray
    path_index: np.ndarray
    payload_kg: np.ndarray
    time_s: np.ndarray
    drive_rate: np.ndarray
    position_mm: np.ndarray


def _mujoco_poses(draw, cause):
    """Positions (n, 3) and rotations (n, 3, 3) of the platform of a Draw at its stops under a Cause or none.

    The model has errors of the seats in its file. Raises SimulationError where it does not come to rest.
    """
    # a large import that most robots do not need
    from rrru.simulation.mujoco_robot import MujocoRobot

    stops = draw.stops
    with TemporaryDirectory() as folder:
        file = Path(folder) / draw.robot_file
        file.write_text(draw.nominal.text("mjcf"))
        section = draw.nominal.section(str(file), "mjcf")
        mechanism = make_mechanism("own", section)
        robot = MujocoRobot(mechanism, file, section["platform"], _causes(draw, cause))
        machine = robot.machine(stops.payload_kg.max())
    place, _ = draw.nominal.poses(stops.drive)
    motion = DriveList(
        stops.drive,
        np.arange(len(stops.drive)),
        stops.payload_kg,
        stops.time_s,
        np.zeros_like(stops.drive),
        place,
    )
    return machine.drive(motion, False)


def driven(draw):
    """The Draw with its poses simulated by MuJoCo, with and without its cause.

    Raises SimulationError or UnreachableError where the simulation fails.
    """
    causes = {draw.cause is not None, False}
    return replace(draw, driven={acts: _mujoco_poses(draw, draw.cause if acts else None) for acts in causes})


def _causes(draw, cause):
    """Sizes by site by the name of a cause of MuJoCo's plant."""
    names = draw.nominal.names
    generator = stream(draw.seed, "sentences built", draw.name)
    placed = {
        site: float((_LENGTH_MM if site[-2] != "r" else _ANGLE_RAD) * generator.standard_normal())
        for site in draw.nominal.places
    }
    causes = {"zero_offset": dict(zip(names, draw.zeros.tolist(), strict=True)), "placement": placed}
    if cause is not None:
        sizes = {name: size for name, size in zip(names, cause.sizes, strict=True) if size}
        if cause.name == "drive_compliance":
            sizes = {name: 1.0 / size for name, size in sizes.items()}
        causes[MUJOCO[cause.name]] = sizes
    return causes
