"""Credible intervals of posteriors that are not normal: at bounds, and under priors of two widths."""

from dataclasses import dataclass

import numpy as np

from rrru.arrays import FloatArray

# half width of a normal distribution's interval of 95 % over its standard deviation
QUANTILE_95 = 1.959964
# nodes reach so many standard deviations to both sides of every component, in so many steps
_REACH, _STEPS = 6.0, 1000
# distances from a bound over the standard deviation, for densities that fall steeply from there
_FROM_BOUND = np.logspace(-6.0, 1.0, 2000)

# so many standard deviations from the mean a density over the largest one rounds to zero: exp(-800)
_NO_DENSITY = 40.0


@dataclass(frozen=True)
class NormalMixture:
    """Marginal posterior of one parameter: shares (c,), means (c,) and standard deviations (c,) of its components."""

    share: FloatArray
    mean: FloatArray
    sd: FloatArray

    def interval(self, low: float = -np.inf, high: float = np.inf, mass: float = 0.95) -> tuple[float, float]:
        """Ends of the shortest interval with a share of the distribution's mass between two bounds.

        For several separate stretches of high density: from the first to the last. Source: Box and Tiao, Bayesian
        Inference in Statistical Analysis, 1973, section 2.8 (highest posterior density).
        """
        at = self._nodes(low, high)
        if len(at) < 2:
            return float(at[0]), float(at[-1])
        score = -0.5 * ((at[:, None] - self.mean) / self.sd) ** 2 - np.log(self.sd) + np.log(self.share)
        density = np.exp(score - score.max()).sum(axis=1)
        weight = 0.5 * (density[1:] + density[:-1]) * np.diff(at)
        order = np.argsort(-0.5 * (density[1:] + density[:-1]), kind="stable")
        held = np.cumsum(weight[order])
        chosen = order[: 1 + int(np.searchsorted(held, mass * held[-1]))]
        return float(at[chosen.min()]), float(at[chosen.max() + 1])

    def _nodes(self, low: float, high: float) -> FloatArray:
        """Values (n,) in ascending order between two bounds, dense where the density changes."""
        steps = np.linspace(-_REACH, _REACH, 2 * _STEPS + 1)
        nodes = [(self.mean[:, None] + self.sd[:, None] * steps).ravel()]
        inside = bool(((low <= self.mean) & (self.mean <= high)).all())
        for bound, side in ((low, 1.0), (high, -1.0)):
            if np.isfinite(bound):
                farthest = self.sd.max() * _FROM_BOUND[-1]
                # no density between the two
                empty = inside and bool((np.abs(self.mean - bound) - farthest > _NO_DENSITY * self.sd).all())
                away = np.array([farthest]) if empty else np.outer(self.sd, _FROM_BOUND).ravel()
                nodes.append(bound + side * np.append(0.0, away))
        return np.unique(np.clip(np.concatenate(nodes), low, high))
