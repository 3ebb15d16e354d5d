"""Search for the twin by restarts of CMA-ES, resumable: the same seed gives the same bytes however often it stops.

Every restart begins at another place and ends where it no longer improves. The search ends where the three best
restarts agree, or with its time or its number of restarts. The state, a file of JSON, holds all that the next
generation depends on.
"""

import hashlib
import json
import logging
import multiprocessing
import time
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path

import numpy as np
import pandas as pd

from rrru.genetic.cma_es import Distribution
from rrru.seeds import stream
from rrru.store import json_files
from rrru.studies.rrru3.twin import PERIODIC, Twin
from rrru.studies.rrru3.twin_search import cost

# restarts that have to agree, and within which share of the objective
AGREEING, AGREEMENT = 3, 0.01
_ARRAYS = ("mean", "path", "steps", "covariance", "axes", "lengths")
# generations between two files of the state
_SAVED_EVERY = 10


class Restart:
    """One run of CMA-ES: its distribution, its random numbers, the best so far and how it got there."""

    def __init__(self, task, section, number, start=None):
        """start: the Twin about which it begins; otherwise it begins at the best of random candidates."""
        self.task, self.section, self.number = task, section, number
        self.low, self.high = np.array(list(task.bounds.values())).T
        self.periodic = np.isin(list(task.bounds), PERIODIC)
        self.generator = stream(section["seed"], "twin", number)
        self.evaluations, self.best, self.genes, self.history, self.stopped = 0, np.inf, None, [], ""
        self.distribution = None
        if start is not None:
            values = [start.values.get(name, 0.0) for name in task.bounds]
            self._begin((np.array(values) - self.low) / (self.high - self.low), section["share"])

    def _begin(self, genes, spread):
        """Begin the distribution about genes (p,)."""
        self.distribution = Distribution(len(genes), self.section["population"], genes, spread)

    def values(self, genes):
        """Searched values (n, p) of genes (n, p); angles come round."""
        return self.low + np.where(self.periodic, genes % 1.0, np.clip(genes, 0.0, 1.0)) * (self.high - self.low)

    def advance(self, rate):
        """One generation, the first of the start itself; rate: values (n, p) to objectives (n,)."""
        if self.distribution is not None and not self.history:
            self._rated(rate, self.distribution.mean[None])
        elif self.distribution is None:
            genes = self.generator.random((self.section["candidates"], len(self.low)))
            scores = self._rated(rate, genes)
            self._begin(genes[scores.argmin()], self.section["spread"])
        else:
            genes = self.distribution.draw(self.generator)
            genes = np.where(self.periodic, genes, np.clip(genes, 0.0, 1.0))
            self.distribution.learn(genes[np.argsort(self._rated(rate, genes), kind="stable")])
        self._check()

    def _rated(self, rate, genes):
        """Objectives (n,) of genes (n, p), counted and compared with the best."""
        scores = rate(self.values(genes))
        self.evaluations += len(genes)
        if scores.min() < self.best:
            self.best, self.genes = float(scores.min()), genes[scores.argmin()]
        self.history.append((self.evaluations, self.best))
        return scores

    def _check(self):
        """Whether the restart ends, and why."""
        stall, history = self.section["stall_generations"], self.history
        if len(history) > stall and history[-1 - stall][1] - self.best < self.section["stall_nat"]:
            self.stopped = "stalled"
        elif self.evaluations >= self.section["evaluations"]:
            self.stopped = "evaluations"

    @property
    def twin(self):
        """The best Twin."""
        return Twin(dict(zip(self.task.bounds, self.values(self.genes).tolist(), strict=True)))

    def state(self):
        """All that the next generation depends on, for JSON."""
        now = self.distribution
        return {
            "generator": self.generator.bit_generator.state,
            "genes": None if self.genes is None else self.genes.tolist(),
            **{name: getattr(self, name) for name in ("number", "evaluations", "best", "history", "stopped")},
            "distribution": now
            and {"size": now.size, "learned": now.learned, **{name: getattr(now, name).tolist() for name in _ARRAYS}},
        }

    @classmethod
    def resumed(cls, task, section, state):
        """The restart of a state."""
        restart = cls(task, section, state["number"])
        restart.generator.bit_generator.state = state["generator"]
        restart.evaluations, restart.best, restart.stopped = state["evaluations"], state["best"], state["stopped"]
        restart.history = [tuple(entry) for entry in state["history"]]
        restart.genes = None if state["genes"] is None else np.array(state["genes"])
        if state["distribution"]:
            restart._begin(restart.low, 1.0)
            for name, value in state["distribution"].items():
                setattr(restart.distribution, name, np.array(value) if name in _ARRAYS else value)
        return restart


def search(task, section, start=None, workers=1, path=None, limit=None):
    """The restarts of a search, and why it ended: "agreed", "restarts" or "time".

    section: the configuration's `twin`; start: a Twin about which the first restart begins, or None; path: file of the
    state, from which an interrupted search goes on; limit: generations after which this call ends, as an interruption
    does. The same seed gives the same restarts on any number of workers.
    """
    key = _key(task, section, start)
    restarts, hours = _read(task, section, path, key)
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
            if path and (ended or current.stopped or count % _SAVED_EVERY == 0):
                states = [restart.state() for restart in restarts]
                json_files.write({"key": key, "hours": hours, "restarts": states}, path)
            if current.stopped or count % _SAVED_EVERY == 0:
                at = current.evaluations, current.best, current.distribution.spread, current.stopped
                logging.info("restart %d: %d evaluations, %.3f nat, spread %.2g %s", current.number, *at)
    return restarts, ended


def best(restarts):
    """The restart with the least objective."""
    return min(restarts, key=lambda restart: restart.best)


def tables(restarts, ended):
    """Frames of `twin_restarts` and of `twin_progress`: the generations in which a restart improved, and its last."""
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


def _read(task, section, path, key):
    """Restarts and hours so far of a state's file; none where there is no file, or one of another search."""
    if path is None or not Path(path).is_file():
        return [], 0.0
    state = json_files.read(path)
    if state["key"] != key:
        logging.warning("%s is the state of another search: not continued", path)
        return [], 0.0
    return [Restart.resumed(task, section, one) for one in state["restarts"]], state["hours"]


@contextmanager
def _rating(task, workers):
    """A function from values (n, p) to objectives (n,), on some processes."""
    if workers == 1:
        yield lambda values: np.array([cost(one, task) for one in values])
        return
    with multiprocessing.get_context("spawn").Pool(workers, _set_task, (task,)) as pool:
        yield lambda values: np.array(pool.map(_cost, values, chunksize=1))


def _set_task(task):
    """The task of this process."""
    global _task
    _task = task


def _cost(values):
    """Objective of values (p,) under this process's task."""
    return cost(values, _task)
