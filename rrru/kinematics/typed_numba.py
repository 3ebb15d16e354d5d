"""`numba.njit` for the type checker: numba has no types, and what it decorates would have none either."""

from collections.abc import Callable
from typing import Any, TypeVar

import numba

_Function = TypeVar("_Function", bound=Callable[..., Any])


def njit(**options: Any) -> Callable[[_Function], _Function]:
    """The decorator `numba.njit` with these options; a function that it compiles keeps its signature."""
    decorator: Callable[[_Function], _Function] = numba.njit(**options)
    return decorator
