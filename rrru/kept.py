"""Answers that are kept until something else is asked."""

from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np
import numpy.typing as npt


def last_kept(method: Callable) -> Callable:
    """A method of one array that keeps its last answer: a search wants slopes where it just wanted residuals."""
    name = f"_last_{method.__name__}"

    @wraps(method)
    def kept(self: Any, array: npt.ArrayLike) -> Any:
        array = np.asarray(array, dtype=float)
        asked = array.shape, array.tobytes()
        if self.__dict__.get(name, (None,))[0] != asked:
            self.__dict__[name] = asked, method(self, array)
        return self.__dict__[name][1]

    return kept
