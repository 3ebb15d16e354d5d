"""Residual error before and after a campaign's calibration, in mm, measuring noise subtracted."""

from dataclasses import dataclass

import pandas as pd

from rrru.diagnosis.number_text import rounded
from rrru.diagnosis.shrink import gap_rms


@dataclass(frozen=True)
class Worth:
    """Root mean square distances at the same points, noise subtracted: before any calibration, with one that has used
    these points. registered: the instrument's frame had been fitted to the commanded points before.
    """

    points: int
    before_mm: float
    seen_mm: float
    registered: bool


def worth(errors: pd.DataFrame, points: pd.DataFrame, noise_rms_mm: float, registered: bool) -> Worth | None:
    """The Worth of a campaign, None where none of its points has an error before calibration.

    errors: rows of `errors` of the campaign; points: `gap_points`; noise_rms_mm: 3-D.
    """
    before = errors.loc[errors["mode"] == "before", ["run", "point", "error_mm"]]
    both = points[points["used"]].merge(before, on=["run", "point"]).dropna(subset=["error_mm"])
    if both.empty:
        return None
    squares = both["error_mm"] ** 2, gap_squares(both)
    before_mm, seen_mm = (gap_rms(one - noise_rms_mm**2) for one in squares)
    return Worth(len(both), before_mm, seen_mm, registered)


def gap_squares(points: pd.DataFrame) -> pd.Series:
    """Squared distances (n,) in space, in mm^2, that the calibration leaves at rows of `gap_points`."""
    return (points[[f"before_{axis}_mm" for axis in "xyz"]] ** 2).sum(axis=1)


def sentences(found: Worth, left_out_mm: float) -> list[str]:
    """Sentences on a Worth; left_out_mm: residual error at points that were left out of the calibration."""
    registered = ", after registration of the instrument's frame" if found.registered else ""
    size = f"{rounded(found.before_mm)} mm rms{registered} (distance in space, noise subtracted)"
    said = [f"Before any calibration the error at the same {found.points} points is {size}."]
    if left_out_mm >= found.before_mm:
        said.append(
            f"At points that the calibration has used, the residual error is {rounded(found.seen_mm)} mm: it has "
            "absorbed a part of the cause, and its parameters do not carry over to points that were left out."
        )
    return said
