"""Objectives that compiled code can call, for the genetic algorithm, where a Python callable would be too slow."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import numba
import numba.experimental.function_type  # registers the protocol below
import numpy as np
from numba import types
from numba.extending import intrinsic

from rrru.arrays import FloatArray

# arguments of a kernel: deviations (m, p) of m candidates, two arrays of the robot's own, legs (3, k, 1 + p) and points
# (rows, n), and the values (m,) that it writes
SIGNATURE = types.void(types.float64[:, ::1], types.float64[:, :, ::1], types.float64[:, ::1], types.float64[::1])


class Kernel(types.WrapperAddressProtocol):
    """A function compiled for SIGNATURE, which compiled functions take as an argument without being compiled for it."""

    def __init__(self, function: Callable[[FloatArray, FloatArray, FloatArray, FloatArray], None]) -> None:
        self.function = numba.njit(cache=True, error_model="numpy")(function)
        self.function.compile(SIGNATURE.args)
        # numba states no attributes of a compile result
        result: Any = self.function.get_compile_result(SIGNATURE)
        self._address: int = result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name)

    def __wrapper_address__(self) -> int:
        """Address of the machine code."""
        return self._address

    def signature(self) -> Any:
        """SIGNATURE, for numba."""
        return SIGNATURE


@dataclass(frozen=True)
class CompiledObjective:
    """A Kernel with the two arrays of its robot, see SIGNATURE; callable from Python, too."""

    kernel: Kernel
    legs: FloatArray
    points: FloatArray

    def __call__(self, deviations: FloatArray) -> FloatArray:
        """Values (m,) of deviations (m, p); inf where a point is out of reach."""
        values = np.empty(len(deviations))
        self.kernel.function(np.ascontiguousarray(deviations, dtype=float), self.legs, self.points, values)
        return values


def _fma(_typing: Any, _a: Any, _b: Any, _c: Any) -> tuple[Any, Callable[..., Any]]:
    """Fused multiply-add a b + c, rounded once. It is explicit, as what a compiler fuses depends on what it inlines."""
    number = types.float64
    return number(number, number, number), lambda _context, builder, _signature, values: builder.fma(*values)


# compiled code alone calls it, with three numbers: numba adds the typing context
fma = cast(Callable[[float, float, float], float], intrinsic(_fma))
