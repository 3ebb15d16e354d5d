"""The model of a problem linearised about a state: derivatives by calibration, effects, their shapes and the drives."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rrru.arrays import FloatArray
from rrru.diagnosis.aliases import EffectKey, WeightStep
from rrru.diagnosis.state import LinearizedProblem, ModelState
from rrru.effects.protocol import is_compliant
from rrru.errors import FitError
from rrru.kinematics.parameter_jacobian import TwistMap

if TYPE_CHECKING:
    from rrru.diagnosis.problem import DiagnosisProblem


def linearised(
    problem: DiagnosisProblem, state: ModelState, keys: Iterable[EffectKey] | None = None
) -> LinearizedProblem:
    """The model of a problem linearised about a state; raises FitError where the state's model has no pose at a point.

    keys: (effect, shape) pairs to make columns for, by default all.
    """
    at, data = problem.map_of(ModelState(state.deviations, {})), problem.residual(state)
    lost = ~np.isfinite(data).all(axis=1) | ~np.isfinite(at.point_mm[problem.at]).all(axis=1)
    if lost.any():
        first = problem.points[["run", "point"]].iloc[int(np.argmax(lost))]
        where = f"{int(lost.sum())} readings, first in run {first['run']:g} at point {first['point']:g}"
        allowed = "poses at which the loops of the robot close with its errors: leave out those next to a singularity"
        raise FitError(f"the calibrated model has no pose at {where}; allowed: {allowed}")
    if keys is None:
        keys = [(name, k) for name, effect in problem.library.items() for k in range(len(effect.coordinates.shapes))]
    columns = {key: _columns(problem, at, key, state) for key in dict.fromkeys((*keys, *state.effects))}
    by_shape = {key[0]: _by_shape(problem, at, key, state) for key in state.effects}
    geometry = problem.geometry
    for key, coordinates in state.effects.items():
        data = data + columns[key] @ coordinates
    return LinearizedProblem(
        data,
        problem.of_rows(at.columns(problem.mechanism.directions)),
        columns,
        {name: shape_columns for name, (shape_columns, _) in by_shape.items()},
        {name: steps for name, (_, steps) in by_shape.items()},
        problem.of_rows(at.drive_effect),
        *_by_weight(problem, at, state, columns),
        (geometry.sd, geometry.mean - state.deviations),
    )


def approach_responses(problem: DiagnosisProblem, state: ModelState) -> FloatArray:
    """Change (m, 3, K) of the readings by a state's effects where each drive comes from below, not with even odds.

    It is of readings where the path does not determine the sense.
    """
    at, approach = problem.map_of(ModelState(state.deviations, {})), np.asarray(problem.motion.approach)
    even = np.where(np.isfinite(approach), 0.0, approach)

    def twists(sense: FloatArray) -> FloatArray | float:
        return replace(problem, motion=replace(problem.motion, approach=sense)).contribution(state).twists

    middle, result = twists(even), np.zeros((len(problem), 3, approach.shape[1]))
    for k in range(approach.shape[1]):
        below = even.copy()
        below[np.isfinite(even[:, k]), k] = 1.0
        result[..., k] = problem.of_rows(at.move(twists(below) - middle))
    return result


def _by_shape(
    problem: DiagnosisProblem, at: TwistMap, key: EffectKey, state: ModelState
) -> tuple[FloatArray, tuple[tuple[str, float, float], ...]]:
    """`LinearizedProblem.shape_columns` and `shape_steps` of one effect of the state."""
    shape = state.shape(problem.library, key)
    present = state.contribution(problem.library, key, problem.motion)
    columns, steps = [], []
    for name, value in shape.items():
        stepped = problem.effects[key[0]].doubted(name, value)
        if stepped != value:
            other = state.contribution(problem.library, key, problem.motion, shape=dict(shape) | {name: stepped})
            columns.append(problem.of_rows(at.move((other - present).twists)))
            steps.append((name, value, stepped))
    nothing = np.zeros((len(problem), 3, 0))
    return np.stack(columns, axis=-1) if columns else nothing, tuple(steps)


def _by_weight(
    problem: DiagnosisProblem, at: TwistMap, state: ModelState, columns: dict[EffectKey, FloatArray]
) -> tuple[dict[EffectKey, FloatArray], tuple[WeightStep, ...]]:
    """`LinearizedProblem.by_weight` of columns, and its `weight_steps`."""
    weight = problem.weight(state)
    made: dict[EffectKey, list[FloatArray]] = {key: [] for key in columns if is_compliant(problem.library[key[0]])}
    nuisance_sd = {name: sd for name, sd in problem.nuisance_sd.items() if sd}
    steps = [(name, weight[name], weight[name] + sd, -weight[name] / sd) for name, sd in nuisance_sd.items()]
    for name, _, stepped, _ in steps:
        other = state.under(weight | {name: stepped})
        for key, parts in made.items():
            parts.append(_columns(problem, at, key, other) - columns[key])
    return {key: np.concatenate(parts, axis=-1) for key, parts in made.items() if parts}, tuple(steps)


def _columns(problem: DiagnosisProblem, at: TwistMap, key: EffectKey, state: ModelState) -> FloatArray:
    """Derivative (n, 3, c) by the coordinates of one effect: secants over their present or typical size."""
    functions = problem.library[key[0]].along_drives
    if functions is not None:
        response = problem.of_rows(at.drive_effect)
        made = (f[problem.at][:, None, :] * response[:, :, k, None] for k, f in enumerate(functions(problem.motion)))
        return np.concatenate(list(made), axis=-1)
    step = np.array(problem.library[key[0]].coordinates.typical)
    if key in state.effects:
        active = state.effects[key]
        step = np.where(np.abs(active) > 1e-3 * step, active, step)
    result = np.empty((len(problem), 3, len(step)))
    for k, one in enumerate(np.diag(step)):
        change = state.contribution(problem.library, key, problem.motion, one)
        result[..., k] = problem.of_rows(at.move(change.twists)) / step[k]
    return result
