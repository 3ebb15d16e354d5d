"""Fitting the numbers of a hypothesis together with the calibration's, on the exact sim."""

import numpy as np

from rrru.errors import FitError
from rrru.gap.case import State
from rrru.gap.evidence import Evidence
from rrru.gap.terms import spread

_STEPS, _HALVINGS = 6, 5
# relative gain in the sum of squares below which the search has ended
_ENOUGH = 1e-4


def refine(case, state, hypothesis, level):
    """State of the hypothesis fitted from a start: Gauss-Newton with renewed linearisation and halved steps where the
    exact sim gets worse.

    Returns (state, covariance (k, k) of the terms' coefficients). Raises FitError where the sim loses its pose.
    """
    keys = [(term.effect, term.shape) for term in hypothesis.terms]
    library, strengths = case.library, hypothesis.strengths[level]
    state = State(
        state.deviations,
        {key: state.effects.get(key, np.zeros(len(library[key[0]].coordinates))) for key in keys},
        {key[0]: state.shape(library, key) for key in keys},
    )
    cost = _cost(case, state)
    covariance = None
    for _ in range(_STEPS):
        linear = case.linearise(state, keys)
        evidence = Evidence(library, linear, case.run, case.noise_mm)
        mean, covariance = evidence.posterior(hypothesis.terms, strengths, level)
        target = _target(linear, state, hypothesis, mean, library)
        last = cost
        for halving in range(_HALVINGS):
            trial = _between(state, target, 0.5**halving)
            trial_cost = _cost(case, trial)
            if trial_cost < cost:
                state, cost = trial, trial_cost
                break
        if not cost < last * (1.0 - _ENOUGH):
            break
    if not np.isfinite(cost):
        raise FitError(f"the sim with {', '.join(key[0] for key in keys)} loses its pose")
    count = sum(spread(library[t.effect].coordinates, t.legs).shape[1] for t in hypothesis.terms)
    return state, covariance[:count, :count]


def _coordinates(library, terms, coefficients):
    """Coordinates (c,) by (effect, shape) from the terms' coefficients in order."""
    result, start = {}, 0
    for term in terms:
        matrix = spread(library[term.effect].coordinates, term.legs)
        result[term.effect, term.shape] = matrix @ coefficients[start : start + matrix.shape[1]]
        start += matrix.shape[1]
    return result


def _target(linear, state, hypothesis, mean, library):
    """The state that the linearisation asks for: the terms' coefficients, their shapes, and the calibration that goes
    with them.
    """
    effects = _coordinates(library, hypothesis.terms, mean)
    rest = linear.data - sum(linear.columns[key] @ value for key, value in effects.items())
    shapes, start = dict(state.shapes), len(mean) - sum(columns.shape[-1] for columns in linear.laws.values())
    for term in hypothesis.terms:
        law, steps = linear.laws[term.effect], linear.reshaped[term.effect]
        start += law.shape[-1]
        for k, (name, value, stepped) in enumerate(steps):
            row = len(steps) - k
            share = float(np.clip(mean[start - row], -1.5, 1.5))
            parameter = library[term.effect].parameters[name]
            moved = float(np.clip(value + share * (stepped - value), parameter.low, parameter.high))
            shapes[term.effect] = dict(shapes[term.effect]) | {name: moved}
            rest = rest - share * law[..., -row]
    change, *_ = np.linalg.lstsq(linear.base.reshape(rest.size, -1), rest.ravel(), rcond=None)
    return State(state.deviations + change, effects, shapes)


def _between(first, second, share):
    """The state at a share of the way from one to another with the same effects."""
    effects = {key: first.effects[key] + share * (second.effects[key] - first.effects[key]) for key in second.effects}
    shapes = {
        name: {k: first.shapes[name][k] + share * (value - first.shapes[name][k]) for k, value in shape.items()}
        for name, shape in second.shapes.items()
    }
    return State(first.deviations + share * (second.deviations - first.deviations), effects, shapes)


def _cost(case, state):
    """Sum of squares of the exact sim's residuals; inf where it has no pose."""
    cost = float(((case.measured_mm - case.exact(state)) ** 2).sum())
    return cost if np.isfinite(cost) else np.inf
