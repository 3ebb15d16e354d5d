"""Consistency of reflectors: readings of a wrong reflector, found by distances on one body without kinematics.

Reflectors on the tool keep their distances from each other, whatever the robot does; those on the table keep their
places in the instrument's frame. A reflector that is off from most others of its body was confused with another one, or
was never there. Of two that disagree it is unknown which one is right: both are marked. Lengths in mm.
"""

import numpy as np

from rrru.campaign.outliers import MAX_ROBUST_SDS, robust_sd, unless_many

# ASSUME no body bends by a millimetre, and reflectors are further apart than that
_FAR_MM = 1.0
# a body on which more than this share is off is not rigid: its reflectors move against each other
_MAX_SHARE = 0.2


def strays(position_mm, stop, names, on_world):
    """Which of n readings (n, 3) at stops (n,) are of another reflector than the named one, and a text on each.

    names (n,); on_world (n,): which reflectors are fixed to the world. Returns (marked (n,), texts by row's number),
    such as "base3 lies 210 mm away, where base1 is".
    """
    every, number = np.unique(np.asarray(names, dtype=str), return_inverse=True)
    at = np.unique(stop, return_inverse=True)[1]
    grid = np.full((at.max() + 1, len(every), 3), np.nan)
    grid[at, number] = position_mm
    fixed = np.array([np.asarray(on_world)[number == k].any() for k in range(len(every))])
    marked, places = np.zeros(len(at), dtype=bool), np.where(fixed[:, None], np.nanmedian(grid, axis=0), np.nan)
    wrong = _moved(grid, places) | _apart(grid, np.flatnonzero(~fixed))
    marked = wrong[at, number]
    texts = {}
    for row in np.flatnonzero(marked):
        right_mm = np.where(fixed[:, None], places, np.where(wrong[at[row], :, None], np.nan, grid[at[row]]))
        texts[int(row)] = _text(every, number[row], position_mm[row], right_mm, grid)
    return marked, texts


def _moved(grid, places):
    """Readings (stops, r) that are not where their reflectors stand, places (r, 3), NaN where these move."""
    off = np.linalg.norm(grid - places, axis=2)
    wrong = np.zeros(off.shape, dtype=bool)
    for k in np.flatnonzero(np.isfinite(places).all(axis=1)):
        wrong[:, k] = _outlying(off[:, k])
    return wrong


def _apart(grid, body):
    """Readings (stops, r) of the reflectors of a body, by number, that are off from most of its others."""
    wrong = np.zeros(grid.shape[:2], dtype=bool)
    if len(body) < 2:
        return wrong
    distance = np.linalg.norm(grid[:, body, None] - grid[:, None, body], axis=3)
    # pairs that were never seen together have no usual distance
    together = np.isfinite(distance).any(axis=0)
    usual = np.zeros(together.shape)
    usual[together] = np.nanmedian(distance[:, together], axis=0)
    off = np.abs(distance - usual)
    bad, seen = np.zeros(off.shape, dtype=bool), np.isfinite(off)
    for first, second in zip(*np.triu_indices(len(body), 1), strict=True):
        bad[:, first, second] = bad[:, second, first] = _outlying(off[:, first, second])
    companions = seen.sum(axis=2) - seen[:, range(len(body)), range(len(body))]
    wrong[:, body] = (companions > 0) & (2 * bad.sum(axis=2) > companions)
    return wrong


def _outlying(off):
    """Which deviations (stops,) from the usual distance, NaN where unknown, are gross; none where many are."""
    if not np.isfinite(off).any():
        return np.zeros(len(off), dtype=bool)
    return unless_many(off > max(_FAR_MM, MAX_ROBUST_SDS * robust_sd(off[np.isfinite(off)])), _MAX_SHARE)


def _text(names, number, position, right_mm, grid):
    """Text on a wrong reading of a reflector, by number; right_mm (r, 3): places of all, NaN where unknown."""
    away = np.linalg.norm(right_mm - position, axis=1)
    near = int(np.nanargmin(np.where(np.arange(len(names)) == number, np.inf, np.nan_to_num(away, nan=np.inf))))
    if away[near] < _FAR_MM:
        # on one body the two keep their distance
        usual = np.nanmedian(np.linalg.norm(grid[:, number] - grid[:, near], axis=1))
        far = away[number] if np.isfinite(away[number]) else usual
        return f"{names[number]} lies {far:.3g} mm away, where {names[near]} is"
    if np.isfinite(away[number]):
        return f"{names[number]} lies {away[number]:.3g} mm away"
    return f"{names[number]} does not keep its distance from the others"
