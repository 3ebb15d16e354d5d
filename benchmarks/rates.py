"""The arithmetic of a pose of the objective, at this core's rate of each kind.

Counted in `rrru.robots.rrru3_objective`: operations a point and individual, for two Newton steps. What is the same for
all points of an individual, its legs' numbers except cosines and sines, is left out.
"""

from time import process_time

import numba
import numpy as np

from benchmarks.harness import Call
from rrru.kinematics.compiled import fma

LIMIT = "limit: its arithmetic at this core's rates"
# a leg's closure: 12 multiply-adds, 9 products and sums, a root; the three equations: 19 and 20, a division; before
# them 24 multiply-adds make the start, after them 2, 5 and a root the distance
_STEPS, _LEGS = 2, 3
_SIMPLE = (24 + _STEPS * (_LEGS * 12 + 19) + 2) + (_STEPS * (_LEGS * 9 + 20) + 5)
_ROOTS, _DIVISIONS = _STEPS * _LEGS + 1, _STEPS
_NUMBERS, _DEEP = 512, 8

_compiled = numba.njit(error_model="numpy")


@_compiled
def _multiply_adds(count, x, y):
    """Multiply-adds, few enough on one number in a row that none waits for the one before."""
    for _ in range(count // (x.size * _DEEP)):
        for j in range(x.size):
            number = x[j]
            for _ in range(_DEEP):
                number = fma(number, 0.5, 0.5)
            y[j] = number
        x[0] += 1.0


@_compiled
def _roots(count, x, y):
    """Square roots."""
    for k in range(count // x.size):
        x[k % x.size] += 1.0
        for j in range(x.size):
            y[j] = np.sqrt(x[j])


@_compiled
def _divisions(count, x, y):
    """Divisions."""
    for k in range(count // x.size):
        x[k % x.size] += 1.0
        for j in range(x.size):
            y[j] = 1.0 / x[j]


@_compiled
def _turns(count, x, y):
    """Cosines and as many sines."""
    for k in range(count // x.size):
        x[k % x.size] += 1.0
        for j in range(x.size):
            y[j] = np.cos(x[j]) + np.sin(x[j])


def limit_call(points, poses=200_000):
    """A Call of only the arithmetic of poses, where `points` share an individual."""
    x, y = np.linspace(0.5, 1.5, _NUMBERS), np.empty(_NUMBERS)

    def work():
        _multiply_adds(poses * _SIMPLE, x, y)
        _roots(poses * _ROOTS, x, y)
        _divisions(poses * _DIVISIONS, x, y)
        _turns(poses * _LEGS // points, x, y)

    return Call(work, poses)


def in_words():
    """The counts and this core's rates."""
    x, y = np.linspace(0.5, 1.5, _NUMBERS), np.empty(_NUMBERS)
    counts = {_multiply_adds: 50_000_000, _roots: 2_000_000, _divisions: 2_000_000, _turns: 200_000}
    rates = []
    for function, count in counts.items():
        function(count, x, y)
        spent = []
        for _ in range(9):
            start = process_time()
            function(count, x, y)
            spent.append(process_time() - start)
        rates.append(1e-9 * count / np.median(spent))
    simple, root, division, turn = rates
    return (
        f"a pose: {_SIMPLE} multiply-adds, products and sums at {simple:.3g}e9/s, {_ROOTS} roots at {root:.3g}e9/s, "
        f"{_DIVISIONS} divisions at {division:.3g}e9/s; an individual: 3 cosines and 3 sines at {2.0 * turn:.2g}e9/s"
    )
