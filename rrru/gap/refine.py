"""Fitting the numbers of a hypothesis together with the calibration's, on the exact sim."""

from contextlib import suppress

import numpy as np

from rrru.effects.protocol import gives_way
from rrru.errors import FitError
from rrru.gap.state import State
from rrru.gap.terms import spread
from rrru.gap.weight import WEIGHT

_STEPS, _HALVINGS = 6, 5
# relative gain in the sum of squares below which the search has ended
_ENOUGH = 1e-4
# fits that differ by less are as likely
_ALIKE_NATS = 1.0
# one step moves a shape's parameter by no more than this many of its standard deviations
_MOST_SHAPE_STEPS = 1.5


def refine(case, starts, hypothesis, level):
    """State of the hypothesis fitted on the exact sim, from the first State of some starts that leads straight there.

    Where none does, the first that is as likely as the best of all: a calibration that has gone far to hide an effect
    is a place that nothing leads away from. Returns (state, covariance (k, k) of the terms' coefficients). Raises
    FitError where the sim loses its pose.
    """
    case = case.at_complete(hypothesis.effects)
    fits, straight = [], False
    for start in starts:
        with suppress(FitError):
            *fit, straight = _descent(case, start, hypothesis, level)
            fits.append(fit)
        if straight:
            break
    if not fits:
        names = ", ".join(term.effect for term in hypothesis.terms)
        raise FitError(f"the sim with {names} loses its pose")
    enough = min(cost for cost, *_ in fits) + 2.0 * _ALIKE_NATS * case.noise_mm**2
    return next((state, covariance) for cost, state, covariance in fits if cost <= enough)


def _descent(case, state, hypothesis, level):
    """Gauss-Newton on a renewed linearisation, steps halved where worse: cost, state, covariance, whether none was."""
    keys = [(term.effect, term.shape) for term in hypothesis.terms]
    library, strengths = case.library, hypothesis.strengths[level]
    shapes = {key[0]: state.shape(library, key) for key in keys}
    if any(case.doubts.values()) and any(gives_way(library[name]) for name, _ in keys):
        shapes[WEIGHT] = case.weight(state)
    numbers = {key: state.effects.get(key, np.zeros(len(library[key[0]].coordinates))) for key in keys}
    state = State(state.deviations, numbers, shapes)
    cost, covariance, straight = _cost(case, state), None, True
    for _ in range(_STEPS):
        linear = case.linearise(state, keys)
        evidence = case.evidence(linear)
        mean, covariance = evidence.coefficients(hypothesis.terms, strengths, level)
        target = _target(case, linear, state, hypothesis, mean)
        last = cost
        for halving in range(_HALVINGS):
            trial = _between(state, target, 0.5**halving)
            trial_cost = _cost(case, trial)
            if trial_cost < cost:
                state, cost, straight = trial, trial_cost, straight and not halving
                break
        if not cost < last * (1.0 - _ENOUGH):
            break
    else:
        straight = False
    if not np.isfinite(cost):
        raise FitError("loses its pose")
    count = sum(spread(library[t.effect].coordinates, t.legs).shape[1] for t in hypothesis.terms)
    return cost, state, covariance[:count, :count], straight


def _target(case, linear, state, hypothesis, mean):
    """The state that the linearisation asks for: the terms' coefficients, their shapes, the calibration beside them."""
    effects, start, library = {}, 0, case.library
    for term in hypothesis.terms:
        matrix = spread(library[term.effect].coordinates, term.legs)
        effects[term.effect, term.shape] = matrix @ mean[start : start + matrix.shape[1]]
        start += matrix.shape[1]
    rest = linear.data - sum(linear.columns[key] @ value for key, value in effects.items())
    shapes = dict(state.shape_values)
    for term in hypothesis.terms:
        for k, (name, value, stepped) in enumerate(linear.shape_steps[term.effect]):
            share = float(np.clip(mean[start], -_MOST_SHAPE_STEPS, _MOST_SHAPE_STEPS))
            bounds = library[term.effect].parameters[name]
            moved = float(np.clip(value + share * (stepped - value), bounds.low, bounds.high))
            shapes[term.effect] = dict(shapes[term.effect]) | {name: moved}
            rest = rest - share * linear.shape_columns[term.effect][..., k]
            start += 1
    if state.weight:
        shares = np.clip(mean[start:], -_MOST_SHAPE_STEPS, _MOST_SHAPE_STEPS)
        for (name, value, stepped, _), share in zip(linear.weight_steps, shares.tolist(), strict=True):
            moved = float(np.clip(value + share * (stepped - value), *case.bounds[name]))
            shapes[WEIGHT] = shapes[WEIGHT] | {name: moved}
        for key, numbers in effects.items():
            if key in linear.by_weight:
                each = linear.by_weight[key].reshape(*rest.shape, len(shares), -1)
                rest = rest - (each @ numbers) @ shares
    change, *_ = np.linalg.lstsq(linear.base.reshape(rest.size, -1), rest.ravel(), rcond=None)
    return State(state.deviations + change, effects, shapes)


def _between(first, second, share):
    """The state at a share of the way from one to another with the same effects."""
    effects = {key: first.effects[key] + share * (second.effects[key] - first.effects[key]) for key in second.effects}
    shapes = {
        name: {
            k: first.shape_values[name][k] + share * (value - first.shape_values[name][k]) for k, value in shape.items()
        }
        for name, shape in second.shape_values.items()
    }
    return State(first.deviations + share * (second.deviations - first.deviations), effects, shapes)


def _cost(case, state):
    """Sum of squares of the exact sim's residuals; inf where it has no pose."""
    cost = float((case.residual(state) ** 2).sum())
    return cost if np.isfinite(cost) else np.inf
