"""Functions of one variable that an error may follow: a drive's value, the time, the place, the load, the motion.

A function f of a drive's value or speed, or of the time, is added to the drive and moves the positions by J f (J:
derivative by the drive). So is a function of another drive's value: two drives are coupled. Or it is a function of the
place, the time, the payload or the speed for each axis, of the time for each axis of the platform and one target, steps
with the sense of motion of the drives, or a jump at the moment that `rrru.diagnosis.time_jumps` has found. A function
is a Gaussian process of covariance a^2 exp(-d^2 / (2 l^2)) of the distance d, by its values at inducing points (C.
Rasmussen and C. Williams, Gaussian Processes for Machine Learning, 2006, sec. 8.3).
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.spatial.distance import cdist

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.diagnosis.discrepancy_basis import target_sites
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import ModelState
from rrru.diagnosis.time_jumps import jumps
from rrru.kinematics.legs import TOOL, WORLD
from rrru.robots.drive_words import drive_words

TIME = "the time"
JUMP = "a jump at"
# kinds of variables that are alike: one for every drive, or target
OF_DRIVES, OF_ZEROS, OF_RATES, OF_TARGETS, ALONE = "drives", "zeros", "rates", "targets", ""
_JITTER = 1e-8


@dataclass(frozen=True)
class Variable:
    """follows: in words; value (m, d) with its unit; response (m or 1, 3, r): of the positions to the r functions, by
    default each axis has one; steps: the value itself is the function, at each of its columns; kind: one of OF_DRIVES,
    OF_ZEROS, OF_TARGETS and ALONE.
    """

    follows: str
    value: FloatArray
    unit: str
    response: FloatArray = field(default_factory=lambda: np.eye(3)[None])
    steps: bool = False
    kind: str = ALONE
    jump: str = ""

    def design(self, functions: FloatArray) -> FloatArray:
        """What functions (m, f) make of the positions (m, 3, k)."""
        if self.steps:
            return self.response * functions[:, None, :]
        each = functions[:, None, None, :] * self.response[..., None]
        return each.reshape(len(functions), 3, -1)


def variables(problem: DiagnosisProblem, state: ModelState, drive: FloatArray, rows: BoolArray) -> list[Variable]:
    """The variables that may be followed at some rows (m,) of a problem, those that do not change left out.

    drive (m, 3, K): derivative of the rows by the drives at the state.
    """
    drive, motion, at = drive[rows], problem.motion, problem.at[rows]
    names, responses = drive_words(problem.mechanism).all_names, _drive_responses(drive)
    found = _values(problem, rows, responses)
    time_s = motion.time_s[at][:, None]
    found += [
        Variable(f"{TIME}, as a zero offset of {name}", time_s, "s", response, kind=OF_ZEROS)
        for name, response in zip(names, responses, strict=False)
    ]
    found += [
        Variable(f"the speed of {name}", motion.drive_rate[at][:, k : k + 1], f"{unit}/s", response, kind=OF_RATES)
        for k, (name, unit, response) in enumerate(zip(names, problem.mechanism.parts.units, responses, strict=False))
    ]
    found.append(Variable("the place", motion.position_mm[at], "mm"))
    found.append(Variable(TIME, time_s, "s"))
    found += [
        Variable(f"{TIME}, as a shift of {_target(site)}", time_s, "s", response, kind=OF_TARGETS)
        for site, response in _shifts_of_targets(problem, state, rows)
    ]
    found.append(Variable("the payload", motion.payload_kg[at][:, None], "kg"))
    speed = problem.points["speed_mm_s"].to_numpy(dtype=float)[rows]
    found.append(Variable("the speed", speed[:, None], "mm/s"))
    sense = np.sign(np.where(np.abs(motion.drive_rate[at]) > OPTIONS.min_drive_rate, motion.drive_rate[at], 0.0))
    found.append(Variable("the sense of motion of the drives", sense, "1", drive, steps=True))
    return _changing([*found, *_jumps(problem, state, rows)])


def _jumps(problem: DiagnosisProblem, state: ModelState, rows: BoolArray) -> Iterator[Variable]:
    """Jumps of the instrument, of each drive and target and of all of them, as `variables`."""
    names = drive_words(problem.mechanism).all_names
    for jump, response in jumps(problem, state):
        of_one = [f"a shift of {_target(site)}" for site in jump.sites if site != WORLD]
        of_one = [f"a zero offset of {name}" for name in names] if jump.per_leg else of_one
        parts = zip(of_one, np.split(response, len(of_one), axis=-1), strict=True) if of_one else ()
        together = [(jump.follows, response)] if len(of_one) != 1 else []
        for what, columns in (*together, *parts):
            follows, value = f"{JUMP} {jump.moment:.4g} s, as {what}", jump.basis(problem.motion)[problem.at[rows]]
            yield Variable(follows, value, "1", _columns_of_unit_size(columns[rows]), True, jump=jump.name)


def couplings(problem: DiagnosisProblem, drive: FloatArray, rows: BoolArray) -> list[Variable]:
    """The values of drives at some rows (m,) of a problem, each as what another drive errs by; as `variables`."""
    names, responses = drive_words(problem.mechanism).all_names, _drive_responses(drive[rows])
    return [
        replace(own, follows=f"{own.follows}, as an error of {name}", response=response)
        for own in _changing(_values(problem, rows, responses))
        for name, response in zip(names, responses, strict=False)
        if response is not own.response and response.any()
    ]


def _values(problem: DiagnosisProblem, rows: BoolArray, responses: list[FloatArray]) -> list[Variable]:
    """The value of each drive at some rows (m,) as what its own error follows, with responses (m, 3, 1)."""
    value, words = problem.motion.drive[problem.at[rows]], drive_words(problem.mechanism)
    parts = zip(words.all_names, problem.mechanism.parts.units, responses, strict=False)
    return [
        Variable(f"the value of {name}", value[:, k : k + 1], unit, response, kind=OF_DRIVES)
        for k, (name, unit, response) in enumerate(parts)
    ]


def _drive_responses(drive: FloatArray) -> list[FloatArray]:
    """Of each drive the response (m, 3, 1) of unit size of the positions; drive (m, 3, K): their derivative."""
    return [_of_unit_size(drive[:, :, k : k + 1]) for k in range(drive.shape[2])]


def _changing(found: Iterable[Variable]) -> list[Variable]:
    """Those of some variables that are known and change."""
    return [one for one in found if np.isfinite(one.value).all() and np.ptp(one.value, axis=0).max() > 0.0]


def _shifts_of_targets(
    problem: DiagnosisProblem, state: ModelState, rows: BoolArray
) -> Iterator[tuple[str, FloatArray]]:
    """Sites of targets, and what their shifts along the axes of the platform make of some rows (m, 3, 3)."""
    if sites := target_sites(problem.mechanism):
        reading = problem.map_of(state)
        for site in sites:
            yield site, problem.of_rows(reading.effect(site))[rows][..., :3]


def _columns_of_unit_size(response: FloatArray) -> FloatArray:
    """A response (m, 3, r) each of whose columns has an rms of one, or is zero."""
    size = np.sqrt((response**2).mean(axis=(0, 1)))
    return np.asarray(response / np.where(size > 0.0, size, 1.0))


def _of_unit_size(response: FloatArray) -> FloatArray:
    """A response (m, 3, r) of an rms of one: the function has the drive's unit, its size is that of what it makes."""
    return response / max(float(np.sqrt((response**2).mean())), 1e-300)


def _target(site: str) -> str:
    """The target of a site, in words."""
    return "the target" if site == TOOL else site


def process(value: FloatArray, scale: float, spacing: float = 0.0) -> FloatArray:
    """Functions (m, f) of values (m, d) whose independent unit coefficients make a Gaussian process of unit size.

    scale: length scale; spacing: inducing points are no nearer to each other than the values need.
    """
    points = _inducing(value, spacing * scale)
    among = np.exp(-0.5 * (cdist(points, points) / scale) ** 2)
    across = np.exp(-0.5 * (cdist(points, value) / scale) ** 2)
    factor = np.linalg.cholesky(among + _JITTER * np.eye(len(points)))
    return np.asarray(solve_triangular(factor, across, lower=True).T)


def _inducing(value: FloatArray, spacing: float) -> FloatArray:
    """Some of the values (m, d), each the one that is farthest from those before it, until none is farther than a
    spacing.
    """
    value = np.unique(value, axis=0)
    count = min(OPTIONS.remainder_points, len(value))
    chosen, distance = [0], np.linalg.norm(value - value[0], axis=1)
    while len(chosen) < count and distance.max() > spacing:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(value - value[chosen[-1]], axis=1))
    return value[chosen]


class Regression:
    """Least squares of coefficients with a normal prior: design (m, 3, f), data (m, 3), noise per number."""

    def __init__(self, design: FloatArray, data: FloatArray, noise_mm: float) -> None:
        self._design, self._data, self._variance = design, data, noise_mm**2
        flat = design.reshape(-1, design.shape[-1])
        self._gram, self._moment = flat.T @ flat, flat.T @ data.ravel()
        self._value, self._turned = np.linalg.eigh(self._gram)
        self._value = np.maximum(self._value, 0.0)

    def log_evidence(self, amplitude: float) -> float:
        """Log marginal likelihood over that of no coefficients, under their prior deviation."""
        ratio = amplitude**2 / self._variance
        along = self._turned.T @ self._moment
        gained = (along**2 * ratio / (1.0 + ratio * self._value)).sum() / self._variance
        return 0.5 * float(gained - np.log1p(ratio * self._value).sum())

    def left_out(self, fold: IntArray, amplitude: float) -> FloatArray:
        """Predictions (m, 3) of each fold by the others."""
        result, penalty = np.empty_like(self._data), self._variance / amplitude**2 * np.eye(len(self._gram))
        for number in np.unique(fold):
            out = fold == number
            design = self._design[out].reshape(-1, len(self._gram))
            gram = self._gram - design.T @ design + penalty
            moment = self._moment - design.T @ self._data[out].ravel()
            result[out] = (design @ np.linalg.solve(gram, moment)).reshape(-1, 3)
        return result
