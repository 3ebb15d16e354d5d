"""The model of a case linearised about a state: derivatives by calibration, effects, their shapes and the drives."""

from dataclasses import replace

import numpy as np

from rrru.diagnosis.state import LinearizedProblem, State
from rrru.effects.protocol import is_compliant
from rrru.errors import FitError


def linearised(case, state, keys=None):
    """The model of a Case linearised about a state; raises FitError where the state's model has no pose at a point.

    keys: (effect, shape) pairs to make columns for, by default all.
    """
    at, data = case.map_of(State(state.deviations, {})), case.residual(state)
    lost = ~np.isfinite(data).all(axis=1) | ~np.isfinite(at.point_mm[case.at]).all(axis=1)
    if lost.any():
        raise FitError(f"the model has no pose at {int(lost.sum())} points")
    if keys is None:
        keys = [(name, k) for name, effect in case.library.items() for k in range(len(effect.coordinates.shapes))]
    columns = {key: _columns(case, at, key, state) for key in dict.fromkeys((*keys, *state.effects))}
    by_shape = {key[0]: _by_shape(case, at, key, state) for key in state.effects}
    geometry = case.geometry
    for key, coordinates in state.effects.items():
        data = data + columns[key] @ coordinates
    return LinearizedProblem(
        data,
        case.of_rows(at.columns(case.mechanism.directions)),
        columns,
        {name: shape_columns for name, (shape_columns, _) in by_shape.items()},
        {name: steps for name, (_, steps) in by_shape.items()},
        case.of_rows(at.drive_effect),
        *_by_weight(case, at, state, columns),
        (geometry.sd, geometry.mean - state.deviations),
    )


def approach_responses(case, state):
    """Change (m, 3, K) of the readings by a state's effects where each drive comes from below, not with even odds.

    It is of readings where the path does not determine the sense.
    """
    at, approach = case.map_of(State(state.deviations, {})), case.motion.approach
    even = np.where(np.isfinite(approach), 0.0, approach)

    def twists(sense):
        return replace(case, motion=replace(case.motion, approach=sense)).contribution(state).twists

    middle, result = twists(even), np.zeros((len(case), 3, approach.shape[1]))
    for k in range(approach.shape[1]):
        below = even.copy()
        below[np.isfinite(even[:, k]), k] = 1.0
        result[..., k] = case.of_rows(at.move(twists(below) - middle))
    return result


def _by_shape(case, at, key, state):
    """`LinearizedProblem.shape_columns` and `shape_steps` of one effect of the state."""
    shape, effect = state.shape(case.library, key), case.library[key[0]]
    present = state.contribution(case.library, key, case.motion)
    columns, steps = [], []
    for name, value in shape.items():
        stepped = effect.doubted(name, value)
        if stepped != value:
            other = state.contribution(case.library, key, case.motion, shape=dict(shape) | {name: stepped})
            columns.append(case.of_rows(at.move((other - present).twists)))
            steps.append((name, value, stepped))
    nothing = np.zeros((len(case), 3, 0))
    return np.stack(columns, axis=-1) if columns else nothing, tuple(steps)


def _by_weight(case, at, state, columns):
    """`LinearizedProblem.by_weight` of columns, and its `weight_steps`."""
    weight, made = case.weight(state), {key: [] for key in columns if is_compliant(case.library[key[0]])}
    nuisance_sd = {name: sd for name, sd in case.nuisance_sd.items() if sd}
    steps = [(name, weight[name], weight[name] + sd, -weight[name] / sd) for name, sd in nuisance_sd.items()]
    for name, _, stepped, _ in steps:
        other = state.under(weight | {name: stepped})
        for key, parts in made.items():
            parts.append(_columns(case, at, key, other) - columns[key])
    return {key: np.concatenate(parts, axis=-1) for key, parts in made.items() if parts}, tuple(steps)


def _columns(case, at, key, state):
    """Derivative (n, 3, c) by the coordinates of one effect: secants over their present or typical size."""
    functions = case.library[key[0]].along_drives
    if functions is not None:
        response = case.of_rows(at.drive_effect)
        made = (f[case.at][:, None, :] * response[:, :, k, None] for k, f in enumerate(functions(case.motion)))
        return np.concatenate(list(made), axis=-1)
    step = np.array(case.library[key[0]].coordinates.typical)
    if key in state.effects:
        active = state.effects[key]
        step = np.where(np.abs(active) > 1e-3 * step, active, step)
    result = np.empty((len(case), 3, len(step)))
    for k, one in enumerate(np.diag(step)):
        change = state.contribution(case.library, key, case.motion, one)
        result[..., k] = case.of_rows(at.move(change.twists)) / step[k]
    return result
