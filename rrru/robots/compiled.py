"""Objectives that compiled code can call: what a mechanism offers where a Python callable would be too slow."""

from dataclasses import dataclass

import numba
import numpy as np
from numba import types
from numba.extending import intrinsic

# a kernel writes the values (m,) of deviations (m, p); legs (3, k, 1 + p) and points (rows, n) are the robot's own
KERNEL = types.void(types.float64[:, ::1], types.float64[:, :, ::1], types.float64[:, ::1], types.float64[::1])


@dataclass(frozen=True)
class CompiledObjective:
    """A kernel, `numba.cfunc` of the signature KERNEL, and the arrays that it is given; callable from Python."""

    kernel: object
    legs: np.ndarray
    points: np.ndarray

    def __call__(self, deviations):
        """Values (m,) of deviations (m, p); inf where a point leaves the reach."""
        deviations = np.ascontiguousarray(deviations, dtype=float)
        values = np.empty(len(deviations))
        _call(self.kernel, deviations, self.legs, self.points, values)
        return values


@numba.njit(cache=True)
def _call(kernel, deviations, legs, points, values):
    """The kernel called from Python."""
    kernel(deviations, legs, points, values)


@intrinsic
def fma(_typing, _a, _b, _c):
    """The sum a b + c rounded once, said explicitly: what a compiler may fuse depends on what it has inlined."""
    number = types.float64
    return number(number, number, number), lambda _context, builder, _signature, values: builder.fma(*values)
