"""Covariance matrix adaptation evolution strategy (CMA-ES), an alternative to the paper's genetic algorithm.

The objective's valleys are narrow and not along the axes, and the covariance adapts to their shape. Source: Hansen, The
CMA Evolution Strategy: A Tutorial, arXiv:1604.00772 (2016), whose symbols the comments name: weighted recombination of
the better half with its default constants, cumulated step-size control, rank-one and rank-mu updates, without its
negative weights of the worse half. Genes are in 0..1.
"""

import numpy as np

from rrru.arrays import FloatArray
from rrru.genetic import operators
from rrru.genetic.plan import Bounds
from rrru.genetic.result import GeneticResult, means
from rrru.genetic.settings import GeneticSettings, Objective

# mean and standard deviation of the first genes: the middle of the bounds, at the nominal robot; 0.3 as in the tutorial
_FIRST_MEAN, _FIRST_SIGMA = 0.5, 0.3
# smallest standard deviation of a gene, at which a search ends
_MIN_SIGMA = 1e-12


def run(rate: Objective, bounds: Bounds, settings: GeneticSettings, seed: int) -> GeneticResult:
    """GeneticResult of a checked objective within Bounds; see `algorithm.minimise`.

    Of GeneticSettings it uses the population, all islands together, and the stop criteria. Genes drawn outside of the
    bounds are moved onto them. A search ends as stalled, too, where no gene varies any more.
    """
    generator, search = np.random.default_rng(seed), Distribution(bounds.low.size, sum(settings.populations))
    stall = settings.stall_generations, settings.stall_tolerance
    best: list[float] = []
    found: list[FloatArray] = []
    mean: list[FloatArray] = []
    stopped = "generations"
    for generation in range(settings.generations + 1):
        genes = np.clip(search.draw(generator), 0.0, 1.0)
        score = rate(operators.decoded(genes, bounds))
        first = score.argmin()
        better = not best or score[first] < best[-1]
        best.append(score[first] if better else best[-1])
        found.append(genes[first] if better else found[-1])
        mean.append(score)
        if generation == settings.generations:
            break
        search.learn(genes[np.argsort(score, kind="stable")])
        if operators.has_stalled(np.array(best[-stall[0] - 1 :]), *stall) or search.largest_sd < _MIN_SIGMA:
            stopped = "stalled"
            break
    return GeneticResult(
        stopped=stopped,
        found=operators.decoded(np.array(found), bounds),
        best_history=np.array(best),
        mean_history=means(np.array(mean)),
        asked=search.count * np.arange(1, len(best) + 1),
    )


class Distribution:
    """The normal distribution N(mean, sigma^2 covariance) of p genes that the next population is drawn from.

    genes: p; count: draws of a generation. It begins with independent genes. covariance (p, p) has the eigenvectors
    axes (p, p), in columns, and the square roots of its eigenvalues lengths (p,).
    """

    def __init__(self, genes: int, count: int) -> None:
        self.count, self.mean, self.sigma = count, np.full(genes, _FIRST_MEAN), _FIRST_SIGMA
        self.generation = 0
        share = np.log((count + 1) / 2) - np.log(np.arange(1, count // 2 + 1))
        self.weights = share / share.sum()
        # mu_eff, effective number of parents
        mu_eff = self.mu_eff = 1.0 / (self.weights**2).sum()
        # c_c and c_sigma, learning rates of the evolution paths
        self.c_path = (4 + mu_eff / genes) / (genes + 4 + 2 * mu_eff / genes)
        self.c_sigma = (mu_eff + 2) / (genes + mu_eff + 5)
        # c_1 and c_mu, learning rates of the rank-one and of the rank-mu update
        self.c_one = 2 / ((genes + 1.3) ** 2 + mu_eff)
        self.c_mu = min(1 - self.c_one, 2 * (mu_eff - 2 + 1 / mu_eff) / ((genes + 2) ** 2 + mu_eff))
        # d_sigma
        self.damping = 1 + 2 * max(0.0, np.sqrt((mu_eff - 1) / (genes + 1)) - 1) + self.c_sigma
        # E |N(0, I)|
        self.expected_norm = np.sqrt(genes) * (1 - 1 / (4 * genes) + 1 / (21 * genes**2))
        # p_c and p_sigma, the evolution paths (p,)
        self.path, self.sigma_path = np.zeros(genes), np.zeros(genes)
        self.covariance, self.axes, self.lengths = np.eye(genes), np.eye(genes), np.ones(genes)

    @property
    def largest_sd(self) -> float:
        """Largest standard deviation along an axis."""
        return float(self.sigma * self.lengths.max())

    def draw(self, generator: np.random.Generator) -> FloatArray:
        """Genes (n, p), also outside of the bounds."""
        normal = generator.standard_normal((self.count, len(self.mean)))
        return self.mean + self.sigma * (normal * self.lengths) @ self.axes.T

    def learn(self, ranked: FloatArray) -> None:
        """Update the distribution from genes (n, p), the best first."""
        steps = (ranked[: len(self.weights)] - self.mean) / self.sigma
        mean_step = self.weights @ steps
        self.generation += 1
        self.mean = self.mean + self.sigma * mean_step
        sigma_decay, white_step = 1 - self.c_sigma, self.axes @ ((self.axes.T @ mean_step) / self.lengths)
        self.sigma_path = sigma_decay * self.sigma_path + np.sqrt((1 - sigma_decay**2) * self.mu_eff) * white_step
        norm = np.sqrt(self.sigma_path @ self.sigma_path)
        # h_sigma: while the step size grows fast, the path does not stretch the covariance
        longest = (1.4 + 2 / (len(mean_step) + 1)) * self.expected_norm
        steady = norm / np.sqrt(1 - sigma_decay ** (2 * self.generation)) < longest
        path_decay = 1 - self.c_path
        self.path = path_decay * self.path + steady * np.sqrt((1 - path_decay**2) * self.mu_eff) * mean_step
        # makes up for the variance that the path lacks then
        lost = (1 - steady) * self.c_one * (1 - path_decay**2)
        self.covariance = (1 - self.c_one - self.c_mu + lost) * self.covariance
        self.covariance += self.c_one * np.outer(self.path, self.path)
        self.covariance += self.c_mu * (steps.T * self.weights) @ steps
        variances, self.axes = np.linalg.eigh((self.covariance + self.covariance.T) / 2)
        self.lengths = np.sqrt(np.maximum(variances, _MIN_SIGMA**2))
        self.sigma *= np.exp(self.c_sigma / self.damping * (norm / self.expected_norm - 1))
