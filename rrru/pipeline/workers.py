"""Processes for what a diagnosis does not have to wait for: calibrations of the campaign, and drawing.

The first starts with the command and loads its libraries while the file is read. During the diagnosis it makes all
results that need none. Then the second one loads Matplotlib, so that both draw the diagnosis. They write the bytes that
one process writes.
"""

import gc
import os
import shutil
import signal
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from importlib import import_module
from multiprocessing import active_children, get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypeVar

from rrru.errors import FitError
from rrru.store.atomic_write import whole

if TYPE_CHECKING:
    import pandas as pd

_Answer = TypeVar("_Answer")
# the second one begins when the first one waits: two at once would take time from the diagnosis
_PROCESSES = 2
_CALIBRATION = "rrru.pipeline.jobs.campaign_results"
_DRAWING = "rrru.figures.gap"


def usable_cores() -> int:
    """Number of cores that this process may use."""
    # not on macOS and Windows
    affinity: Callable[[int], Collection[int]] | None = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


@contextmanager
def workers(cores: int) -> Iterator["Workers | None"]:
    """Workers while a campaign is diagnosed; None on one core, where they would take the diagnosis's time."""
    if cores < 2:
        yield None
        return
    with TemporaryDirectory() as folder:
        # new interpreters on every system: a forked one has locks of threads that it does not have
        pool = ProcessPoolExecutor(_PROCESSES, get_context("spawn"), _prepare)
        try:
            yield Workers(pool, folder)
        except BaseException:
            # what they do is not needed
            for process in active_children():
                process.terminate()
            raise
        finally:
            pool.shutdown(cancel_futures=True)


class Workers:
    """The processes of a pool. What they make of a campaign is in a temporary folder until its diagnosis is done."""

    def __init__(self, pool: ProcessPoolExecutor, folder: str) -> None:
        self._pool, self._folder = pool, folder
        self._pool.submit(import_module, _CALIBRATION)

    def begin(
        self, config: Mapping[str, Any], name: str, frames: Mapping[str, "pd.DataFrame"], kinds: Collection[str]
    ) -> None:
        """Begin with the files of `rrru.pipeline.jobs.campaign_results.write`."""
        self._written = self._pool.submit(_write, config, name, frames, self._folder, kinds)
        self._written.add_done_callback(self._start_second)

    def finish(self, paths: Mapping[str, str]) -> None:
        """Put the files of `begin` into their places, paths by name; raises what was raised in the worker."""
        from rrru.figures.files import figure_paths
        from rrru.pipeline.jobs.outputs import CAMPAIGN_FIGURES

        figures = figure_paths("", CAMPAIGN_FIGURES)
        for name, made in self._written.result().items():
            if Path(made).exists():
                with whole(paths[name]) as (partial,):
                    shutil.copyfile(made, partial)
            elif name in figures:
                # of an earlier run
                Path(paths[name]).unlink(missing_ok=True)

    def call(self, function: Callable[..., _Answer], *inputs: Iterable[Any]) -> Iterable[_Answer]:
        """As `map`, in the processes, which begin at once."""
        return self._pool.map(function, *inputs)

    def _start_second(self, _written: Future[dict[str, str]]) -> None:
        """Start the second process, which loads Matplotlib."""
        # the command has failed meanwhile
        with suppress(RuntimeError):
            self._pool.submit(import_module, _DRAWING)


def _prepare() -> None:
    """Prepare a worker: it leaves Ctrl-C to the command, and has Matplotlib ready."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # as in the command
    gc.disable()
    import_module(_DRAWING)


def _write(*campaign: Any) -> dict[str, str]:
    """`rrru.pipeline.jobs.campaign_results.write` in a worker."""
    try:
        paths: dict[str, str] = import_module(_CALIBRATION).write(*campaign)
        return paths
    except FitError as error:
        # the state of a fit does not go from one process to another
        raise FitError(str(error)) from None
