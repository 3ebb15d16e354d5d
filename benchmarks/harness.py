"""Seconds of calls made in turns in one process, and their table.

The machine's speed changes from second to second, so that a figure is a ratio of two calls made one right after the
other, and the results of many such pairs are their median and quartiles (as pytest-benchmark does; pyperf and asv
compare runs minutes apart). Calls shorter than `_SHORTEST_S` are repeated within a pair (as timeit does).
"""

import resource
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
import pandas as pd

from rrru.store import tables
from rrru.store.schema import read_tables

RESULTS = Path(__file__).resolve().parents[1] / "results"
OURS = "rrru"
TABLE = read_tables("""
## benchmarks | tables/benchmarks.parquet | what peer size
Seconds of this package compared with alternatives, from `make bench`.
--
group                  str    the script of benchmarks/ that measured it
what                   str    the task
peer                   str    the package
size                   int    size of the task: points, poses, robots, individuals or campaigns, as the task says
seconds                float? median; of a pose, a run, a fit or a campaign, as the task says; null where the peer could
    not be installed or did not reach the goal
ratio                  float? median of the peer's seconds over this package's, of pairs made in turns; null with the
    seconds
low                    float? lower quartile of the ratio
high                   float? upper quartile of the ratio
evaluations            float? median evaluations of the objective, of searches
memory_mib             float? most memory of the process, where it was measured
note                   str    a note; empty for none
""")[0]

_SHORTEST_S, _BUDGET_S, _ROUNDS, _LEAST_ROUNDS = 0.02, 40.0, 15, 3


@dataclass(frozen=True)
class Call:
    """A timed function, and its number of units per call; seconds are per unit."""

    function: Callable
    units: int = 1

    def seconds(self, loops):
        """Seconds of this process per unit."""
        start = process_time()
        for _ in range(loops):
            self.function()
        return (process_time() - start) / (loops * self.units)

    def loops(self):
        """Number of calls for a long enough timing, after a first call that may compile."""
        self.function()
        loops = 1
        while (spent := self.seconds(loops) * loops * self.units) < _SHORTEST_S:
            loops = max(2 * loops, int(loops * _SHORTEST_S / max(spent, 1e-9)))
        return loops


@dataclass(frozen=True)
class Task:
    """Group, task and its size: common columns of the rows of one task."""

    group: str
    what: str
    size: int

    def row(self, peer, seconds=None, ratios=(), **more):
        """The row of a peer: median seconds, median and quartiles of its ratios."""
        low, ratio, high = np.quantile(ratios, [0.25, 0.5, 0.75]) if len(ratios) else [None] * 3
        spent = {"seconds": seconds, "ratio": ratio, "low": low, "high": high}
        others = {"evaluations": None, "memory_mib": None, "note": ""}
        return {"group": self.group, "what": self.what, "size": self.size, "peer": peer} | spent | others | more

    def in_turns(self, ours, peers, notes=None):
        """Rows of Calls: `peers` by name, each followed by `ours` in every round.

        Seconds are those of this process, so that what else runs on the machine counts little. Rounds end after
        `_BUDGET_S`, three are made in any case.
        """
        notes, started = notes or {}, perf_counter()
        own_loops, loops = ours.loops(), {name: call.loops() for name, call in peers.items()}
        own, theirs = {name: [] for name in peers}, {name: [] for name in peers}
        for done in range(_ROUNDS):
            if done >= _LEAST_ROUNDS and perf_counter() - started > _BUDGET_S:
                break
            for name, call in peers.items():
                theirs[name].append(call.seconds(loops[name]))
                own[name].append(ours.seconds(own_loops))
        every = [second for seconds in own.values() for second in seconds]
        rows = [self.row(OURS, statistics.median(every), [1.0], note=notes.get(OURS, ""))]
        for name in peers:
            ratios = np.divide(theirs[name], own[name])
            rows.append(self.row(name, statistics.median(theirs[name]), ratios, note=notes.get(name, "")))
        return rows


def peak_mib():
    """Peak memory of this process."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def part(group):
    """Path of a group's rows."""
    return RESULTS / "benchmarks" / f"{group}.parquet"


def store(group, rows):
    """Write a group's rows and print them."""
    frame = pd.DataFrame(rows)
    numbers = ["seconds", "ratio", "low", "high", "evaluations", "memory_mib"]
    frame = frame.astype(dict.fromkeys(numbers, float))
    part(group).parent.mkdir(parents=True, exist_ok=True)
    tables.write(TABLE, frame, part(group))
    print(frame.drop(columns="group").to_string(index=False, float_format=lambda value: f"{value:.3g}"), flush=True)
