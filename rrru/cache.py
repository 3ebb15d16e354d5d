"""Answers that are kept until others have been asked for."""

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

_Owner = TypeVar("_Owner")
_Answer = TypeVar("_Answer")


def last_kept(method: Callable[[_Owner, Any], _Answer]) -> Callable[[_Owner, Any], _Answer]:
    """A method of one array that keeps its last answer: a search wants slopes where it just wanted residuals."""
    name = f"_last_{method.__name__}"

    @wraps(method)
    def kept(self: _Owner, array: npt.ArrayLike) -> _Answer:
        array = np.asarray(array, dtype=float)
        asked = array.shape, array.tobytes()
        if self.__dict__.get(name, (None,))[0] != asked:
            self.__dict__[name] = asked, method(self, array)
        return cast(_Answer, self.__dict__[name][1])

    return kept


def last_kept_of(method: Callable[[_Owner, Any], _Answer]) -> Callable[[_Owner, Any], _Answer]:
    """A method of one object that never changes, which keeps its answer for the last one."""
    name = f"_last_{method.__name__}"

    @wraps(method)
    def kept(self: _Owner, asked: Any) -> _Answer:
        last = self.__dict__.get(name)
        if last is None or last[0] is not asked:
            last = self.__dict__[name] = asked, method(self, asked)
        return cast(_Answer, last[1])

    return kept


class Latest:
    """Answers by what was asked, so many of the last ones."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._answers: dict[Any, Any] = {}

    def of(self, asked: Any, make: Callable[[], Any]) -> Any:
        """The answer to what is asked, made if it is not there."""
        answer = self._answers.pop(asked) if asked in self._answers else make()
        self._answers[asked] = answer
        if len(self._answers) > self._count:
            del self._answers[next(iter(self._answers))]
        return answer
