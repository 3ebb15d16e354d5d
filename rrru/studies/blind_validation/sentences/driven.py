"""Own robots that MuJoCo drives. Lengths mm, angles rad, N."""

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rrru.robots.catalogue import make_mechanism
from rrru.seeds import stream
from rrru.simulation.mujoco_robot import MujocoRobot
from rrru.studies.blind_validation.sentences.causes import MUJOCO

_LENGTH_MM, _ANGLE_RAD = 0.2, 4e-4


@dataclass(frozen=True)
class DriveList:
    """The input of `rrru.simulation.mujoco_run.Machine.drive`: linear in the drives from stop to stop."""

    path_drive: np.ndarray
    path_index: np.ndarray
    payload_kg: np.ndarray
    time_s: np.ndarray
    drive_rate: np.ndarray
    position_mm: np.ndarray


def mujoco_poses(draw, cause):
    """Positions (n, 3) and rotations (n, 3, 3) of the platform of a Draw at its stops under a Cause or none.

    The model has errors of the seats in its file. Raises SimulationError where it does not come to rest.
    """
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
    return replace(draw, driven={acts: mujoco_poses(draw, draw.cause if acts else None) for acts in causes})


def _causes(draw, cause):
    """Sizes by site by the name of a cause of MuJoCo's plant."""
    names = [column.rpartition("_")[0] for column in draw.nominal.columns]
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
