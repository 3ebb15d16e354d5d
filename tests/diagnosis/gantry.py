"""A gantry of three slides that is driven along lines, a rectangle and a wave, and its machine written down by hand.

The machine uses none of the package's legs and effects. Lengths mm, angles rad, times s.
"""

from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.campaign import measurements as rows
from rrru.effects.motion import Course, make_motion
from rrru.kinematics.dynamics import Masses
from rrru.robots.from_dh import from_dh

RANGES_MM = np.array([[0.0, 1500.0], [0.0, 1000.0], [0.0, 600.0]])
_TOOL_MM = (0.0, 0.0, 200.0)
# slides along x, along y and downwards
GANTRY = from_dh(
    [
        {"rpy_deg": [0, 90, 0]},
        {"sliding": True, "alpha_deg": -90, "range_mm": [0, 1500], "mass_kg": 60},
        {"sliding": True, "theta_deg": -90, "alpha_deg": -90, "range_mm": [0, 1000], "mass_kg": 20},
        {"sliding": True, "range_mm": [0, 600], "mass_kg": 8},
    ],
    name="gantry",
    tool_mm=_TOOL_MM,
    parameter_set="full",
)
NOISE_MM = 0.01
_AXES = np.array([[1.0, 2e-4, 1e-4], [-4e-4, 1.0, 3e-4], [3e-4, 5e-4, -1.0]])
_STEP_S, _REST_S, _FINE = 4.0, 30.0, 40


def _straight(ends, count):
    """Points (n, 3) evenly along straight lines through ends (k, 3)."""
    ends, share = np.array(ends, dtype=float), np.arange(count)[:, None] / count
    return np.concatenate([*(a + share * (b - a) for a, b in pairwise(ends)), ends[-1:]])


_PATHS = {
    "rising": _straight([(100, 100, 100), (1400, 900, 500)], 25),
    "falling": _straight([(100, 900, 100), (1400, 100, 500)], 25),
    "around": _straight([(200, 200, 300), (1300, 200, 300), (1300, 800, 300), (200, 800, 300), (200, 200, 300)], 12),
    "wave": np.stack(
        [
            np.linspace(150.0, 1350.0, 40),
            500.0 + 300.0 * np.sin(np.linspace(0.0, 9.0, 40)),
            300.0 + 200.0 * np.cos(np.linspace(0.0, 7.0, 40)),
        ],
        axis=1,
    ),
}


def motion_of(way, time):
    """The motion of drive values (n, 3) at times (n,), of which nothing else is known."""
    nothing = np.full(way.shape, np.nan)
    course = Course(GANTRY.forward(way), way, way, np.arange(len(way)), time, nothing, nothing, nothing[:, 0])
    return make_motion(GANTRY, Masses(0.0, 0.0, 0.0), course)


class _Backlash:
    """Drives that are at one side of their backlash (3,) until they have been pushed through it."""

    def __init__(self, width_mm, start):
        self._half, self._at = np.asarray(width_mm) / 2.0, np.asarray(start, dtype=float)

    def driven(self, way):
        """Where the drives are after going along values (n, 3)."""
        for one in way:
            self._at = np.clip(self._at, one - self._half, one + self._half)
        return self._at


def campaign(backlash_mm=(0.0, 0.0, 0.0), grown=lambda way, time: 0.0, seed=1):
    """A table of every path there and back, twice; grown: what is added to values (3,) at a time."""
    generator, tables, time = np.random.default_rng(seed), [], 0.0
    passes = [(name, path[::step]) for _ in range(2) for name, path in _PATHS.items() for step in (1, -1)]
    backlash, last = _Backlash(backlash_mm, passes[0][1][0]), passes[0][1][0]
    for number, (name, path) in enumerate(passes, 1):
        real, times = [], []
        for way in path:
            drives = backlash.driven(last + np.linspace(0.0, 1.0, _FINE)[:, None] * (way - last))
            real.append(drives + grown(way, time))
            times.append(time)
            last, time = way, time + _STEP_S
        time += _REST_S
        seen = np.array(real) @ _AXES + NOISE_MM * generator.standard_normal((len(path), 3))
        numbers = {"trajectory": name, "run": number, "point": np.arange(1, len(path) + 1), "time_s": times}
        drives = dict(zip(GANTRY.parts.columns, path.T, strict=True))
        command, measured = GANTRY.forward(path), _as_measured(seen)
        positions = rows.vector_columns("command", command) | rows.vector_columns("measured", measured)
        tables.append(pd.DataFrame(numbers | positions | drives))
    return pd.concat(tables, ignore_index=True).assign(speed_mm_s=np.nan, payload_kg=np.nan, status="ok")


def with_backlash(width_mm):
    """Where slides stand that are driven to values (n, 3) in order and have backlash (3,)."""

    def erring(way):
        backlash = _Backlash(width_mm, way[0])
        return np.array([backlash.driven(one[None]) for one in way])

    return erring


def stops(erring, count=70, seed=1, share=0.9):
    """A table of so many stops at random; erring: from values (n, 3) of the slides to those where they stand.

    share: of the ranges, about their middle, in which the stops are.
    """
    generator = np.random.default_rng(seed)
    middle = 0.5 * (1.0 + share * generator.uniform(-1.0, 1.0, (count, 3)))
    way = RANGES_MM[:, 0] + np.ptp(RANGES_MM, axis=1) * middle
    seen = erring(way) @ _AXES + NOISE_MM * generator.standard_normal((count, 3))
    numbers = {"trajectory": "stops", "run": 1, "point": np.arange(1, count + 1), "time_s": np.nan}
    drives = dict(zip(GANTRY.parts.columns, way.T, strict=True))
    positions = rows.vector_columns("command", GANTRY.forward(way))
    positions |= rows.vector_columns("measured", _as_measured(seen))
    table = pd.DataFrame(numbers | positions | drives)
    return table.assign(speed_mm_s=np.nan, payload_kg=np.nan, status="ok")


def _as_measured(seen):
    """Positions (n, 3) in the frame of an instrument that stands almost where the robot's does."""
    return Rotation.from_rotvec([1e-3, -2e-3, 5e-4]).apply(seen) + np.array([0.4, -0.3, -200.2])
