"""Caches of the latest results."""

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

_Owner = TypeVar("_Owner")
_Answer = TypeVar("_Answer")


def last_cached(method: Callable[[_Owner, Any], _Answer]) -> Callable[[_Owner, Any], _Answer]:
    """Cache the last result of a method of one array: a search needs derivatives where it just needed residuals.

    The method gets a copy of the array. Arrays of the result are read-only: all callers share them.
    """
    name = _key(method)

    @wraps(method)
    def cached(self: _Owner, array: npt.ArrayLike) -> _Answer:
        array = np.array(array, dtype=float)
        asked = array.shape, array.tobytes()
        if self.__dict__.get(name, (None,))[0] != asked:
            self.__dict__[name] = asked, read_only(method(self, array))
        return cast(_Answer, self.__dict__[name][1])

    return cached


def last_cached_of(method: Callable[[_Owner, Any], _Answer]) -> Callable[[_Owner, Any], _Answer]:
    """Cache the last result of a method of one object that never changes; arrays of the result are read-only."""
    name = _key(method)

    @wraps(method)
    def cached(self: _Owner, asked: Any) -> _Answer:
        last = self.__dict__.get(name)
        if last is None or last[0] is not asked:
            last = self.__dict__[name] = asked, read_only(method(self, asked))
        return cast(_Answer, last[1])

    return cached


def cached_on(function: Callable[[_Owner], _Answer]) -> Callable[[_Owner], _Answer]:
    """Cache the result of a function of one object that never changes, on that object; callers do not change it."""
    name = _key(function)

    @wraps(function)
    def cached(asked: _Owner) -> _Answer:
        if name not in asked.__dict__:
            asked.__dict__[name] = function(asked)
        return cast(_Answer, asked.__dict__[name])

    return cached


def _key(method: Callable[..., Any]) -> str:
    """Where an object stores the result: a method and the one of a base class that it overrides have a place each."""
    return f"_last_{method.__module__}.{method.__qualname__}"


def read_only(answer: _Answer) -> _Answer:
    """A result whose arrays cannot be changed in place, those in tuples, mappings and dataclasses included."""
    if isinstance(answer, np.ndarray):
        answer.flags.writeable = False
    elif isinstance(answer, tuple | list):
        for part in answer:
            read_only(part)
    elif isinstance(answer, Mapping):
        for part in answer.values():
            read_only(part)
    elif is_dataclass(answer):
        for one in fields(answer):
            read_only(getattr(answer, one.name))
    return answer


class Latest:
    """Cache of the last `count` results by key."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._answers: dict[Any, Any] = {}

    def of(self, asked: Any, make: Callable[[], Any]) -> Any:
        """The result of a key, computed by `make` if it is not cached."""
        answer = self._answers.pop(asked) if asked in self._answers else make()
        self._answers[asked] = answer
        if len(self._answers) > self._count:
            del self._answers[next(iter(self._answers))]
        return answer
