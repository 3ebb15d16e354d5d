"""A hexapod with backlash that is measured at stops, by NumPy and SciPy alone, without the package's effect models.

Leg k follows its commanded length only when its backlash is used up; what it went through between two stops is a
straight line of the tool or of the drives' values, in 400 steps. Lengths in mm, angles in rad.
"""

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation, Slerp

_AT, _ON = np.radians([20, 100, 140, 220, 260, 340]), np.radians([50, 70, 170, 190, 290, 310])
BASE = 250.0 * np.stack([np.cos(_AT), np.sin(_AT), 0.0 * _AT], axis=1)
PLATFORM = 120.0 * np.stack([np.cos(_ON), np.sin(_ON), 0.0 * _ON], axis=1)
HEIGHT_MM, NOISE_MM, _ERROR_MM = 400.0, 0.01, 0.3
DRIVES = [f"l{k}_mm" for k in range(1, 7)]
PLACES = {"a": (60.0, 10.0, 40.0), "b": (-50.0, 40.0, 70.0)}
_STEPS = 400


def lengths(position, turn):
    """Lengths (n, 6) of the nominal legs at positions (n, 3) and orientations (n, 3, 3)."""
    return np.linalg.norm(position[:, None] + np.einsum("nij,kj->nki", turn, PLATFORM) - BASE, axis=2)


def way(start, end, between):
    """Lengths (400, 6) on the way from one pose (position, orientation) to another, its end included."""
    share = np.linspace(0.0, 1.0, _STEPS + 1)[1:]
    if between == "drives":
        first, last = (lengths(position[None], turn[None])[0] for position, turn in (start, end))
        return first + share[:, None] * (last - first)
    turning = Slerp([0.0, 1.0], Rotation.from_matrix(np.stack([start[1], end[1]])))
    return lengths(start[0] + share[:, None] * (end[0] - start[0]), turning(share).as_matrix())


def poses(order, generator):
    """Positions (125, 3) in no order or row by row, and orientations (125, 3, 3)."""
    if order == "random":
        shares = generator.uniform(-1.0, 1.0, (125, 3))
    else:
        line = np.linspace(-1.0, 1.0, 5)
        planes = ((z, y) for i, z in enumerate(line) for y in line[:: 1 - 2 * (i % 2)])
        shares = np.array([(x, y, z) for k, (z, y) in enumerate(planes) for x in line[:: 1 - 2 * (k % 2)]])
    turn = Rotation.from_rotvec(generator.uniform(-0.2, 0.2, (125, 3))).as_matrix()
    return np.array([0.0, 0.0, HEIGHT_MM]) + shares * [90.0, 90.0, 60.0], turn


def reached(order, between, width_mm, seed=0):
    """Commanded and actual lengths (125, 6) at the stops of legs with backlash, and the poses."""
    position, turn = poses(order, np.random.default_rng(seed))
    commanded = lengths(position, turn)
    length = commanded[0] - 0.5 * width_mm
    actual = [length]
    for k in range(1, len(commanded)):
        for command in way((position[k - 1], turn[k - 1]), (position[k], turn[k]), between):
            length = np.clip(length, command - 0.5 * width_mm, command + 0.5 * width_mm)
        actual.append(length)
    return commanded, np.array(actual), (position, turn)


def standing(wanted, start, base, platform):
    """Poses at which six legs have the wanted lengths (n, 6) or (6,), by Newton from poses (n).

    base: their joints (6, 3), or (n, 6, 3) where drives move them; platform (6, 3): the others, in its frame.
    """
    position, turn = (values.copy() for values in start)
    for _ in range(20):
        arm = np.einsum("nij,kj->nki", turn, platform)
        leg = position[:, None] + arm - base
        length = np.linalg.norm(leg, axis=2)
        along = leg / length[..., None]
        slopes = np.concatenate([along, np.cross(arm, along)], axis=2)
        step = np.linalg.solve(slopes, (wanted - length)[..., None])[..., 0]
        position, turn = position + step[:, :3], Rotation.from_rotvec(step[:, 3:]).as_matrix() @ turn
    assert np.abs(step).max() < 1e-9
    return position, turn


def file_of(order, between, width_mm=0.1, seed=0):
    """What a tracker and the controller write: each leg's commanded length, and both reflectors seen at each stop.

    Joints are off by 0.3 mm, zeros of the lengths as well.
    """
    commanded, actual, start = reached(order, between, np.full(6, width_mm), seed)
    generator = np.random.default_rng(seed + 1000)
    base, platform = (places + _ERROR_MM * generator.standard_normal((6, 3)) for places in (BASE, PLATFORM))
    position, turn = standing(actual + _ERROR_MM * generator.standard_normal(6), start, base, platform)
    seen = np.stack([position + turn @ np.array(place) for place in PLACES.values()], axis=1).reshape(-1, 3)
    seen = seen + NOISE_MM * generator.standard_normal(seen.shape)
    drives = dict(zip(DRIVES, np.repeat(commanded, len(PLACES), axis=0).T, strict=True))
    read = {f"measured_{axis}_mm": column for axis, column in zip("xyz", seen.T, strict=True)}
    return pd.DataFrame({"trajectory": "stops", "target": np.tile([*PLACES], len(commanded)), **drives, **read})
