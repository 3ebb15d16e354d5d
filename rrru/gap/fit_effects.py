"""The calibration with effects that are named beforehand, without a search: one model after the other on given rows.

Gauss-Newton on the exact sim as in `rrru.gap.refine`, all numbers at once. Of each effect's coordinates a weak prior,
some times their typical size, keeps what the points do not tell near zero; signs and bounds of the law are not imposed,
so that a size that comes out against the law shows.
"""

from dataclasses import dataclass

import numpy as np

from rrru.errors import FitError
from rrru.gap.calibrate import calibrate
from rrru.gap.state import State

_STEPS, _STILL = 12, 1e-6
# shares of the largest singular value below which a combination of numbers is not seen
_SEEN = 1e-9
# rows that are taken at a time where their number is large
_AT_ONCE = 4000
# ASSUME an effect's numbers are rarely more than this many times their typical size
_TIMES_TYPICAL = 20.0


@dataclass(frozen=True)
class EffectFit:
    """state: the corrected sim; errors: standard errors (c,) by effect, under the case's noise and the prior; numbers:
    how many were fitted; identifiable: how many of them the points tell without the prior.
    """

    state: State
    errors: dict
    numbers: int
    identifiable: int


def fit_effects(case, names, times_typical=_TIMES_TYPICAL, calibrated=None):
    """EffectFit of a Case's used points with the effects of these names, each in its first shape.

    times_typical: of the prior's standard deviation over the typical size; calibrated: State to start from, by default
    that of the calibration. Raises FitError where the sim loses a pose or the steps do not end.
    """
    calibrated = calibrated or calibrate(case)
    keys = [(name, 0) for name in names]
    sizes = [case.library[name].coordinates.typical for name in names]
    state = State(calibrated.deviations, {key: np.zeros(len(size)) for key, size in zip(keys, sizes, strict=True)})
    count, ends = len(state.deviations), np.cumsum([len(state.deviations), *map(len, sizes)])
    prior = np.concatenate([np.full(count, np.inf), *(times_typical * size for size in sizes)])
    last = np.inf
    for _ in range(_STEPS):
        linear = case.linearise(state, keys)
        columns = np.concatenate([linear.base, *(linear.columns[key] for key in keys)], axis=-1)
        columns = columns.reshape(-1, len(prior)) / case.noise_mm
        matrix = np.concatenate([columns, np.diag(1.0 / prior)[count:]])
        aim = np.concatenate([linear.data.ravel() / case.noise_mm, np.zeros(len(prior) - count)])
        unit = 1.0 / np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        step = unit * np.linalg.lstsq(matrix * unit, aim, rcond=_SEEN)[0]
        effects = {key: step[first:end] for key, first, end in zip(keys, ends, ends[1:], strict=False)}
        state = State(state.deviations + step[:count], effects)
        cost = float((case.residual(state) ** 2).sum())
        if abs(last - cost) < _STILL * cost:
            break
        last = cost
    else:
        raise FitError(f"the fit of {', '.join(names) or 'the calibration'} does not end: {cost:.6g} mm^2 left")
    spread = unit * np.sqrt(np.diag(np.linalg.pinv((matrix * unit).T @ (matrix * unit), rcond=_SEEN**2)))
    errors = {name: spread[first:end] for name, first, end in zip(names, ends, ends[1:], strict=False)}
    return EffectFit(state, errors, len(prior), identified(columns))


def identified(columns):
    """How many combinations of numbers the columns (m, k) that these make tell, each number by how far it moves."""
    size = np.maximum(np.sqrt(np.einsum("ij,ij->j", columns, columns)), 1e-300)
    triangle = np.zeros((0, len(size)))
    for some in np.array_split(columns, len(columns) // _AT_ONCE + 1):
        triangle = np.linalg.qr(np.concatenate([triangle, some / size]), mode="r")
    return int(np.linalg.matrix_rank(triangle, rtol=_SEEN))
