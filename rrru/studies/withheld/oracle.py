"""What a campaign's data themselves can tell about the cause of its gap, to somebody who knows the true law: the
scorer's yardstick.

Detection is a likelihood-ratio test: the calibration alone against the calibration with the true causes' columns,
shapes and legs known, sizes free, noise known. Telling apart is measured by the chi-square that the best wrong
explanation leaves of the noise-free gap.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from rrru.gap.case import State

_FALSE_ALARMS = 0.01
_TRUE = "true:"
_MOST = 3


@dataclass(frozen=True)
class Limits:
    """detects: whether the test sees the true causes; gain: its chi-square, of so many degrees of freedom; rival: the
    best wrong explanation.

    rival_chi2: what the rival leaves of the noise-free gap; where that is a few units only, nobody can tell it from the
    truth. imitated_share: share of the noise-free gap rms that the rival imitates.
    """

    detects: bool
    gain: float
    freedom: int
    rival: str
    rival_chi2: float
    imitated_share: float


def with_truth(library, acting):
    """A library by name with the acting causes in their true shapes besides."""
    return library | {f"{_TRUE}{one.effect}": one.law for one in acting}


def limits(case, deviations, acting, names):
    """Limits of a campaign of a robot from its case, calibrated deviations (p,), what acts, and the names of the effects
    that may be rivals.

    The case's library holds the acting causes too, see `with_truth`.
    """
    own = {f"{_TRUE}{one.effect}": one for one in acting}
    if not own or any(name not in case.library for name in own):
        return Limits(False, 0.0, 0, "", np.nan, np.nan)
    rivals = [
        (name, shape)
        for name in names
        if name in case.library
        for shape in range(len(case.library[name].coordinates.shapes))
    ]
    reduced = _Reduced(case, deviations, [*((name, 0) for name in own), *rivals])
    free = [reduced.columns[name, 0][:, _free(one.law.coordinates, one.leg)] for name, one in own.items()]
    true = np.concatenate(free, axis=1)
    gain = float((reduced.data**2).sum() - _left(true, reduced.data))
    freedom = int(np.linalg.matrix_rank(true))
    signal = sum(reduced.columns[name, 0] @ np.array(one.coordinates) for name, one in own.items())
    truth = frozenset(one.effect for one in acting)
    # what the library does not hold may be imitated by several effects at once
    most = len(own) if truth <= set(names) else _MOST
    rival, left = reduced.rival(signal, truth, rivals, most)
    share = 1.0 - float(np.sqrt(left / (signal**2).sum()))
    return Limits(bool(gain > chi2.ppf(1.0 - _FALSE_ALARMS, freedom)), gain, freedom, rival, left, share)


def _free(coordinates, leg):
    """Which coordinates (c,) a cause on one leg, or on all (0), leaves free."""
    return coordinates.legs == leg if leg else np.ones(len(coordinates), dtype=bool)


def _left(columns, target):
    """Sum of squares that columns (n, k) leave of a target (n,)."""
    fitted, *_ = np.linalg.lstsq(columns, target, rcond=1e-10)
    return float(((target - columns @ fitted) ** 2).sum())


class _Reduced:
    """Data and columns in units of the noise, the calibration projected out, turned so that few rows are left."""

    def __init__(self, case, deviations, keys):
        self._library = case.library
        linear = case.linearise(State(deviations, {}), list(keys))
        rows = linear.data.size
        base, _ = np.linalg.qr(linear.base.reshape(rows, -1))
        together = np.concatenate(
            [*(linear.columns[key].reshape(rows, -1) for key in keys), linear.data.reshape(rows, 1)], axis=1
        )
        together = together / case.noise_mm
        triangle = np.linalg.qr(together - base @ (base.T @ together), mode="r")
        ends = np.cumsum([linear.columns[key].shape[-1] for key in keys])
        self.columns = dict(zip(keys, np.split(triangle[:, :-1], ends[:-1], axis=1), strict=True))
        self.data = triangle[:, -1]

    def rival(self, signal, truth, rivals, most):
        """Name and chi-square of the wrong set, of up to `most` effects, that leaves least of a signal (k,)."""
        best = ("", np.inf)
        for size in range(1, most + 1):
            for keys in combinations(rivals, size):
                names = frozenset(name for name, _ in keys)
                if len(names) < size or names == truth:
                    continue
                left = self._left_by(keys, signal)
                if left < best[1]:
                    best = ("+".join(sorted(names)), left)
        return best

    def _left_by(self, keys, signal):
        """Sum of squares that a set leaves of a signal, positive coordinates kept so."""
        columns = np.concatenate([self.columns[key] for key in keys], axis=1)
        positive = np.concatenate([self._library[name].coordinates.positive for name, _ in keys])
        left = _left(columns, signal)
        if not positive.any():
            return left
        scale = np.linalg.norm(columns, axis=0)
        scale = np.where(scale > 0.0, scale, 1.0)
        low = np.where(positive, 0.0, -np.inf)
        return 2.0 * float(lsq_linear(columns / scale, signal, bounds=(low, np.inf), method="bvls").cost)
