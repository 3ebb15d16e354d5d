"""Whether two campaigns leave the same gap, as a whole and part by part. Sizes are 3-D root mean squares in mm."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import norm

from rrru.report.compare import over_runs

_PARTS = ("effect", "scatter", "runs", "unexplained")


@dataclass(frozen=True)
class GapDifference:
    """rows: parts with their size and its 95 % interval on both sides, and whether the intervals are apart; chance: the
    probability that chance makes the gaps of both sides as different as they are.
    """

    rows: pd.DataFrame
    chance: float


def gap_difference(first, second):
    """The GapDifference of two Sides."""
    squares = [_square(side) for side in (first, second)]
    apart = squares[1][0] - squares[0][0]
    error = float(np.hypot(squares[0][1], squares[1][1]))
    names = dict.fromkeys(part["part"] for side in (first, second) for part in _sized_parts(side))
    listed = [{part["part"]: part for part in _sized_parts(side)} for side in (first, second)]
    rows = [
        _part_row(name, *(_interval(side, part.get(name)) for side, part in zip((first, second), listed, strict=True)))
        for name in names
    ]
    rows = [row for row in rows if row["a_rms_mm"] > 0.0 or row["b_rms_mm"] > 0.0]
    return GapDifference(pd.DataFrame(rows), float(2.0 * norm.sf(abs(apart) / error)) if error > 0.0 else 1.0)


def _sized_parts(side):
    """Parts of the budget that are sizes."""
    return [part for part in side.verdict["budget"] if part["kind"] in _PARTS]


def _square(side):
    """Mean square of the gap, noise subtracted, and its standard error over the runs."""
    points = side.frames["gap_points"].query("used")
    size = (points[[f"before_{axis}_mm" for axis in "xyz"]] ** 2).sum(axis=1)
    mean, error = over_runs(size, points["run"])
    return mean - side.verdict["noise_rms_mm"] ** 2, error


def _interval(side, part):
    """Size of a part with its 95 % interval, zeros where the side does not have it."""
    if part is None:
        return 0.0, 0.0, 0.0
    # shares are of what all parts together make
    whole = part["rms_mm"] ** 2 / part["share"] if part["share"] > 0.0 else 0.0
    return part["rms_mm"], *(float(np.sqrt(max(part[end], 0.0) * whole)) for end in ("share_low", "share_high"))


def _part_row(name, first, second):
    """A row of both sides' sizes and intervals."""
    row = {"part": name}
    for side, (size, low, high) in zip("ab", (first, second), strict=True):
        row |= {f"{side}_rms_mm": size, f"{side}_low_mm": low, f"{side}_high_mm": high}
    return row | {"differs": first[2] < second[1] or second[2] < first[1]}
