"""A 6-RSS hexa, by NumPy and SciPy alone: six rotary drives, cranks, and rods between ball joints.

Lengths in mm, angles in rad. Rods may grow, and the instrument may drift, while 80 stops are measured in 40 minutes.
"""

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from tests.diagnosis.hexapod_stops import standing
from tests.formats.mjcf import GEOM, mjcf, servos, text_of

NOISE_MM, TIME_CONSTANT_S, STOPS, SECONDS = 0.01, 600.0, 80, 2400.0
TARGETS = {"a": (80.0, 0.0, 30.0), "b": (-40.0, 70.0, 45.0), "c": (-40.0, -70.0, 30.0)}
ROD_MM, _CRANK_MM = 400.0, 100.0
_AT, _ON = np.radians([10, 110, 130, 230, 250, 350]), np.radians([40, 80, 160, 200, 280, 320])
_OUT = np.stack([np.cos(_AT), np.sin(_AT), 0.0 * _AT], axis=1)
_AXIS = np.stack([-np.sin(_AT), np.cos(_AT), 0.0 * _AT], axis=1)
_BASE, _PLATFORM = 200.0 * _OUT, 110.0 * np.stack([np.cos(_ON), np.sin(_ON), 0.0 * _ON], axis=1)
_ERROR_MM, _ERROR_RAD = 0.2, 1e-3


def _knees(base, crank_mm, axis, drive):
    """Ends (n, 6, 3) of cranks (6,) on base joints (6, 3) at drive angles (n, 6)."""
    axis = axis / np.linalg.norm(axis, axis=1)[:, None]
    crank, turned = crank_mm[:, None] * _OUT, drive[..., None]
    along = axis * (axis * crank).sum(axis=1)[:, None]
    return base + crank * np.cos(turned) + np.cross(axis, crank) * np.sin(turned) + along * (1.0 - np.cos(turned))


def _home():
    """The platform's position (3,) with level cranks."""
    knees, start = _knees(_BASE, np.full(6, _CRANK_MM), _AXIS, np.zeros((1, 6))), (np.array([[0.0, 0.0, 340.0]]),)
    return standing(np.full((1, 6), ROD_MM), (*start, np.eye(3)[None]), knees, _PLATFORM)[0][0]


def _drives(position, turn):
    """Drive angles (n, 6) of the nominal robot at poses, cranks outwards."""
    place = position[:, None] + np.einsum("nij,kj->nki", turn, _PLATFORM) - _BASE
    across, along = (2.0 * _CRANK_MM * (place * axis).sum(axis=2) for axis in (np.cross(_AXIS, _OUT), _OUT))
    needed = (place**2).sum(axis=2) + _CRANK_MM**2 - ROD_MM**2
    middle, half = np.arctan2(across, along), np.arccos(needed / np.hypot(along, across))
    ways = (np.stack([middle - half, middle + half]) + np.pi) % (2.0 * np.pi) - np.pi
    return np.where(np.abs(ways[0]) < np.abs(ways[1]), *ways)


def robot_file(tmp_path):
    """The nominal robot as an MJCF with a connect at the end of each rod."""
    home = _home()
    knees = _knees(_BASE, np.full(6, _CRANK_MM), _AXIS, np.zeros((1, 6)))[0]
    world = f'<body name="plate" pos="{text_of(home / 1000.0)}"><freejoint/><geom size="0.05" mass="2"/></body>'
    connects = ""
    for k, (base, knee, end, axis) in enumerate(zip(_BASE, knees, _PLATFORM, _AXIS, strict=True), 1):
        drive = f'<joint name="q{k}" axis="{text_of(axis)}" range="-1.2 1.2" limited="true"/>'
        rod = (
            f'<body name="rod{k}" pos="{text_of((knee - base) / 1000.0)}"><joint name="b{k}" type="ball"/>{GEOM}</body>'
        )
        world += f'<body name="crank{k}" pos="{text_of(base / 1000.0)}">{drive}{GEOM}{rod}</body>'
        connects += f'<connect name="c{k}" body1="plate" body2="rod{k}" anchor="{text_of(end / 1000.0)}"/>'
    return mjcf(tmp_path, world, connects, servos(*(f"q{k}" for k in range(1, 7))))


def file_of(growth_mm=(0.0,) * 6, drift_mm_s=(0.0,) * 3, seed=1):
    """What a tracker reads of three reflectors and the controller writes.

    growth_mm (6,): what each rod is longer by in the end; drift_mm_s (3,): speed of the robot against the instrument.
    """
    generator = np.random.default_rng(seed)
    position = _home() + generator.uniform(-1.0, 1.0, (STOPS, 3)) * [40.0, 40.0, 25.0]
    turn = Rotation.from_rotvec(generator.uniform(-0.12, 0.12, (STOPS, 3))).as_matrix()
    drive, time = _drives(position, turn), np.linspace(0.0, SECONDS, STOPS)
    base, platform = (places + _ERROR_MM * generator.standard_normal((6, 3)) for places in (_BASE, _PLATFORM))
    cranks, rods = (length + _ERROR_MM * generator.standard_normal(6) for length in (_CRANK_MM, ROD_MM))
    axis = _AXIS + _ERROR_RAD * generator.standard_normal((6, 3))
    knees = _knees(base, cranks, axis, drive + _ERROR_RAD * generator.standard_normal(6))
    grown = rods - np.outer(np.expm1(-time / TIME_CONSTANT_S), growth_mm)
    position, turn = standing(grown, (position, turn), knees, platform)
    position = position + np.outer(time, drift_mm_s)
    seen = np.stack([position + turn @ np.array(place) for place in TARGETS.values()], axis=1).reshape(-1, 3)
    seen = seen + NOISE_MM * generator.standard_normal(seen.shape)
    columns = {f"q{k}_rad": column for k, column in enumerate(np.repeat(drive, len(TARGETS), axis=0).T, 1)}
    columns |= {f"measured_{axis}_mm": column for axis, column in zip("xyz", seen.T, strict=True)}
    stops = {"trajectory": "stops", "target": np.tile([*TARGETS], STOPS), "time_s": np.repeat(time, len(TARGETS))}
    return pd.DataFrame(stops | columns)
