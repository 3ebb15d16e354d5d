"""A linear delta with vertical slides, by NumPy and SciPy alone, whose unequal rods turn the platform by some mrad.

Lengths in mm. A reflector next to the tool is read in a frame of its own at 120 stops.
"""

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from tests.diagnosis.hexapod_stops import standing
from tests.formats.mjcf import GEOM, mjcf, servos, text_of

NOISE_MM, BALL = 0.01, (40.0, 15.0, -25.0)
_STOPS, _ROD, _ERROR_MM, _ERROR_RAD = 120, 300.0, 0.15, 1e-3
_COLUMNS, _JOINTS, _APART = 180.0, 40.0, 50.0
_AT = np.radians([0.0, 120.0, 240.0])
_OUT = np.stack([np.cos(_AT), np.sin(_AT), 0.0 * _AT], axis=1)
_SIDE = 0.5 * _APART * np.stack([-np.sin(_AT), np.cos(_AT), 0.0 * _AT], axis=1)
# upper and lower ends of the rods a of the three slides, then of their rods b
_UPPER = np.concatenate([_COLUMNS * _OUT - _SIDE, _COLUMNS * _OUT + _SIDE])
_LOWER = np.concatenate([_JOINTS * _OUT - _SIDE, _JOINTS * _OUT + _SIDE])
_HEIGHT = np.sqrt(_ROD**2 - (_COLUMNS - _JOINTS) ** 2)


def robot_file(tmp_path):
    """The nominal robot as an MJCF with a connect at the end of each rod."""
    world, connects = '<body name="plate"><freejoint/><geom size="0.03" mass="0.5"/></body>', ""
    for slide in range(3):
        place, own = [*_COLUMNS * _OUT[slide, :2], _HEIGHT], ""
        for name, rod in (("a", slide), ("b", slide + 3)):
            end = (_UPPER[rod] - _COLUMNS * _OUT[slide]) / 1000.0
            own += f'<body name="rod{rod}" pos="{text_of(end)}"><joint name="{name}{slide}" type="ball"/>{GEOM}</body>'
            anchor = text_of(_LOWER[rod] / 1000.0)
            connects += f'<connect name="end{rod}" body1="plate" body2="rod{rod}" anchor="{anchor}"/>'
        joint = f'<joint name="z{slide + 1}" type="slide" axis="0 0 1" range="-0.2 0.2" limited="true"/>'
        world += f'<body name="slide{slide}" pos="{text_of(np.array(place) / 1000.0)}">{joint}{GEOM}{own}</body>'
    return mjcf(tmp_path, world, connects, servos("z1", "z2", "z3"))


def file_of(seed):
    """What a tracker reads of the reflector and the controller writes; nothing but the geometry is off."""
    generator = np.random.default_rng(seed)
    position = generator.uniform(-1.0, 1.0, (_STOPS, 3)) * [70.0, 70.0, 60.0]
    away = position[:, None, :2] + (_JOINTS - _COLUMNS) * _OUT[:, :2]
    height = position[:, 2:] + np.sqrt(_ROD**2 - (away**2).sum(axis=2))
    upper, lower = (ends + _ERROR_MM * generator.standard_normal((6, 3)) for ends in (_UPPER, _LOWER))
    rods = _ROD + _ERROR_MM * generator.standard_normal(6)
    way = [0.0, 0.0, 1.0] + _ERROR_RAD * generator.standard_normal((3, 3))
    way = way / np.linalg.norm(way, axis=1)[:, None]
    slid = (height + _ERROR_MM * generator.standard_normal(3))[..., None] * way
    balls = upper + np.tile(slid, (1, 2, 1))
    position, turn = standing(rods, (position, np.tile(np.eye(3), (_STOPS, 1, 1))), balls, lower)
    frame = Rotation.from_rotvec([0.1, -0.2, 0.7]).as_matrix()
    seen = (position + turn @ BALL) @ frame.T + [500.0, 200.0, -100.0]
    seen = seen + NOISE_MM * generator.standard_normal(seen.shape)
    drives = {f"z{k}_mm": column for k, column in enumerate((height - _HEIGHT).T, 1)}
    read = {f"measured_{axis}_mm": column for axis, column in zip("xyz", seen.T, strict=True)}
    return pd.DataFrame({"trajectory": "stops", "target": "ball", **drives, **read})
