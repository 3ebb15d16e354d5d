"""Where to start a fit of lengths only: anchors and places out of the lengths themselves, without a guess.

With the first anchor at the origin, L_ij^2 - L_i0^2 = |a_j|^2 - 2 p_i . a_j has, less its mean over the rows, rank d:
its singular vectors are anchors and places up to a linear map, and L_i0^2 = |p_i|^2 is linear in the square of this
map (Crocco, Del Bue, Murino, A bilinear approach to the position self-calibration of multiple sensors, IEEE
Transactions on Signal Processing 60, 2012). So lengths that miss nothing give the machine in closed form. In space
five anchors in one plane leave this map open for good, since any place's height above them makes up for it.
"""

from collections.abc import Iterator

import numpy as np

from rrru.fit.lengths_model import framed

# a length may miss up to this share of the longest, and a row may be a bad one: several of each are tried
_MISSING = (0.0, 0.02, -0.02, 0.05, -0.05, 0.1, -0.1, 0.2)
_DRAWS, _DRAWN, _SEED = 4, 20, 1


def starts(
    counted: np.ndarray, heights_mm: np.ndarray, dimensions: int
) -> Iterator[tuple[np.ndarray, np.ndarray, float]]:
    """Anchors (n, d), places (N, d) and a missing length in mm to start from; counted (N, n) in mm.

    Each comes from all rows, and from a few drawn ones: rows with a bad reading spoil the former.
    """
    generator, rows = np.random.default_rng(_SEED), len(counted)
    subsets = [np.arange(rows)]
    if rows > _DRAWN:
        subsets += [np.sort(generator.choice(rows, _DRAWN, replace=False)) for _ in range(_DRAWS)]
    for share in _MISSING:
        missing = share * float(counted.max())
        squares = (counted + missing) ** 2 - heights_mm**2
        for chosen in subsets:
            anchors = anchors_of(squares[chosen], dimensions)
            if anchors is not None:
                yield *framed(anchors, places_of(squares, anchors)), missing


def anchors_of(squares: np.ndarray, dimensions: int) -> np.ndarray | None:
    """Anchors (n, d) of squared distances (N, n) in mm^2, the first at the origin; None where they do not tell."""
    less = squares[:, 1:] - squares[:, :1]
    left, size, right = np.linalg.svd(less - less.mean(axis=0), full_matrices=False)
    if len(size) < dimensions or size[dimensions - 1] <= 1e-9 * size[0]:
        return None
    # places are mean + map @ affine, anchors -1/2 map^-T @ slope
    affine, slope = left[:, :dimensions] * size[:dimensions], right[:dimensions]
    unit = np.abs(affine).max()
    affine, slope = affine / unit, slope * unit
    first, second = np.triu_indices(dimensions)
    twice = np.where(first == second, 1.0, 2.0)
    columns = np.column_stack([np.ones(len(affine)), affine, twice * affine[:, first] * affine[:, second]])
    fitted, *_ = np.linalg.lstsq(columns, squares[:, 0], rcond=None)
    square = np.zeros((dimensions, dimensions))
    square[first, second] = square[second, first] = fitted[1 + dimensions :]
    values, vectors = np.linalg.eigh(square)
    if values[-1] <= 0.0:
        return None
    # noise may leave a direction negative: it is taken as short instead
    root = np.sqrt(np.maximum(values, 1e-3 * values[-1]))
    slopes = (vectors / root).T @ slope
    return np.concatenate([np.zeros((1, dimensions)), -0.5 * slopes.T])


def places_of(squares: np.ndarray, anchors: np.ndarray) -> np.ndarray:
    """Places (N, d) of squared distances (N, n) in mm^2 to anchors (n, d), by linear trilateration."""
    target = (anchors[1:] ** 2).sum(axis=1) - (anchors[0] ** 2).sum() - (squares[:, 1:] - squares[:, :1])
    fitted, *_ = np.linalg.lstsq(2.0 * (anchors[1:] - anchors[0]), target.T, rcond=None)
    return fitted.T
