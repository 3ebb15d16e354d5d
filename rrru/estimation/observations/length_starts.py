"""Start values of anchors estimated from lengths alone: closed forms of the lengths, without a guess.

With the first anchor at the origin, L_ij^2 - L_i0^2 = |a_j|^2 - 2 p_i . a_j has, less its mean over the rows, rank d:
its singular vectors are anchors and places up to a linear map, and L_i0^2 = |p_i|^2 is linear in the square of this
map (Crocco, Del Bue, Murino, A bilinear approach to the position self-calibration of multiple sensors, IEEE
Transactions on Signal Processing 60, 2012). So lengths without a missing part give the machine in closed form. In space
five anchors in one plane do not determine this map, since it is confounded with the places' heights above them.
"""

from collections.abc import Iterator

import numpy as np

from rrru.arrays import BoolArray, FloatArray

# a length may miss up to this share of the longest, and a row may be a bad one: several of each are tried
_MISSING_SHARES = (0.0, 0.02, -0.02, 0.05, -0.05, 0.1, -0.1, 0.2)
_SUBSETS, _SUBSET_ROWS, _SEED = 4, 20, 1


def propose_anchors(
    counted_mm: FloatArray, heights_mm: FloatArray, dimensions: int
) -> Iterator[tuple[FloatArray, float]]:
    """Anchors (n, d) in their frame and a missing length in mm to start from; counted_mm (N, n), heights_mm (n,).

    Each comes from all rows, and from a few drawn ones: rows with a bad reading spoil the former.
    """
    generator, rows = np.random.default_rng(_SEED), len(counted_mm)
    subsets = [np.arange(rows)]
    if rows > _SUBSET_ROWS:
        subsets += [np.sort(generator.choice(rows, _SUBSET_ROWS, replace=False)) for _ in range(_SUBSETS)]
    for share in _MISSING_SHARES:
        missing = share * float(counted_mm.max())
        squares = (counted_mm + missing) ** 2 - heights_mm**2
        for chosen in subsets:
            anchors = solve_anchors(squares[chosen], dimensions)
            if anchors is not None:
                yield align_to_frame(anchors), missing


def solve_anchors(squares: FloatArray, dimensions: int) -> FloatArray | None:
    """Anchors (n, d) of squared distances (N, n) in mm^2, the first at the origin; None where undetermined."""
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


def align_to_frame(anchors: FloatArray, points: FloatArray | None = None) -> FloatArray:
    """Points (m, d), by default the anchors, turned, moved and mirrored into the frame that the anchors (n, d) fix.

    The first anchor is the origin, the second is on the positive x axis, the third above it, in space in the plane of x
    and y. Lengths do not distinguish a space from its mirror image, so the fourth is put at positive z.
    """
    origin = anchors[0]
    axes, upper = np.linalg.qr((anchors[1 : anchors.shape[1] + 1] - origin).T)
    axes = axes * np.where(np.diag(upper) < 0.0, -1.0, 1.0)
    return np.asarray(((anchors if points is None else points) - origin) @ axes)


def free_coordinates(anchors: int, dimensions: int) -> BoolArray:
    """Flags (anchors, dimensions) of the coordinates that `align_to_frame` does not fix."""
    free = np.ones((anchors, dimensions), dtype=bool)
    for row in range(min(anchors, dimensions)):
        free[row, row:] = False
    return free
