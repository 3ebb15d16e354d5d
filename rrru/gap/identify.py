"""What a campaign can show of each effect, before anything is fitted: how much of it the calibration leaves, from what
size on it is found, and which other effect could stand in for it.
"""

import numpy as np
import pandas as pd
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2

# found 9 times of 10 at 1 % false alarms
_POWER, _FALSE = 0.9, 0.01


def identify(case, linear):
    """Rows of `gap_identifiability` without the campaign, from the linearised sim without effects."""
    visible = {name: _visible(case, linear, name) for name in case.effects}
    bases = {name: _basis(columns) for name, (_, columns) in visible.items()}
    rows = [_row(case, name, *visible[name], bases) for name in case.effects]
    rows += [
        {
            "effect": name,
            "testable": False,
            "visible_share": np.nan,
            "detectable_mm": np.nan,
            "imitated_by": "",
            "imitated_share": np.nan,
            "note": note,
        }
        for name, note in case.untestable.items()
    ]
    return pd.DataFrame(rows)


def _visible(case, linear, name):
    """Columns of an effect (all its shapes) per typical size, before and after the calibration's part is taken out."""
    coordinates = case.library[name].coordinates
    raw = np.concatenate(
        [
            linear.columns[name, shape].reshape(3 * len(case), -1) * coordinates.typical
            for shape in range(len(coordinates.shapes))
        ],
        axis=1,
    )
    base, _ = np.linalg.qr(linear.base.reshape(3 * len(case), -1))
    return raw, raw - base @ (base.T @ raw)


def _basis(columns):
    """Orthonormal basis of columns (3n, k)."""
    basis, size, _ = np.linalg.svd(columns, full_matrices=False)
    return basis[:, size > 1e-9 * max(size[0], 1e-300)]


def _row(case, name, raw, visible, bases):
    """The row of one testable effect; raw, visible: its columns (3n, k) with and without the calibration's part."""
    count = len(case.library[name].coordinates)
    own, total = float((visible**2).sum()), float((raw**2).sum())
    share = np.sqrt(own / total) if total > 0.0 else 0.0
    row = {
        "effect": name,
        "testable": True,
        "visible_share": share,
        "detectable_mm": np.nan,
        "imitated_by": "",
        "imitated_share": np.nan,
        "note": "",
    }
    if share < 1e-6:
        return row | {"testable": False, "note": "the calibration takes it up entirely on these points"}
    freedom = np.linalg.matrix_rank(visible[:, :count], tol=1e-6 * np.linalg.norm(visible[:, :count]))
    threshold = chi2.isf(_FALSE, freedom)
    needed = brentq(lambda x: ncx2.sf(threshold, freedom, x) - _POWER, 1e-3, 1e3)
    row["detectable_mm"] = float(case.noise_mm * np.sqrt(needed / len(case)))
    for other, basis in bases.items():
        if other != name:
            imitated = float(((basis.T @ visible) ** 2).sum() / own)
            if not imitated <= (row["imitated_share"] if np.isfinite(row["imitated_share"]) else -1.0):
                row |= {"imitated_by": other, "imitated_share": min(imitated, 1.0)}
    return row
