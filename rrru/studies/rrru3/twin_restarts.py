"""Search for the twin by restarts, resumable: the same seed gives the same bytes however often it stops.

The objective has many optima. A restart holds several of them, all found by `twin_descent`: first from random
candidates, then from the best of some children of those that it holds. Children take each part of the robot and of its
path from one of two, or have one part drawn anew, or are moved along the difference of two others (differential
evolution: Storn and Price, Journal of Global Optimization 11, 1997), or have random changes. The optimum that a child
descends to replaces the nearest one where that is the same, otherwise the worst. (A memetic algorithm: Neri and Cotta,
Swarm and Evolutionary Computation 2, 2012.) A restart ends where its best no longer improves. The search ends where the
three best restarts agree, or with its time or its number of restarts. The state, a file of JSON, holds all that the
next descent depends on.
"""

import hashlib
import json
import logging
import multiprocessing
import time
from contextlib import contextmanager
from dataclasses import fields
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from rrru.seeds import stream
from rrru.store import json_files
from rrru.studies.rrru3 import twin_objective
from rrru.studies.rrru3.twin import PERIODIC, Twin, parts, settled
from rrru.studies.rrru3.twin_descent import TOLERANCE, descend
from rrru.studies.rrru3.twin_search import WORST, residuals

# restarts that have to agree, and within which share of the objective
AGREEING, AGREEMENT = 3, 0.01
# optima are the same within this root mean square difference of their genes
_SAME = 0.05
# a child's share of a difference, and standard deviations of random changes, one of which is drawn
_SHARES, _CHANGES = (0.2, 0.9), (0.01, 0.03, 0.1)
_LOGGED_EVERY = 10
# of a restart, as they are in its state
_COUNTED = ("number", "evaluations", "descents", "history", "objectives", "stopped")


class Restart:
    """The optima that it holds, best first, its random numbers, and how it got there.

    genes (n, p) in 0..1, objectives: of the optima; history: (evaluations, best objective) after every descent.
    """

    def __init__(self, task, section, number, start=None):
        """start: the Twin about which it begins; otherwise it begins anywhere."""
        self.task, self.section, self.number = task, section, number
        self.low, self.high = np.array(list(task.bounds.values())).T
        self.periodic = np.isin(list(task.bounds), PERIODIC)
        groups = parts(task.bounds)
        # numbers (p,) of the genes' parts
        self._part = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
        self.generator = stream(section["seed"], "twin", number)
        self.start = None if start is None else self._genes(start)
        self.genes, self.objectives = np.empty((0, len(self.low))), []
        self.evaluations, self.descents, self.history, self.stopped = 0, 0, [], ""

    def _genes(self, twin):
        """Genes (p,) of a Twin."""
        return (np.array([twin.values.get(name, 0.0) for name in self.task.bounds]) - self.low) / (self.high - self.low)

    def values(self, genes):
        """Searched values (n, p) of genes (n, p); angles come round."""
        return self.low + np.where(self.periodic, genes % 1.0, np.clip(genes, 0.0, 1.0)) * (self.high - self.low)

    @property
    def best(self):
        """The least objective."""
        return self.objectives[0] if self.objectives else np.inf

    def advance(self, rate):
        """One descent; rate: values (n, p) and a tolerance to residuals (n, m)."""

        def counted(genes, tolerance):
            self.evaluations += len(genes)
            return rate(self.values(genes), tolerance)

        first = self.descents < self.section["members"]
        begin = self._first if first else self._child
        genes, found = descend(counted, begin(counted), self.periodic)
        self.descents += 1
        genes = self._genes(settled(self._twin(genes)))
        value = 0.5 * found @ found + twin_objective.least(self.task.weights)
        self._hold(genes, float(np.nan_to_num(value, nan=WORST)))
        self.history.append((self.evaluations, self.best))
        self._check()

    def _first(self, rate):
        """Where a first descent begins: the start, then near it; without one at the best of random candidates."""
        if self.start is not None:
            spread = self.section["share"] if self.descents else 0.0
            return self._inside(self.start + spread * self.generator.standard_normal(len(self.start)))
        return _best(rate, self.generator.random((self.section["candidates"], len(self.low))))

    def _child(self, rate):
        """Where another descent begins: the best of children of one kind, each kind in turn."""
        shape, kind = (self.section["candidates"], len(self.low)), self.descents % 4
        one, two, three = self.genes[np.resize(self.generator.permutation(len(self.genes)), 3)]
        if kind == 0:
            # some parts from another
            order = self.generator.permuted(np.tile(np.arange(self._part[-1] + 1), (shape[0], 1)), axis=1)
            taken = order < self.generator.integers(1, self._part[-1] + 1, (shape[0], 1))
            children = np.where(taken[:, self._part], two, one)
        elif kind == 1:
            # a part drawn anew
            number = self._part[self.generator.integers(shape[1])]
            children = np.where(self._part == number, self.generator.random(shape), one)
        elif kind == 2:
            # along a difference
            children = one + self.generator.uniform(*_SHARES, (shape[0], 1)) * self._apart(two, three)
        else:
            # a single one with random changes: the best of many would hardly be changed
            children = one + self.generator.choice(_CHANGES) * self.generator.standard_normal((1, shape[1]))
        return _best(rate, self._inside(children))

    def _hold(self, genes, objective):
        """Hold an optimum in place of one that is the same, or of the worst one, where it is better."""
        full = len(self.genes) >= self.section["members"]
        apart = np.sqrt((self._apart(self.genes, genes) ** 2).mean(axis=1))
        if len(apart) and apart.min() < _SAME:
            place = int(apart.argmin())
        else:
            place = len(self.genes) - 1 if full else len(self.genes)
        if place < len(self.genes):
            if objective >= self.objectives[place]:
                return
            self.genes = np.delete(self.genes, place, axis=0)
            del self.objectives[place]
        rank = int(np.searchsorted(self.objectives, objective))
        self.genes = np.insert(self.genes, rank, genes, axis=0)
        self.objectives.insert(rank, objective)

    def _apart(self, genes, others):
        """Differences of genes, the short way round where they are periodic."""
        return np.where(self.periodic, (genes - others + 0.5) % 1.0 - 0.5, genes - others)

    def _inside(self, genes):
        """Genes within the bounds."""
        return np.where(self.periodic, genes % 1.0, np.clip(genes, 0.0, 1.0))

    def _check(self):
        """Whether the restart ends, and why."""
        stall, history = self.section["stall_descents"], self.history
        full = self.descents > self.section["members"]
        if full and len(history) > stall and history[-1 - stall][1] - self.best < self.section["stall_nat"]:
            self.stopped = "stalled"
        elif self.evaluations >= self.section["evaluations"]:
            self.stopped = "evaluations"

    @property
    def twin(self):
        """The best Twin."""
        return self._twin(self.genes[0])

    def _twin(self, genes):
        """The Twin of genes (p,)."""
        return Twin(dict(zip(self.task.bounds, self.values(genes).tolist(), strict=True)))

    def state(self):
        """All that the next descent depends on, for JSON."""
        counted = {name: getattr(self, name) for name in _COUNTED}
        return counted | {"generator": self.generator.bit_generator.state, "genes": self.genes.tolist()}

    @classmethod
    def resumed(cls, task, section, state, start=None):
        """The restart of a state."""
        restart = cls(task, section, state["number"], start)
        restart.generator.bit_generator.state = state["generator"]
        for name in _COUNTED:
            setattr(restart, name, state[name])
        restart.history = [tuple(entry) for entry in state["history"]]
        restart.genes = np.reshape(state["genes"], (-1, len(restart.low)))
        return restart


def _best(rate, genes):
    """The best of genes (n, p) with the tolerance of a descent's beginning."""
    squares = np.nan_to_num((rate(genes, TOLERANCE) ** 2).sum(axis=1), nan=np.inf)
    return genes[squares.argmin()]


def search(task, section, start=None, workers=1, path=None, limit=None):
    """The restarts of a search, and why it ended: "agreed", "restarts" or "time".

    section: the configuration's `twin`; start: a Twin about which the first restart begins, or None; path: file of the
    state, from which an interrupted search goes on; limit: descents after which this call ends, as an interruption
    does. The same seed gives the same restarts on any number of workers.
    """
    key = _key(task, section, start)
    restarts, hours = _read(task, section, start, path, key)
    began, count, ended = time.monotonic() - 3600.0 * hours, 0, _ended(restarts, section, hours)
    with _rating(task, workers) as rate:
        while not ended and (limit is None or count < limit):
            if not restarts or restarts[-1].stopped:
                number = len(restarts)
                restarts.append(Restart(task, section, number, start if number == 0 else None))
            current = restarts[-1]
            current.advance(rate)
            count += 1
            hours = (time.monotonic() - began) / 3600.0
            ended = _ended(restarts, section, hours)
            if path:
                states = [restart.state() for restart in restarts]
                json_files.write({"key": key, "hours": hours, "restarts": states}, path)
            if current.stopped or count % _LOGGED_EVERY == 0:
                at = current.number, current.descents, current.evaluations, current.best, current.objectives[-1]
                logging.info("restart %d: %d descents, %d evaluations, %.3f to %.3f nat %s", *at, current.stopped)
    return restarts, ended


def best(restarts):
    """The restart with the least objective."""
    return min(restarts, key=lambda restart: restart.best)


def tables(restarts, ended):
    """Frames of `twin_restarts` and of `twin_progress`: the descents in which a restart improved, and its last."""
    columns, last, rows = ["restart", "evaluations", "objective_nat"], [], []
    for restart in restarts:
        last.append((restart.number, restart.evaluations, restart.best, restart.stopped or "search", ended))
        before = np.inf
        for evaluations, value in restart.history:
            if value < before or evaluations == restart.evaluations:
                rows.append((restart.number, evaluations, value))
            before = value
    return {
        "twin_restarts": pd.DataFrame(last, columns=[*columns, "stopped", "ended"]),
        "twin_progress": pd.DataFrame(rows, columns=columns),
    }


def _ended(restarts, section, hours):
    """Why the search ends, "" while it does not."""
    done = sorted(restart.best for restart in restarts if restart.stopped == "stalled")
    if len(done) >= AGREEING and done[AGREEING - 1] - done[0] <= AGREEMENT * abs(done[0]):
        return "agreed"
    if len(restarts) >= section["restarts"] and restarts[-1].stopped:
        return "restarts"
    return "time" if hours >= section["hours"] else ""


def _key(task, section, start):
    """Digest of all that a restart depends on; the search may be continued with more hours and more restarts."""
    same = {
        name: value for name, value in section.items() if name not in ("hours", "restarts", "hypotheses", "tradeoff")
    }
    own = [getattr(task, one.name) for one in fields(task) if one.name not in ("mechanism", "draws")]
    parts = [same, own, task.bounds, start and start.values]
    digest = hashlib.sha256(json.dumps(parts, sort_keys=True).encode())
    for drawn in task.draws:
        digest.update(np.ascontiguousarray(drawn).tobytes())
    return digest.hexdigest()[:16]


def _read(task, section, start, path, key):
    """Restarts and hours so far of a state's file; none where there is no file, or one of another search."""
    if path is None or not Path(path).is_file():
        return [], 0.0
    state = json_files.read(path)
    if state["key"] != key:
        logging.warning("%s is the state of another search: not continued", path)
        return [], 0.0
    resumed = [Restart.resumed(task, section, one, None if k else start) for k, one in enumerate(state["restarts"])]
    return resumed, state["hours"]


@contextmanager
def _rating(task, workers):
    """A function from values (n, p) and a tolerance to residuals (n, m), on some processes."""
    if workers == 1:
        yield lambda values, tolerance: np.array([residuals(one, task, tolerance) for one in values])
        return
    with multiprocessing.get_context("spawn").Pool(workers, _set_task, (task,)) as pool:
        yield lambda values, tolerance: np.array(pool.map(partial(_residuals, tolerance), values, chunksize=4))


def _set_task(task):
    """The task of this process."""
    global _task
    _task = task


def _residuals(tolerance, values):
    """Residuals of values (p,) under this process's task."""
    return residuals(values, _task, tolerance)
