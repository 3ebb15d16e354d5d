"""How well draws of a candidate agree with what paper A prints.

A printed campaign is one draw. The objective is minus the log probability that a draw prints the paper's digits and
shows its orders, each on its own (a synthetic likelihood: Wood, Nature 466, 2010, without correlations). Of a number
that is printed to +- h and has mean m and standard deviation s over the draws it is

    -log(2 h f((p - m) / sigma) / sigma),   sigma^2 = s^2 + h^2 / 3,

f the density of Student's t with 4 degrees of freedom. Its tails are heavy, so that numbers out of reach do not
dominate. Of an upper limit and of an order it is -log F of the margin's mean over its standard deviation. The unit is
nat; it is positive, and 0 would be certainty.
"""

import numpy as np

from rrru.studies.rrru3 import study_numbers as numbers
from rrru.studies.rrru3.paper import ERRORS_MM, TOLERANCE, printed_half_mm

# the least standard deviation over draws: numbers that do not vary at all have a finite probability
_LEAST_SCATTER = 1e-6


def misfit(found, orders, weights=None):
    """Objective in nat of a candidate; found, orders: numbers in mm and margins (d,) by name over its draws.

    weights: factors of single contributions by name, 1 for the others.
    """
    parts = surprises(found, orders)
    return float(sum((weights or {}).get(name, 1.0) * part for name, part in parts.items()))


def surprises(found, orders):
    """Contribution in nat of every printed number and of every order to `misfit`, by name."""
    printed = np.array(list(ERRORS_MM.values()))
    ratios = np.array([found[item] for item in ERRORS_MM]) / printed[:, None]
    half = np.array([printed_half_mm(item) for item in ERRORS_MM]) / np.abs(printed)
    mean, spread = _moments(ratios)
    spread = np.hypot(spread, half / np.sqrt(3.0))
    lack = (1.0 - mean) / spread
    result = dict(zip(ERRORS_MM, -(_log_t_density(lack) + np.log(2.0 * half / spread)), strict=True))
    for k, item in enumerate(ERRORS_MM):
        if item in numbers.UPPER_LIMITS:
            result[item] = -_log_t_cdf(lack[k])
    if not orders:
        return result
    mean, spread = _moments(np.array(list(orders.values())))
    return result | {f"order_{name}": -_log_t_cdf(t) for name, t in zip(orders, mean / spread, strict=True)}


def _moments(values):
    """Means and standard deviations of draws (n, d)."""
    return values.mean(axis=1), np.maximum(values.std(axis=1, ddof=1), _LEAST_SCATTER)


def draw_misfit(found, orders):
    """How far a single draw is from the printed numbers and orders, by numbers in mm and margins by name.

    The sum of log(1 + (deviation / 15 %)^2) over the numbers, of an upper limit only above it, and log 2 for every
    order that does not hold: as much as for a number that is off by 15 %.
    """
    total = 0.0
    for item, printed in ERRORS_MM.items():
        deviation = found[item] / printed - 1.0
        off = max(deviation, 0.0) if item in numbers.UPPER_LIMITS else deviation
        total += np.log1p((off / TOLERANCE) ** 2)
    return float(total + np.log(2.0) * sum(margin <= 0.0 for margin in orders.values()))


def _log_t_density(t):
    """Log density of Student's t with 4 degrees of freedom."""
    return np.log(0.375) - 2.5 * np.log1p(0.25 * t * t)


def _log_t_cdf(t):
    """Log of its distribution function (1 + s)^2 (2 - s) / 4, where s = t / r and r^2 = 4 + t^2."""
    r = np.sqrt(4.0 + t * t)
    # without cancellation in the lower tail
    above = 4.0 / (r * (r - t)) if t < 0.0 else 1.0 + t / r
    return float(np.log(0.25 * above**2 * (2.0 - t / r)))
