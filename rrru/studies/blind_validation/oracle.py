"""Upper limit of what a campaign's data can show about the cause of its gap, with the true effect model known.

Detection is a likelihood-ratio test: the calibration alone against the calibration with the columns of the true
causes. Shapes, legs and noise are known, sizes are free. Confounding is measured by the chi-square that the best wrong
explanation leaves of the noise-free gap.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from rrru.diagnosis.state import State

_FALSE_ALARMS = 0.01
_TRUE = "true:"
_MAX_RIVALS = 3


@dataclass(frozen=True)
class Limits:
    """Columns of `withheld_limits`; the defaults hold where nothing acts that the data could show."""

    oracle_chi2: float = 0.0
    oracle_freedom: int = 0
    oracle_detects: bool = False
    rival: str = ""
    rival_chi2: float = np.nan
    confounded_share: float = np.nan


def of_displacement(gain):
    """Limits of data whose chi-square drops by a gain when the true displacement is fitted, its size free."""
    from scipy.stats import chi2

    return Limits(gain, 1, bool(gain > chi2.ppf(1.0 - _FALSE_ALARMS, 1)))


def with_truth(library, acting):
    """A library by name together with the acting causes in their true shapes."""
    return library | {f"{_TRUE}{one.effect}": one.effect_model for one in acting}


def limits(case, deviations, acting, names):
    """Limits of a campaign from its case, calibrated deviations (p,), acting causes, and names of possible rivals.

    The case's library holds the acting causes too, see `with_truth`.
    """
    from scipy.stats import chi2

    causes = {(f"{_TRUE}{cause.effect}", 0): cause for cause in acting}
    if not causes or any(name not in case.library for name, _ in causes):
        return Limits()
    known = [name for name in names if name in case.library]
    rivals = [(name, shape) for name in known for shape in range(len(case.library[name].coordinates.shapes))]
    reduced = _Reduced(case, deviations, [*causes, *rivals])
    true = np.concatenate([reduced.columns[key][:, _free(cause)] for key, cause in causes.items()], axis=1)
    gain = float((reduced.data**2).sum() - _left(true, reduced.data))
    freedom = int(np.linalg.matrix_rank(true))
    signal = sum(reduced.columns[key] @ np.array(cause.coordinates) for key, cause in causes.items())
    truth = frozenset(one.effect for one in acting)
    # several effects at once may be confounded with what the library does not hold
    most = len(causes) if truth <= set(names) else _MAX_RIVALS
    rival, left = reduced.rival(signal, truth, rivals, most)
    share = 1.0 - float(np.sqrt(left / (signal**2).sum()))
    return Limits(gain, freedom, bool(gain > chi2.ppf(1.0 - _FALSE_ALARMS, freedom)), rival, left, share)


def _free(cause):
    """Which coordinates (c,) of a cause are free: those of its leg, or all where its leg is 0."""
    legs = cause.effect_model.coordinates.legs
    return legs == cause.leg if cause.leg else np.ones(len(legs), dtype=bool)


def _left(columns, target):
    """Sum of squares that columns (n, k) leave of a target (n,)."""
    fitted, *_ = np.linalg.lstsq(columns, target, rcond=1e-10)
    return float(((target - columns @ fitted) ** 2).sum())


class _Reduced:
    """Data and columns in units of the noise, calibration projected out, reduced to few rows by QR."""

    def __init__(self, case, deviations, keys):
        self._library = case.library
        linear = case.linearise(State(deviations, {}), list(keys))
        rows = linear.data.size
        base, _ = np.linalg.qr(linear.base.reshape(rows, -1))
        columns = [linear.columns[key].reshape(rows, -1) for key in keys]
        together = np.concatenate([*columns, linear.data.reshape(rows, 1)], axis=1) / case.noise_mm
        triangle = np.linalg.qr(together - base @ (base.T @ together), mode="r")
        ends = np.cumsum([column.shape[1] for column in columns])
        self.columns = dict(zip(keys, np.split(triangle[:, :-1], ends[:-1], axis=1), strict=True))
        self.data = triangle[:, -1]

    def rival(self, signal, truth, rivals, most):
        """Name and chi-square of the wrong set, of up to `most` effects, with the least residual of a signal (k,)."""
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
        """Sum of squares that a set leaves of a signal, with bounds at zero for positive coordinates."""
        columns = np.concatenate([self.columns[key] for key in keys], axis=1)
        positive = np.concatenate([self._library[name].coordinates.positive for name, _ in keys])
        left = _left(columns, signal)
        if not positive.any():
            return left
        from scipy.optimize import lsq_linear

        scale = np.linalg.norm(columns, axis=0)
        scale = np.where(scale > 0.0, scale, 1.0)
        low = np.where(positive, 0.0, -np.inf)
        return 2.0 * float(lsq_linear(columns / scale, signal, bounds=(low, np.inf), method="bvls").cost)
