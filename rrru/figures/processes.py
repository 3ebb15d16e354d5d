"""Processes that draw figures; they load Matplotlib while the one that asks for figures still computes."""

import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager

# more than these would wait for the largest figure
_MOST = 2


@contextmanager
def drawing_processes() -> Iterator[Executor | None]:
    """Processes for `rrru.figures.drawing.draw_all`, as many as there are cores; None for a single core.

    None as well on a system that cannot synchronise processes. They import the main module of this process anew, which
    has to do nothing then.
    """
    count = min(_MOST, _cores())
    try:
        # a fork of a process with threads can hang
        pool = ProcessPoolExecutor(count, multiprocessing.get_context("spawn")) if count > 1 else None
    except (ImportError, NotImplementedError, OSError):
        pool = None
    if pool is None:
        yield None
        return
    with pool as processes:
        for _ in range(count):
            processes.submit(_load)
        yield processes


def _cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _load() -> None:
    """Load in a process what figures need, Matplotlib's fonts included."""
    import gc
    import io
    import signal

    # the process that asked for figures ends this one
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.disable()
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    import rrru.figures.gap  # noqa: F401

    figure = Figure()
    figure.subplots().set_title("loads the fonts")
    FigureCanvasSVG(figure).print_svg(io.BytesIO())  # type: ignore[no-untyped-call]
    gc.freeze()
