"""Minima of calibrations with unknown instrument frame and targets: random robots, compared with SciPy.

Arms of six and seven axes, columns that lift an arm, gantries and hexapods, with errors of all their numbers; the
instrument up to 2 m and any turn off, up to three targets up to 0.3 m from the tool, 60 to 140 poses. SciPy starts at
the truth, this package at nothing. A search counts as ended at the minimum within a millionth of its sum of squares.
Seconds of one calibration, and how many ended there.
"""

import os
import statistics
import sys

from benchmarks import harness
from benchmarks.harness import OURS, Task
from tests.estimation.from_truth import outcome_of
from tests.estimation.random_robots import KINDS

_EACH = 75
_SEARCHES = {
    "calibrate": "calibration",
    "core": "the estimation core from the nominal robot",
    "frames": "frames and targets alone",
}


def rows_of(kind, count):
    """Rows of one kind of robot, one per search."""
    found = [outcome_of(kind, seed) for seed in range(count)]
    for name, what in _SEARCHES.items():
        task = Task("solver", f"{kind} of unknown frame and targets, {what}", count)
        reached, raised = sum(one.reached(name) for one in found), [one.messages.get(name) for one in found]
        silent = sum(not one.reached(name) and name not in one.messages for one in found)
        note = f"{reached} of {count} at the minimum from the truth, {silent} elsewhere without a message"
        for message in dict.fromkeys(filter(None, raised)):
            print(f"{kind}, {what}: {message}", file=sys.stderr)
        ratios = [one.seconds["truth"] / one.seconds[name] for one in found]
        yield task.row(OURS, statistics.median(one.seconds[name] for one in found), [1.0], note=note)
        if name == "core":
            seconds = statistics.median(one.seconds["truth"] for one in found)
            yield task.row("SciPy, from the truth, our model", seconds, ratios)


def rows():
    """Rows of the group; the environment's SOLVER_CAMPAIGNS says how many campaigns of each kind."""
    count = int(os.environ.get("SOLVER_CAMPAIGNS", _EACH))
    return [row for kind in KINDS for row in rows_of(kind, count)]


if __name__ == "__main__":
    harness.store("solver", rows())
