"""Processes that need the same kernel at once: one compiles it, the others wait and load it from Numba's cache.

Without a cache, as in a new clone, two of pytest's workers and two jobs of the shared run each took as long to compile
the kernels of a diagnosis. A lock ends with the process that holds it.
"""

import fcntl
from contextlib import contextmanager
from functools import wraps
from pathlib import Path

from numba.core.dispatcher import Dispatcher

_compile, _held = Dispatcher.compile, []


@contextmanager
def _alone(dispatcher):
    """While no other process compiles the function; what it calls is compiled under its lock."""
    folder = Path(dispatcher._cache.cache_path)
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        _held.append(lock)
        try:
            yield
        finally:
            _held.pop()


@wraps(_compile)
def _compile_once(dispatcher, signature):
    if _held or dispatcher._cache.cache_path is None:
        return _compile(dispatcher, signature)
    with _alone(dispatcher):
        return _compile(dispatcher, signature)


def install():
    """Replace how Numba compiles in this process and in those that are forked from it."""
    Dispatcher.compile = _compile_once
