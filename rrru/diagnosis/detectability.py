"""Detectability of each effect in a campaign, before anything is fitted.

It gives the share that the calibration does not absorb, the smallest detectable size, and the confounded effect.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.special import chdtri, chndtrinc

from rrru.arrays import FloatArray
from rrru.diagnosis.aliases import Row
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import LinearizedProblem

_HIDDEN = "cannot be separated from the geometric parameters at these poses"
_NO_RESULT = {"visible_share": np.nan, "detectable_mm": np.nan, "confounded_with": "", "confounded_share": np.nan}


def detectability(problem: DiagnosisProblem, linear: LinearizedProblem) -> pd.DataFrame:
    """Rows of `gap_identifiability` without the campaign, from the linearised model without effects."""
    base, _ = np.linalg.qr(linear.base.reshape(3 * len(problem), -1))
    visible = {name: _visible(problem, linear, base, name) for name in problem.effects}
    bases = {name: _basis(columns) for name, (_, columns) in visible.items()}
    rows = [{"effect": name, **_row(problem, name, *visible[name], bases)} for name in problem.effects]
    rows += [
        {"effect": name, "testable": False, **_NO_RESULT, "note": note} for name, note in problem.untestable.items()
    ]
    return pd.DataFrame(rows)


def with_seen(problem: DiagnosisProblem, linear: LinearizedProblem) -> tuple[DiagnosisProblem, LinearizedProblem]:
    """The problem without effects that the calibration would absorb even at their largest, and its linearisation."""
    base, _ = np.linalg.qr(linear.base.reshape(3 * len(problem), -1))
    hidden = {}
    for name, effect in problem.effects.items():
        largest = float(np.min(effect.coordinates.most / effect.coordinates.typical))
        visible = float(np.linalg.norm(_visible(problem, linear, base, name)[1]))
        if largest * visible < problem.noise_mm * np.sqrt(_needed(1)):
            hidden[name] = _HIDDEN
    library = {name: effect for name, effect in problem.library.items() if name not in hidden}
    columns = {key: column for key, column in linear.columns.items() if key[0] in library}
    seen = replace(problem, library=library, untestable=problem.untestable | hidden)
    return seen, replace(linear, columns=columns)


def _needed(freedom: int) -> float:
    """Square, over the noise, from which on an effect of so many degrees of freedom is found."""
    return float(chndtrinc(chdtri(freedom, OPTIONS.false_alarm_probability), freedom, 1.0 - OPTIONS.detection_power))


def _visible(
    problem: DiagnosisProblem, linear: LinearizedProblem, base: FloatArray, name: str
) -> tuple[FloatArray, FloatArray]:
    """Columns (3n, k) of an effect, all shapes, per typical size, with and without their part in a basis (3n, p)."""
    coordinates = problem.library[name].coordinates
    parts = [linear.columns[name, shape].reshape(3 * len(problem), -1) for shape in range(len(coordinates.shapes))]
    raw = np.concatenate([part * coordinates.typical for part in parts], axis=1)
    return raw, raw - base @ (base.T @ raw)


def _basis(columns: FloatArray) -> FloatArray:
    """Orthonormal basis of columns (3n, k)."""
    basis, size, _ = np.linalg.svd(columns, full_matrices=False)
    return basis[:, size > 1e-9 * max(size[0], 1e-300)]


def _row(
    problem: DiagnosisProblem, name: str, raw: FloatArray, visible: FloatArray, bases: Mapping[str, FloatArray]
) -> Row:
    """The row of one testable effect; raw, visible: its columns (3n, k) with and without the calibration's part."""
    square, total = float((visible**2).sum()), float((raw**2).sum())
    share = np.sqrt(square / total) if total > 0.0 else 0.0
    row = {"testable": True, **_NO_RESULT, "visible_share": share, "note": ""}
    if share < OPTIONS.min_visible_rms_share:
        return row | {"testable": False, "note": _HIDDEN}
    first = visible[:, : len(problem.library[name].coordinates)]
    freedom = np.linalg.matrix_rank(first, tol=1e-6 * np.linalg.norm(first))
    row["detectable_mm"] = float(problem.noise_mm * np.sqrt(_needed(freedom) / len(problem)))
    others = {other: basis for other, basis in bases.items() if other != name}
    shares = {other: float(((basis.T @ visible) ** 2).sum() / square) for other, basis in others.items()}
    if shares:
        best = max(shares, key=lambda other: shares[other])
        row |= {"confounded_with": best, "confounded_share": min(shares[best], 1.0)}
    return row
