"""Errors of the drives over their own values by the effects of a verdict, and where they are largest.

The error e(q) of an effect that depends on the drive's value alone is tabulated over the measured range, minus its mean
there: a constant is the drive's zero, which the calibration has. With the derivatives s(q) of e(q) by the effect's
numbers and their covariance C the 95 % band is e(q) +- 1.96 sqrt(s(q)^T C s(q)). That of a function that may jump
reaches, between two stops, the values at both, see `rrru.diagnosis.drive_spectra.jumps`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from rrru.arrays import FloatArray
from rrru.diagnosis.drive_spectra import jumps
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.model_fit import ModelFit
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.result_tables import value_steps
from rrru.diagnosis.terms import EffectTerm, spread
from rrru.effects.protocol import Motion
from rrru.estimation.intervals import QUANTILE_95

# places of a drive's range: a wave of 200 per turn still has three and more
_PLACES = 721
_COLUMNS = ("effect", "drive", "name", "unit", "drive_value", "error", "low_95", "high_95", "worst")


def drive_functions(inference: InferenceResult, names: Sequence[str]) -> pd.DataFrame:
    """Rows of `gap_drive_functions` without the campaign; names: of the drives.

    Drives that the campaign does not move, and those that an effect does not change, have none.
    """
    problem, fit = inference.problem, inference.fit
    frames = [
        _of_drive(problem, fit, term, k).assign(effect=term.effect, drive=k + 1, name=names[k], unit=unit)
        for term in fit.terms
        if term.effect in problem.effects and problem.effects[term.effect].of_drive_value
        for k, unit in enumerate(problem.mechanism.parts.units)
    ]
    frames = [frame for frame in frames if len(frame)]
    return pd.concat(frames, ignore_index=True)[[*_COLUMNS]] if frames else pd.DataFrame(columns=_COLUMNS)


def _of_drive(problem: DiagnosisProblem, fit: ModelFit, term: EffectTerm, drive: int) -> pd.DataFrame:
    """Rows of one drive under one term, none where it is not moved or not changed."""
    effect = problem.library[term.effect]
    measured = problem.motion.drive[problem.used]
    low, high = np.nanmin(measured[:, drive]), np.nanmax(measured[:, drive])
    if not high > low:
        return pd.DataFrame()
    value = np.linspace(low, high, _PLACES)
    others = np.repeat(np.nanmean(measured, axis=0)[None], _PLACES, axis=0)
    others[:, drive] = value
    motion = replace(problem.motion, drive=others)
    if effect.along_drives is not None:
        error, slopes = _linear(problem, fit, term, (effect.along_drives(motion), drive))
    else:
        error, slopes = _by_steps(problem, fit, term, (motion, drive))
    if not error.any():
        return pd.DataFrame()
    variance = np.einsum("nk,kl,nl->n", slopes, fit.effect_covariance(term)[1], slopes)
    half = QUANTILE_95 * np.sqrt(np.maximum(variance, 0.0))
    low_error, high_error = error - half, error + half
    if effect.steps and effect.along_drives is not None:
        coordinates = fit.state.effects[term.effect, term.shape][effect.coordinates.legs == drive + 1]
        known = effect.along_drives(replace(problem.motion, drive=measured))[drive] @ coordinates
        mean = (effect.along_drives(motion)[drive] @ coordinates).mean()
        before, after, share = jumps(value, measured[:, drive], known - mean)
        # the interval reaches the value beyond a jump where the function has that with a probability of 2.5 %
        far = effect.steps * np.minimum(share, 1.0 - share) > OPTIONS.interval_quantiles[0]
        low_error = np.where(far, np.minimum(low_error, np.minimum(before, after) - half), low_error)
        high_error = np.where(far, np.maximum(high_error, np.maximum(before, after) + half), high_error)
    worst = np.arange(_PLACES) == int(np.abs(error).argmax())
    columns = {"drive_value": value, "error": error, "low_95": low_error, "high_95": high_error, "worst": worst}
    return pd.DataFrame(columns)


def _linear(
    problem: DiagnosisProblem, fit: ModelFit, term: EffectTerm, at: tuple[list[FloatArray], int]
) -> tuple[FloatArray, FloatArray]:
    """Error (n,) of a drive minus its mean, and its slopes (n, k) by a term's free coefficients, in which it is linear.

    at: by drive the functions (n, c_k) at n places of the drive's range, and the drive's number.
    """
    made, drive = at
    ends = np.cumsum([0, *(functions.shape[1] for functions in made)])
    slopes = np.zeros((len(made[drive]), ends[-1]))
    of_drive = slice(ends[drive], ends[drive + 1])
    slopes[:, of_drive] = made[drive] - made[drive].mean(axis=0)
    free = slopes @ spread(problem.library[term.effect].coordinates, term.legs)
    return slopes @ fit.state.effects[term.effect, term.shape], free


def _by_steps(
    problem: DiagnosisProblem, fit: ModelFit, term: EffectTerm, at: tuple[Motion, int]
) -> tuple[FloatArray, FloatArray]:
    """Error (n,) of a drive minus its mean, and its slopes (n, k) by the numbers of the effect's covariance."""
    (motion, drive), effect, key = at, problem.library[term.effect], (term.effect, term.shape)
    part = problem.mechanism.parts.drives[drive]

    def error_of(values: FloatArray) -> FloatArray:
        """Error (n,) of the drive under parameter values, minus its mean."""
        number = problem.mechanism.legs.site_numbers[part.site]
        twists = np.broadcast_to(
            effect.contribute(motion, values).twists, (_PLACES, len(problem.mechanism.legs.sites), 6)
        )
        change = twists[:, number] @ part.twist / (part.twist @ part.twist)
        return np.asarray(change - change.mean())

    fitted = effect.coordinates.to_values(fit.state.effects[key], fit.state.shape(problem.library, key))
    steps = value_steps(fit, problem.library, term)
    return error_of(fitted), np.stack([(error_of(up) - error_of(down)) / size for up, down, size in steps], axis=1)
