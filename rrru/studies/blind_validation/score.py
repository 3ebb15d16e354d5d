"""Verdicts compared with the truth that was withheld from the diagnosis. No other code sees both.

And the upper limit of what a campaign's data can show about the cause of its gap, with the true effect model known.
Detection is a likelihood-ratio test: the calibration alone against the calibration with the columns of the true causes.
Shapes, legs and noise are known, sizes are free. Confounding is measured by the chi-square that the best wrong
explanation does not reproduce of the noise-free gap.
"""

from dataclasses import asdict, dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd

from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.state import ModelState
from rrru.effects.library import HOLDS
from rrru.errors import SimulationError
from rrru.studies.blind_validation.causes import EFFECTS
from rrru.studies.blind_validation.draw import fresh
from rrru.studies.blind_validation.parts import causes_of, empty_causes, groups_of, is_enough, parts
from rrru.studies.blind_validation.robots import Conditions, noise_free, robot_of
from rrru.studies.blind_validation.stated import held, state_of
from rrru.studies.blind_validation.verdicts import PLANTS, SEVERAL_CAUSES, is_right, scores

_LIMIT_COLUMNS = ["oracle_chi2", "oracle_freedom", "oracle_detects", "rival", "rival_chi2", "confounded_share"]
# limits are computed for the checks with one or two causes and the stated noise
_CHECKS_WITH_LIMITS = ("label", "effect", *PLANTS)
_FALSE_ALARM_PROBABILITY = 0.01
_TRUE_PREFIX = "true:"
_MAX_RIVALS = 3


class Known(NamedTuple):
    """Conditions of all robots of one file or of our own 3-RRRU, and effects by name of the diagnosis' library."""

    conditions: Conditions
    library: dict = EFFECTS


class Scored(NamedTuple):
    """Frames `withheld_scores`, `withheld_limits`, `withheld_parts` and `withheld_causes`."""

    scores: pd.DataFrame
    limits: pd.DataFrame
    parts: pd.DataFrame
    causes: pd.DataFrame


def score_chunk(answers, measurements, verdicts, stated, states, budget, known):
    """The Scored tables of the robots of a chunk.

    answers, measurements, verdicts, stated, states, budget: frames of these robots; known: Known by the entry of the
    robot's file, with an empty name for our own 3-RRRU.
    """
    robots = answers.merge(verdicts, on=["robot", "kind"]).merge(states, on="robot")
    points, found, on_causes = (dict(list(frame.groupby("robot"))) for frame in (measurements, budget, stated))
    measured, listed, causes = [], [], []
    for row in robots.to_dict("records"):
        name, robot = row["robot"], robot_of(row["drawn"])
        about = known[robot.file]
        taken_out = row["truth"] if row["check"] == "effect" else ""
        parts_of_gap = parts(robot, row["effects"], found[name], about.conditions.noise_rms_mm, taken_out)
        statements = on_causes.get(name, empty_causes())
        right = _right(row, robot, parts_of_gap, groups_of(statements))
        measured.append(_measured(row, robot, points[name], about, taken_out) | {"right": right})
        listed.append(parts_of_gap.assign(check=row["check"], robot=name))
        if len(statements):
            causes.append(causes_of(statements, robot).assign(check=row["check"]))
    robots = robots.assign(**pd.DataFrame(measured, index=robots.index))
    limited = robots.loc[robots["check"].isin(_CHECKS_WITH_LIMITS), ["check", "robot", "weakest", *_LIMIT_COLUMNS]]
    # measurements that allow no test of an effect have no statement
    stated_causes = pd.concat(causes or [empty_causes()], ignore_index=True)
    return Scored(scores(robots), limited, pd.concat(listed, ignore_index=True), stated_causes)


def _right(row, robot, listed, groups):
    """Whether the verdict of a row on a robot is correct.

    listed: the robot's rows of `withheld_parts`; groups: of causes that are confounded in the verdict.
    """
    if row["check"] in SEVERAL_CAUSES:
        return is_enough(listed, row["strength"], groups)
    effects = row["effects"]
    if robot.file:
        effects = "+".join(name for name in effects.split("+") if name not in robot.also_allowed) or effects
    return is_right(row["truth"], effects, row["check"])


def _measured(row, robot, points, about, taken_out):
    """Columns that need the robot itself: limits, true explained fraction of the gap, coverage of its numbers."""
    calibrated, state, effects = state_of(row, about.library)
    problem = _problem(points.reset_index(drop=True), about, about.library)
    closed = true_share(robot, about, problem.mechanism, calibrated, (state, effects))
    numbers, hold = held(row["numbers"], robot.numbers(about.conditions))
    columns = {"file": robot.file, "cause": robot.cause, "share_closed_true": closed, "numbers": numbers, "held": hold}
    return columns | asdict(_limits(row, robot, points, about, calibrated, taken_out))


def _limits(row, robot, points, about, calibrated, taken_out):
    """The Limits of a robot."""
    if row["check"] not in _CHECKS_WITH_LIMITS:
        return Limits()
    if robot.file:
        return of_displacement(robot.oracle_chi2)
    problem = _problem(points.reset_index(drop=True), about, with_truth(about.library, robot.acting))
    return limits(problem, calibrated, robot.acting, _rivals(about.library, taken_out))


def _rivals(library, taken_out):
    """Names of the effects that may be a wrong explanation.

    Not among them: the effect taken out, effects with it as a special case, and effects with many coefficients. The
    last are confounded with everything that depends on the actuator positions.
    """
    few = [name for name, effect in library.items() if not effect.coordinates.broad]
    return [name for name in few if name != taken_out and taken_out not in HOLDS.get(name, ())]


def _problem(measurements, about, library, mechanism=None):
    """The DiagnosisProblem of measurements under Known; the mechanism is by default the one that these observe."""
    conditions = about.conditions
    mechanism = mechanism or conditions.seen(measurements)
    return make_diagnosis_problem(measurements, mechanism, conditions.masses, conditions.noise_mm, library)


def true_share(robot, about, mechanism, calibrated, corrected):
    """Fraction of the true gap that the corrected model explains on new runs.

    NaN without a gap, with a lost pose, and where MuJoCo does not bring the robot to rest.

    mechanism: with the calibrated parameters; corrected: the ModelState and its effects by name.
    """
    state, effects = corrected
    try:
        driven = noise_free(fresh(robot, about.conditions), about.conditions) if robot.causes else None
    except SimulationError:
        driven = None
    if driven is None:
        return np.nan
    problem = _problem(driven, about, about.library, mechanism)
    problem = replace(problem, library=problem.library | effects).standing(state)
    # an effect that depends on the direction of approach predicts nothing where that direction is unknown
    known = problem.complete({name for name, _ in state.effects} & problem.known.keys())
    before, after = problem.residual(ModelState(calibrated, {}))[known], problem.residual(state)[known]
    return float(1.0 - (after**2).sum() / (before**2).sum())


# --- limits


@dataclass(frozen=True)
class Limits:
    """Columns of `withheld_limits`; the defaults hold where nothing acts that the data could show."""

    oracle_chi2: float = 0.0
    oracle_freedom: int = 0
    oracle_detects: bool = False
    rival: str = ""
    rival_chi2: float = np.nan
    confounded_share: float = np.nan


def of_displacement(gain):
    """Limits of data whose chi-square drops by a gain when the true displacement is fitted, its size free."""
    from scipy.stats import chi2

    return Limits(gain, 1, bool(gain > chi2.ppf(1.0 - _FALSE_ALARM_PROBABILITY, 1)))


def with_truth(library, acting):
    """A library by name together with the acting causes in their true shapes."""
    return library | {f"{_TRUE_PREFIX}{one.effect}": one.effect_model for one in acting}


def limits(problem, deviations, acting, names):
    """Limits of a campaign from its problem, calibrated deviations (p,), acting causes, and names of possible rivals.

    The problem's library holds the acting causes too, see `with_truth`.
    """
    from scipy.stats import chi2

    causes = {(f"{_TRUE_PREFIX}{cause.effect}", 0): cause for cause in acting}
    if not causes or any(name not in problem.library for name, _ in causes):
        return Limits()
    known = [name for name in names if name in problem.library]
    rivals = [(name, shape) for name in known for shape in range(len(problem.library[name].coordinates.shapes))]
    reduced = _Reduced(problem, deviations, [*causes, *rivals])
    true = np.concatenate([reduced.columns[key][:, _free(cause)] for key, cause in causes.items()], axis=1)
    gain = float((reduced.data**2).sum() - _residual_square(true, reduced.data))
    freedom = int(np.linalg.matrix_rank(true))
    signal = sum(reduced.columns[key] @ np.array(cause.coordinates) for key, cause in causes.items())
    truth = frozenset(one.effect for one in acting)
    # a cause outside the library may be confounded with several effects at once
    max_size = len(causes) if truth <= set(names) else _MAX_RIVALS
    rival, left = reduced.rival(signal, truth, rivals, max_size)
    share = 1.0 - float(np.sqrt(left / (signal**2).sum()))
    return Limits(gain, freedom, bool(gain > chi2.ppf(1.0 - _FALSE_ALARM_PROBABILITY, freedom)), rival, left, share)


def _free(cause):
    """Which coordinates (c,) of a cause are free: those of its leg, or all where its leg is 0."""
    legs = cause.effect_model.coordinates.legs
    return legs == cause.leg if cause.leg else np.ones(len(legs), dtype=bool)


def _residual_square(columns, target):
    """Residual sum of squares of a target (n,) after a least-squares fit of columns (n, k)."""
    fitted, *_ = np.linalg.lstsq(columns, target, rcond=1e-10)
    return float(((target - columns @ fitted) ** 2).sum())


class _Reduced:
    """Data and columns in units of the noise, calibration projected out, reduced to few rows by QR."""

    def __init__(self, problem, deviations, keys):
        self._library = problem.library
        linear = problem.linearise(ModelState(deviations, {}), list(keys))
        rows = linear.data.size
        base, _ = np.linalg.qr(linear.base.reshape(rows, -1))
        columns = [linear.columns[key].reshape(rows, -1) for key in keys]
        together = np.concatenate([*columns, linear.data.reshape(rows, 1)], axis=1) / problem.noise_mm
        triangle = np.linalg.qr(together - base @ (base.T @ together), mode="r")
        ends = np.cumsum([column.shape[1] for column in columns])
        self.columns = dict(zip(keys, np.split(triangle[:, :-1], ends[:-1], axis=1), strict=True))
        self.data = triangle[:, -1]

    def rival(self, signal, truth, rivals, max_size):
        """Name and chi-square of the wrong set, of at most max_size effects, that best reproduces a signal (k,)."""
        best = ("", np.inf)
        for size in range(1, max_size + 1):
            for keys in combinations(rivals, size):
                names = frozenset(name for name, _ in keys)
                if len(names) < size or names == truth:
                    continue
                left = self._residual_square_of(keys, signal)
                if left < best[1]:
                    best = ("+".join(sorted(names)), left)
        return best

    def _residual_square_of(self, keys, signal):
        """Residual sum of squares of a signal (k,) after the fit of a set, positive coordinates bounded at zero."""
        columns = np.concatenate([self.columns[key] for key in keys], axis=1)
        positive = np.concatenate([self._library[name].coordinates.positive for name, _ in keys])
        left = _residual_square(columns, signal)
        if not positive.any():
            return left
        from scipy.optimize import lsq_linear

        scale = np.linalg.norm(columns, axis=0)
        scale = np.where(scale > 0.0, scale, 1.0)
        low = np.where(positive, 0.0, -np.inf)
        return 2.0 * float(lsq_linear(columns / scale, signal, bounds=(low, np.inf), method="bvls").cost)
