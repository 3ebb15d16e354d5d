"""Evolution of a normal distribution (CMA-ES), an alternative to the paper's genetic algorithm.

The objective's valleys are narrow and not along the axes, and the covariance adapts to their shape. Hansen, The CMA
Evolution Strategy: A Tutorial, arXiv:1604.00772 (2016): weighted recombination of the better half, cumulated step-size
control, rank-one and rank-mu updates, all numbers as there. Genes are in 0..1.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.genetic import operators
from rrru.genetic.plan import Box
from rrru.genetic.result import GeneticResult, means
from rrru.genetic.settings import GeneticSettings, Objective

# the distribution begins in the middle of the bounds, at the nominal robot, and ends where no gene spreads any more
_MIDDLE, _SPREAD, _LEAST_SPREAD = 0.5, 0.3, 1e-12


def run(rate: Objective, box: Box, settings: GeneticSettings, seed: int) -> GeneticResult:
    """GeneticResult of a checked objective within a Box; see `algorithm.minimise`.

    Of GeneticSettings it uses the population, all islands together, and the stop criteria. Genes drawn outside of the
    bounds are moved onto them. A distribution without any spread counts as stalled, too.
    """
    generator, search = np.random.default_rng(seed), Distribution(box.low.size, sum(settings.populations))
    stall = settings.stall_generations, settings.stall_tolerance
    best: list[float] = []
    found: list[FloatArray] = []
    mean: list[FloatArray] = []
    stopped = "generations"
    for generation in range(settings.generations + 1):
        genes = np.clip(search.draw(generator), 0.0, 1.0)
        score = rate(operators.decoded(genes, box))
        first = score.argmin()
        better = not best or score[first] < best[-1]
        best.append(score[first] if better else best[-1])
        found.append(genes[first] if better else found[-1])
        mean.append(score)
        if generation == settings.generations:
            break
        search.learn(genes[np.argsort(score, kind="stable")])
        if operators.has_stalled(np.array(best[-stall[0] - 1 :]), *stall) or search.spread < _LEAST_SPREAD:
            stopped = "stalled"
            break
    return GeneticResult(
        stopped=stopped,
        found=operators.decoded(np.array(found), box),
        best_history=np.array(best),
        mean_history=means(np.array(mean)),
        asked=search.count * np.arange(1, len(best) + 1),
    )


class Distribution:
    """Mean (p,), step size and covariance (p, p) of the next draws, and the evolution paths (p,).

    It begins with independent genes of one spread about a mean, by default in the middle of the bounds.
    """

    def __init__(self, genes: int, count: int, mean: float | FloatArray = _MIDDLE, spread: float = _SPREAD) -> None:
        self.count, self.mean, self.size, self.learned = count, np.zeros(genes) + mean, spread, 0
        share = np.log((count + 1) / 2) - np.log(np.arange(1, count // 2 + 1))
        self.weights = share / share.sum()
        mass = self.mass = 1.0 / (self.weights**2).sum()
        self.along_path = (4 + mass / genes) / (genes + 4 + 2 * mass / genes)
        self.along_steps = (mass + 2) / (genes + mass + 5)
        self.of_path = 2 / ((genes + 1.3) ** 2 + mass)
        self.of_steps = min(1 - self.of_path, 2 * (mass - 2 + 1 / mass) / ((genes + 2) ** 2 + mass))
        self.damping = 1 + 2 * max(0.0, np.sqrt((mass - 1) / (genes + 1)) - 1) + self.along_steps
        self.usual = np.sqrt(genes) * (1 - 1 / (4 * genes) + 1 / (21 * genes**2))
        self.path, self.steps = np.zeros(genes), np.zeros(genes)
        self.covariance, self.axes, self.lengths = np.eye(genes), np.eye(genes), np.ones(genes)

    @property
    def spread(self) -> float:
        """Largest standard deviation of a gene."""
        return float(self.size * self.lengths.max())

    def draw(self, generator: np.random.Generator) -> FloatArray:
        """Genes (n, p), also outside of the bounds."""
        normal = generator.standard_normal((self.count, len(self.mean)))
        return self.mean + self.size * (normal * self.lengths) @ self.axes.T

    def learn(self, ranked: FloatArray) -> None:
        """Update the distribution from genes (n, p), the best first."""
        apart = (ranked[: len(self.weights)] - self.mean) / self.size
        step = self.weights @ apart
        self.learned += 1
        self.mean = self.mean + self.size * step
        decay, turn = 1 - self.along_steps, self.axes @ ((self.axes.T @ step) / self.lengths)
        self.steps = decay * self.steps + np.sqrt((1 - decay**2) * self.mass) * turn
        length = np.sqrt(self.steps @ self.steps)
        # a path that has just become long by the step size alone does not stretch the covariance
        steady = length / np.sqrt(1 - decay ** (2 * self.learned)) < (1.4 + 2 / (len(step) + 1)) * self.usual
        path_decay = 1 - self.along_path
        self.path = path_decay * self.path + steady * np.sqrt((1 - path_decay**2) * self.mass) * step
        lost = (1 - steady) * self.of_path * (1 - path_decay**2)
        self.covariance = (1 - self.of_path - self.of_steps + lost) * self.covariance
        self.covariance += self.of_path * np.outer(self.path, self.path)
        self.covariance += self.of_steps * (apart.T * self.weights) @ apart
        squares, self.axes = np.linalg.eigh((self.covariance + self.covariance.T) / 2)
        self.lengths = np.sqrt(np.maximum(squares, _LEAST_SPREAD**2))
        self.size *= np.exp(self.along_steps / self.damping * (length / self.usual - 1))
