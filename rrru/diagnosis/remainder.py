"""The unexplained part of a gap: which variable it depends on, how smoothly, and how large it is.

A function of one variable at a time, see `rrru.diagnosis.smooth_functions`, is fitted to the residuals of the verdict's
model with its calibration, which absorbs of it what it absorbs of the readings. Size and length scale have the highest
marginal likelihood of a grid. Each fold, a fifth of all stretches of five points, is predicted from the others.
"""

from collections.abc import Collection, Iterator

import numpy as np
import pandas as pd

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.cache import cached_on
from rrru.diagnosis.discrepancy_basis import lone_jump
from rrru.diagnosis.heldout import within
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.smooth_functions import JUMP, TIME, Regression, Variable, couplings, process, variables
from rrru.diagnosis.state import LeftByCalibration, LinearizedProblem
from rrru.effects.protocol import Effect

COLUMNS = ("follows", "explained", "scale", "unit", "rms_mm")
NO_REMAINDER = pd.DataFrame(columns=COLUMNS)
# deviations of the function over the rms of the remainder
_AMPLITUDES = (0.3, 1.0, 3.0)


@cached_on
def remainder_rows(inference: InferenceResult) -> pd.DataFrame:
    """Rows of `gap_remainder` without the campaign, the variable that explains most first.

    A jump that is the only function of the most probable hypothesis comes before it: stops on both sides of a pause do
    not distinguish a jump from a function of the time. Of all drives or targets and of one it is that of the highest
    evidence.

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
    hypothesis, _ = inference.posterior.best()
    jump, result, first = lone_jump(hypothesis.effects), [], {}
    for variable in _variables(inference, rows) if beyond > 0.0 else ():
        predicted, scale, evidence = _predicted(variable, left, fold, problem.noise_mm, calibration)
        explained = 1.0 - (((left - predicted) ** 2).sum() - noise) / beyond
        rms = float(np.sqrt((predicted**2).sum(axis=1).mean()))
        result.append((variable.follows, float(np.clip(explained, 0.0, 1.0)), scale, variable.unit, rms))
        if variable.jump in jump:
            first[variable.follows] = evidence
    result.sort(key=lambda row: (-first.get(row[0], -np.inf), -row[1]))
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
    design = _left(calibration, variable.design(functions)).reshape(3 * int(on_robot.sum()), -1)
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
    return "time_s" in effect.needs if follows.startswith((TIME, JUMP)) else not effect.needs


def _variables(inference: InferenceResult, rows: BoolArray) -> list[Variable]:
    """The variables that the remainder may follow at some rows (m,)."""
    problem, drive = inference.problem, inference.evidence.linear.drive
    return [*variables(problem, inference.state, drive, rows), *couplings(problem, drive, rows)]


def _predicted(
    variable: Variable, left: FloatArray, fold: IntArray, noise_mm: float, calibration: LeftByCalibration
) -> tuple[FloatArray, float, float]:
    """What a function of a variable predicts (m, 3) of the rows left out in each fold, its scale and log evidence.

    left (m, 3): the remainder; fold (m,): of its rows; calibration: absorbs of a function what it did of the readings.
    """
    highest, best = -np.inf, None
    size = float(np.sqrt((left**2).mean()))
    for scale, functions in _functions(variable):
        design = _left(calibration, variable.design(functions))
        unit = size / max(float(np.sqrt((design**2).sum(axis=-1).mean())), 1e-300)
        regression = Regression(design * unit, left, noise_mm)
        for amplitude in _AMPLITUDES:
            evidence = regression.log_evidence(amplitude)
            if evidence > highest:
                highest, best = evidence, (regression, amplitude, scale)
    # a variable that changes has functions of finite evidence
    assert best is not None
    regression, amplitude, scale = best
    return regression.left_out(fold, amplitude), scale, highest


def _functions(variable: Variable) -> Iterator[tuple[float, FloatArray]]:
    """Pairs of a scale and functions (m, f) at the values, whose independent unit coefficients make the process."""
    if variable.steps:
        yield np.nan, variable.value
        return
    width = float(np.linalg.norm(np.ptp(variable.value, axis=0)))
    for share in OPTIONS.remainder_scales:
        yield share * width, process(variable.value, share * width)
