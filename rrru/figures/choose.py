"""Rows of the result tables that a figure draws, with clear errors where they are not there."""

import re
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from rrru.errors import ConfigError

# tables by name, and the options of all figures
Tables: TypeAlias = Mapping[str, pd.DataFrame]
Options: TypeAlias = Mapping[str, Any]

_CALIBRATION_LABELS = {
    "group_1": "calibration on group 1",
    "lines": "line calibration",
    "spiral": "spiral calibration",
    "both": "calibration on both",
}
# symbols of error parameters
PARAMETER_LABELS = {
    **{f"dtheta{leg}": rf"$\Delta\theta_{leg}$" for leg in (1, 2, 3)},
    **{f"dL{link}": rf"$\Delta L_{link}$" for link in (1, 2, 3)},
    **{f"db{leg}": rf"$\Delta b_{leg}$" for leg in (1, 2, 3)},
    "da": r"$\Delta a$",
    "dL": r"$\Delta L$",
    "dl1": r"$\Delta l_1$",
    "dl2": r"$\Delta l_2$",
}


def calibration_label(calibration: str) -> str:
    """Name of a calibration in a legend."""
    return _CALIBRATION_LABELS.get(calibration, f"calibration on {calibration}")


def trajectory_label(trajectory: str) -> str:
    """Name of a trajectory in a figure of paper A, which calls the lines groups."""
    found = re.fullmatch(r"line_(\d+)", trajectory)
    return f"group {found[1]}" if found else plain(trajectory)


def plain(name: str) -> str:
    """A name as words."""
    return name.replace("_", " ")


def natural(name: str) -> list[tuple[int, int, str]]:
    """Sorting key that puts line_10 behind line_9."""
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in re.split(r"(\d+)", name)]


def where(frame: pd.DataFrame, **values: object) -> pd.DataFrame:
    """Rows of a table whose columns have the given values."""
    return frame[np.logical_and.reduce([frame[name] == value for name, value in values.items()])]


def trajectories(paths: pd.DataFrame, pattern: str, figure: str) -> list[str]:
    """Names of a campaign's trajectories that fit a pattern, in natural order; raises ConfigError where none does."""
    present = sorted(paths["trajectory"].unique(), key=natural)
    chosen = [name for name in present if fnmatchcase(name, pattern)]
    if not chosen:
        known = ", ".join(present) or "none"
        raise ConfigError(f"{figure}: the campaign has no trajectory {pattern!r}; it has {known}")
    return chosen


def of_campaign(tables: Tables, name: str, campaign: str, figure: str) -> pd.DataFrame:
    """Rows of a table that belong to a campaign; raises ConfigError naming the campaigns that the table has."""
    frame = tables[name]
    rows = frame[frame["campaign"] == campaign]
    if rows.empty:
        raise ConfigError(f"{figure}: table {name} has no campaign {campaign!r}; it has {_listed(frame['campaign'])}")
    return rows


def mode_of(errors: pd.DataFrame, options: Options) -> str:
    """The mode that is drawn: the one asked for, or "model" where the campaign was never driven again."""
    return options["mode"] if (errors["mode"] == options["mode"]).any() else "model"


def before(tables: Tables, options: Options, figure: str) -> pd.DataFrame:
    """Rows of `errors` before any calibration."""
    errors = of_campaign(tables, "errors", options["campaign"], figure)
    return errors[errors["mode"] == "before"]


def after(tables: Tables, options: Options, calibration: str, figure: str) -> tuple[pd.DataFrame, str]:
    """Rows of `errors` under a calibration, and their mode; raises ConfigError where there are none."""
    campaign, method = options["campaign"], options["method"]
    errors = of_campaign(tables, "errors", campaign, figure)
    mode = mode_of(errors, options)
    drawn = errors[errors["mode"] == mode]
    rows = drawn[(drawn["calibration"] == calibration) & (drawn["method"] == method)]
    if rows.empty:
        wanted = f"calibration {calibration!r} by {method!r} (mode {mode})"
        known = _listed(drawn["calibration"])
        raise ConfigError(f"{figure}: campaign {campaign!r} has no errors under {wanted}; it has {known}")
    return rows, mode


def after_label(calibration: str, mode: str) -> str:
    """Legend entry of an error after a calibration; a model residual says that it is one."""
    return f"{'residual of' if mode == 'model' else 'after'} {calibration_label(calibration)}"


def stations(paths: pd.DataFrame, trajectory: str) -> pd.DataFrame:
    """Points of a trajectory in all passes with their station: the number of the first pass's nearest point, from 1.

    So passes in the other direction, or of another number of points, lie at the right places. Columns run, point,
    station, the command of the first pass there (x_mm, y_mm, z_mm) and status.
    """
    rows = paths[paths["trajectory"] == trajectory].sort_values(["run", "point"])
    position = rows[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy(dtype=float)
    in_first = (rows["run"] == rows["run"].iloc[0]).to_numpy()
    first = position[in_first]
    index = np.linalg.norm(position[:, None] - first, axis=2).argmin(axis=1)
    # a closed path passes the same place twice: in the first pass every point is its own station
    index[in_first] = np.arange(len(first))
    place = dict(zip(("x_mm", "y_mm", "z_mm"), first[index].T, strict=True))
    return rows[["run", "point", "status"]].assign(station=index + 1, **place)


def along(
    errors: pd.DataFrame, places: pd.DataFrame, columns: Sequence[str] = ("error_mm",)
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Mean, lowest and highest of error columns at each station over the passes: frames by station, null where none."""
    joined = places.merge(errors[["run", "point", *columns]], on=["run", "point"], how="left", validate="one_to_one")
    groups = joined.groupby("station")[list(columns)]
    return groups.mean(), groups.min(), groups.max()


def passes(places: pd.DataFrame) -> int:
    """Number of passes of a trajectory."""
    return int(places["run"].nunique())


def _listed(values: Iterable[object]) -> str:
    """Distinct values as text."""
    return ", ".join(sorted({str(value) for value in values})) or "none"
