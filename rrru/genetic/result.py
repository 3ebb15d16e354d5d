"""Result of a run of the genetic algorithm, and of the same run stopped earlier."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray, IntArray
from rrru.genetic.operators import has_stalled


@dataclass(frozen=True)
class GeneticResult:
    """Result of one run, g generations after its initial population (entry 0 of every history).

    stopped: "generations" or "stalled"; found: (g + 1, p) the best individual; best_history, mean_history: (g + 1,)
    best, and mean over the feasible individuals, of the objective after each generation, before migration; inf where
    no individual is feasible; asked: (g + 1,) individuals whose objective was needed so far (elites and migrants keep
    theirs).
    """

    stopped: str
    found: FloatArray
    best_history: FloatArray
    mean_history: FloatArray
    asked: IntArray

    @property
    def deviations(self) -> FloatArray:
        """The best individual (p,)."""
        return np.asarray(self.found[-1])

    @property
    def objective(self) -> float:
        """Its objective, inf if none was feasible."""
        return float(self.best_history[-1])

    @property
    def generations(self) -> int:
        """Generations done."""
        return len(self.best_history) - 1

    @property
    def evaluations(self) -> int:
        """Individuals whose objective was needed."""
        return int(self.asked[-1])

    def row(self) -> dict[str, Any]:
        """Objective, counts and reason to stop, by the tables' names."""
        counts = {"generations": self.generations, "evaluations": self.evaluations, "stopped": self.stopped}
        return {"objective_mm": self.objective} | counts

    def history(self) -> pd.DataFrame:
        """Frame of the convergence: every generation up to 100, every 10th after it, and the last."""
        every = np.arange(self.generations + 1)
        listed = every[(every <= 100) | (every % 10 == 0) | (every == self.generations)]
        return pd.DataFrame(
            {"generation": listed, "best_mm": self.best_history[listed], "mean_mm": self.mean_history[listed]}
        )

    def stalled(self, generations: int, tolerance: float) -> Self:
        """The same run stopped where it stalls first, see `operators.has_stalled`; itself where it does not."""
        for end in range(1, len(self.best_history) + 1):
            if has_stalled(self.best_history[:end], generations, tolerance):
                names = ("found", "best_history", "mean_history", "asked")
                return replace(self, stopped="stalled", **{name: getattr(self, name)[:end] for name in names})
        return self


def means(scores: FloatArray) -> FloatArray:
    """Mean over the feasible individuals of each row (k,) of scores (k, n), inf where none is feasible."""
    feasible = np.isfinite(scores)
    if feasible.all():
        return np.asarray(scores.mean(axis=1))
    rows = zip(scores, feasible, strict=True)
    return np.array([row[finite].mean() if finite.any() else np.inf for row, finite in rows])
