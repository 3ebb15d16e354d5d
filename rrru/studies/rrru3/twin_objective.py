"""How well draws of a candidate agree with what paper A prints.

A printed campaign is one draw. The objective is minus the log probability that a draw prints the paper's digits and
shows its orders, each on its own (a synthetic likelihood: Wood, Nature 466, 2010, without correlations). Of a number
that is printed to +- h and has mean m and standard deviation s over the draws it is

    -log(2 h f((p - m) / sigma) / sigma),   sigma^2 = s^2 + h^2 / 3,

f the density of Student's t with 4 degrees of freedom. Its tails are heavy, so that numbers out of reach do not
dominate. Of an upper limit and of an order it is -log F of the margin's mean over its standard deviation. The unit is
nat; it is positive, and 0 would be certainty.

It is a constant and half a sum of squares, which is what a descent needs: with t = (p - m) / sigma of

    sign(t) sqrt(5 log(1 + t^2 / 4)),   sqrt(2 log(sigma sqrt(3) / h)),   sqrt(-2 log F).
"""

import numpy as np

from rrru.studies.rrru3 import study_numbers as numbers
from rrru.studies.rrru3.paper import ERRORS_MM, TOLERANCE, printed_half_mm

# the least standard deviation over draws: numbers that do not vary at all have a finite probability
_LEAST_SCATTER = 1e-6
_PRINTED = np.array(list(ERRORS_MM.values()))
# half of the last printed digit, as a share of the number
_HALF = np.array([printed_half_mm(item) for item in ERRORS_MM]) / np.abs(_PRINTED)
_LIMITS = np.isin(list(ERRORS_MM), numbers.UPPER_LIMITS)
# contribution of a number that is met without scatter, -log(2 h f(0) sqrt(3) / h), where f(0) is 3/8
_LEAST = -np.log(0.75 * np.sqrt(3.0))


def misfit(found, orders, weights=None):
    """Objective in nat of a candidate; found, orders: numbers in mm and margins (d,) by name over its draws.

    weights: factors of single contributions by name, 1 for the others.
    """
    squares = residuals(found, orders, weights)
    return float(0.5 * squares @ squares + least(weights))


def surprises(found, orders):
    """Contribution in nat of every printed number and of every order to `misfit`, by name."""
    off, wide, failing = _roots(found, orders, 0.0)
    values = 0.5 * (off**2 + wide**2) + np.where(_LIMITS, 0.0, _LEAST)
    return dict(zip(ERRORS_MM, values, strict=True)) | dict(zip(_names(orders), 0.5 * failing**2, strict=True))


def residuals(found, orders, weights=None, tolerance=0.0):
    """Residuals (m,) of a candidate: half the sum of their squares is `misfit` above its `least` value.

    tolerance: added to the scatter of every number, as a share of the printed number, and of every margin.
    """
    off, wide, failing = _roots(found, orders, tolerance)
    factors = np.sqrt([(weights or {}).get(name, 1.0) for name in (*ERRORS_MM, *ERRORS_MM, *_names(orders))])
    return factors * np.concatenate([off, wide, failing])


def least(weights=None):
    """The misfit in nat where every number is met without scatter and every order holds for certain."""
    return sum(_LEAST * (weights or {}).get(item, 1.0) for item in ERRORS_MM if item not in numbers.UPPER_LIMITS)


def _names(orders):
    """Names of the contributions of orders."""
    return [f"order_{name}" for name in orders]


def _roots(found, orders, tolerance):
    """Residuals of deviations (17,) and widths (17,) of the numbers, and of orders; see above."""
    mean, scatter = _moments(np.array([found[item] for item in ERRORS_MM]) / _PRINTED[:, None])
    spread = np.hypot(np.hypot(scatter, _HALF / np.sqrt(3.0)), tolerance)
    lack = (1.0 - mean) / spread
    off = np.sign(lack) * np.sqrt(5.0 * np.log1p(0.25 * lack**2))
    off[_LIMITS] = [np.sqrt(-2.0 * _log_t_cdf(value)) for value in lack[_LIMITS]]
    # rounding: no scatter at all
    wide = np.where(_LIMITS, 0.0, np.sqrt(np.maximum(2.0 * np.log(spread * np.sqrt(3.0) / _HALF), 0.0)))
    if not orders:
        return off, wide, np.empty(0)
    mean, scatter = _moments(np.array(list(orders.values())))
    margins = mean / np.hypot(scatter, tolerance)
    return off, wide, np.sqrt([-2.0 * _log_t_cdf(value) for value in margins])


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


def _log_t_cdf(t):
    """Log of its distribution function (1 + s)^2 (2 - s) / 4, where s = t / r and r^2 = 4 + t^2."""
    r = np.sqrt(4.0 + t * t)
    # without cancellation in the lower tail
    above = 4.0 / (r * (r - t)) if t < 0.0 else 1.0 + t / r
    return float(np.log(0.25 * above**2 * (2.0 - t / r)))
