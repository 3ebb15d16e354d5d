"""The unexplained part of a gap: which variable it depends on, how smoothly, and how large it is.

A Gaussian process of one variable at a time is fitted to the residuals of the verdict's model with its calibration. It
is a function f of a drive's value, or of the time, that is added to the drive and moves the positions by J f (J:
derivative by the drive). Or it is a function of the place, the time, the payload or the speed for each axis, of the
time for each axis of the platform and one target, or steps with the sense of motion of the drives. Of each the
calibration absorbs what it absorbs of the readings. Its covariance is a^2 exp(-d^2 / (2 l^2)) of the distance d, by its
values at inducing points (C. Rasmussen and C. Williams, Gaussian Processes for Machine Learning, 2006, sec. 8.3); a and
l have the highest marginal likelihood of a grid. Each fold, a fifth of all stretches of five points, is predicted from
the others.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from scipy.linalg import solve_triangular
from scipy.spatial.distance import cdist

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.cache import cached_on
from rrru.diagnosis.discrepancy_basis import target_sites
from rrru.diagnosis.heldout import within
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.state import LeftByCalibration, LinearizedProblem
from rrru.effects.protocol import Effect
from rrru.kinematics.legs import TOOL
from rrru.robots.drive_words import drive_words

COLUMNS = ("follows", "explained", "scale", "unit", "rms_mm")
NO_REMAINDER = pd.DataFrame(columns=COLUMNS)
# deviations of the function over the rms of the remainder
_AMPLITUDES = (0.3, 1.0, 3.0)
_JITTER = 1e-8
_TIME = "the time"


@dataclass(frozen=True)
class _Variable:
    """follows: in words; value (n, d) with its unit; response (n, 3, r): of the positions to the r functions, by
    default each axis has one; steps: the value itself is the function, at each of its columns.
    """

    follows: str
    value: FloatArray
    unit: str
    response: FloatArray = field(default_factory=lambda: np.eye(3)[None])
    steps: bool = False


@cached_on
def remainder_rows(inference: InferenceResult) -> pd.DataFrame:
    """Rows of `gap_remainder` without the campaign, the variable that explains most first.

    explained: share of the mean square, noise taken off, that is predicted at left-out points, 0 to 1; scale: distance
    over which the function changes, in the unit of its variable, NaN for steps; rms_mm: of the prediction.
    """
    problem = inference.problem
    rows = problem.on_robot
    calibration = _calibration(inference.evidence.linear, rows)
    # a fit with a smooth discrepancy leaves to that what the calibration could absorb
    left = _left(calibration, problem.residual(inference.state)[rows])
    stretch = within(problem.run, problem.stop) // OPTIONS.points_per_stretch + problem.run
    fold = (stretch % OPTIONS.stretch_folds)[rows]
    noise = left.size * (1.0 - calibration.taken) * problem.noise_mm**2
    beyond = (left**2).sum() - noise
    result = []
    for variable in _variables(inference, rows) if beyond > 0.0 else ():
        predicted, scale = _predicted(variable, left, fold, problem.noise_mm, calibration)
        explained = 1.0 - (((left - predicted) ** 2).sum() - noise) / beyond
        rms = float(np.sqrt((predicted**2).sum(axis=1).mean()))
        result.append((variable.follows, float(np.clip(explained, 0.0, 1.0)), scale, variable.unit, rms))
    result.sort(key=lambda row: -row[1])
    return pd.DataFrame(result, columns=COLUMNS)


def followed_alike(
    inference: InferenceResult, rows: pd.DataFrame, names: Collection[str]
) -> tuple[tuple[str, ...], float]:
    """Which of some effects of the fit follow the same variable as the remainder, and the remainder's rms in mm.

    rows: of `gap_remainder`; names: of effects. It is for a remainder of which one variable predicts most. An effect is
    such a one if it depends on that variable alone and most of its part is a function as smooth as the one found. For
    the time these are effects that need the time, for the drives' values and the place effects that need nothing but
    the drives' values.
    """
    best = rows.iloc[0] if len(rows) else None
    if best is None or best["explained"] < OPTIONS.min_followed_share:
        return (), 0.0
    problem, linear, state = inference.problem, inference.evidence.linear, inference.state
    on_robot = problem.on_robot
    calibration = _calibration(linear, on_robot)
    variable = next(one for one in _variables(inference, on_robot) if one.follows == best["follows"])
    scaled = dict(_functions(variable))
    functions = scaled[best["scale"]] if best["scale"] in scaled else next(iter(scaled.values()))
    design = _left(calibration, _design(variable, functions)).reshape(3 * int(on_robot.sum()), -1)
    found = []
    for key, coordinates in state.effects.items():
        part = _left(calibration, (linear.columns[key] @ coordinates)[on_robot]).ravel()
        fitted = design @ np.linalg.lstsq(design, part, rcond=1e-3)[0]
        if (
            key[0] in names
            and _depends_on(problem.effects[key[0]], best["follows"])
            and ((part - fitted) ** 2).sum() < (1.0 - OPTIONS.min_followed_share) * (part**2).sum()
        ):
            found.append(key[0])
    return tuple(found), float(best["rms_mm"]) if found else 0.0


def _calibration(linear: LinearizedProblem, rows: BoolArray) -> LeftByCalibration:
    """What a plain least-squares calibration leaves at some rows."""
    return LeftByCalibration(linear.at(rows).calibration_basis, np.full(int(rows.sum()), True))


def _left(calibration: LeftByCalibration, values: FloatArray) -> FloatArray:
    """Residuals of values (m, 3) or (m, 3, k) after a calibration."""
    return calibration.residual(values.reshape(3 * len(values), -1)).reshape(values.shape)


def _depends_on(effect: Effect, follows: str) -> bool:
    """Whether an effect depends on the variable, in words, and on no other except those that it determines."""
    return "time_s" in effect.needs if follows.startswith(_TIME) else not effect.needs


def _variables(inference: InferenceResult, rows: BoolArray) -> list[_Variable]:
    """The variables that may be followed at some rows (m,) of a problem, those that do not change left out."""
    problem, drive = inference.problem, inference.evidence.linear.drive[rows]
    motion, at = problem.motion, problem.at[rows]
    words, units = drive_words(problem.mechanism), problem.mechanism.parts.units
    names = words.all_names
    found = [
        _Variable(f"the value of {name}", motion.drive[at, k : k + 1], unit, _of_unit_size(drive[:, :, k : k + 1]))
        for k, (name, unit) in enumerate(zip(names, units, strict=False))
    ]
    time_s = motion.time_s[at][:, None]
    found += [
        _Variable(f"{_TIME}, as a zero offset of {name}", time_s, "s", _of_unit_size(drive[:, :, k : k + 1]))
        for k, name in enumerate(names[: len(units)])
    ]
    found.append(_Variable("the place", motion.position_mm[at], "mm"))
    found.append(_Variable(_TIME, time_s, "s"))
    found += [
        _Variable(f"{_TIME}, as a shift of {_target(site)}", time_s, "s", response)
        for site, response in _shifts_of_targets(inference, rows)
    ]
    found.append(_Variable("the payload", motion.payload_kg[at][:, None], "kg"))
    speed = problem.points["speed_mm_s"].to_numpy(dtype=float)[rows]
    found.append(_Variable("the speed", speed[:, None], "mm/s"))
    sense = np.sign(np.where(np.abs(motion.drive_rate[at]) > OPTIONS.min_drive_rate, motion.drive_rate[at], 0.0))
    found.append(_Variable("the sense of motion of the drives", sense, "1", drive, steps=True))
    return [one for one in found if np.isfinite(one.value).all() and np.ptp(one.value, axis=0).max() > 0.0]


def _shifts_of_targets(inference: InferenceResult, rows: BoolArray) -> Iterator[tuple[str, FloatArray]]:
    """Sites of targets, and what their shifts along the axes of the platform make of some rows (m, 3, 3)."""
    problem = inference.problem
    if sites := target_sites(problem.mechanism):
        reading = problem.map_of(inference.state)
        for site in sites:
            yield site, problem.of_rows(reading.effect(site))[rows][..., :3]


def _of_unit_size(response: FloatArray) -> FloatArray:
    """A response (m, 3, r) of an rms of one: the function has the drive's unit, its size is that of what it makes."""
    return response / max(float(np.sqrt((response**2).mean())), 1e-300)


def _target(site: str) -> str:
    """The target of a site, in words."""
    return "the target" if site == TOOL else site


def _predicted(
    variable: _Variable, left: FloatArray, fold: IntArray, noise_mm: float, calibration: LeftByCalibration
) -> tuple[FloatArray, float]:
    """What a function of a variable predicts (m, 3) of the rows left out in each fold, and its scale.

    left (m, 3): the remainder; fold (m,): of its rows; calibration: absorbs of a function what it did of the readings.
    """
    highest, best = -np.inf, None
    size = float(np.sqrt((left**2).mean()))
    for scale, functions in _functions(variable):
        design = _left(calibration, _design(variable, functions))
        unit = size / max(float(np.sqrt((design**2).sum(axis=-1).mean())), 1e-300)
        regression = _Regression(design * unit, left, noise_mm)
        for amplitude in _AMPLITUDES:
            evidence = regression.log_evidence(amplitude)
            if evidence > highest:
                highest, best = evidence, (regression, amplitude, scale)
    # a variable that changes has functions of finite evidence
    assert best is not None
    regression, amplitude, scale = best
    return regression.left_out(fold, amplitude), scale


def _design(variable: _Variable, functions: FloatArray) -> FloatArray:
    """What functions (m, f) of a variable make of the positions (m, 3, k)."""
    if variable.steps:
        return variable.response * functions[:, None, :]
    each = functions[:, None, None, :] * variable.response[..., None]
    return each.reshape(len(functions), 3, -1)


def _functions(variable: _Variable) -> Iterator[tuple[float, FloatArray]]:
    """Pairs of a scale and functions (m, f) at the values, whose independent unit coefficients make the process."""
    value = variable.value
    if variable.steps:
        yield np.nan, value
        return
    width = float(np.linalg.norm(np.ptp(value, axis=0)))
    points = _inducing(value)
    for share in OPTIONS.remainder_scales:
        scale = share * width
        among = np.exp(-0.5 * (cdist(points, points) / scale) ** 2)
        across = np.exp(-0.5 * (cdist(points, value) / scale) ** 2)
        factor = np.linalg.cholesky(among + _JITTER * np.eye(len(points)))
        yield scale, solve_triangular(factor, across, lower=True).T


def _inducing(value: FloatArray) -> FloatArray:
    """Some of the values (m, d), each the one that is farthest from those before it."""
    value = np.unique(value, axis=0)
    count = min(OPTIONS.remainder_points, len(value))
    chosen, distance = [0], np.linalg.norm(value - value[0], axis=1)
    while len(chosen) < count:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(value - value[chosen[-1]], axis=1))
    return value[chosen]


class _Regression:
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
