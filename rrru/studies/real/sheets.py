"""A real series of an arm as a campaign file of our own form: one row per target and stop, mm, rad, quaternions."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.campaign.ingest.columns import MM, RAD
from rrru.campaign.ingest.sheet import MEASURED, QUATERNIONS
from rrru.errors import ConfigError
from rrru.studies.real.series import Series

# flags of the rows that are kept out of every fit, and the numbers of the rows in the file
HELD_OUT, PLACE = "held_out", "row"


def sheet(series: Series, raw: pd.DataFrame) -> pd.DataFrame:
    """Columns of a campaign file, and HELD_OUT and PLACE; rows in the order driven, the targets of each together.

    The set's section says which columns are what: joints, {actuator column: theirs}, in joint_unit, absent where they
    are called like ours; readings, {target: {position, unit, rotation, sequence, rotation_unit}}; held_out. The number
    of the row stands for the time. Targets that were not seen are left out. Raises ConfigError for a column that is not
    there or not of numbers.
    """
    section, parts = series.section, []
    common = {"trajectory": "poses", "time_s": np.arange(len(raw), dtype=float), HELD_OUT: _held_out(series, raw)}
    for ours, theirs in _joints(series, raw).items():
        scale = 1.0 if ours.endswith("_mm") else RAD[section.get("joint_unit", "rad")]
        common[ours] = scale * _numbers(series, raw, "joints", theirs)
    for target, reading in section["readings"].items():
        part = pd.DataFrame(common | dict(_read(series, raw, target, reading)))
        parts.append(part.assign(target=target, **{PLACE: np.arange(1, len(raw) + 1)}))
    whole = pd.concat(parts).sort_values(PLACE, kind="stable")
    return whole[whole[[*MEASURED]].notna().all(axis=1)].reset_index(drop=True)


def _joints(series: Series, raw: pd.DataFrame) -> Mapping[str, str]:
    """Our actuator columns to theirs; where the section names none, all of the file's that are called like ours."""
    named = series.section.get("joints")
    return named or {name: name for name in raw if name.startswith("q") and name.endswith(("_rad", "_mm"))}


def stated_noise(series: Series, raw: pd.DataFrame) -> tuple[float | None, float | None]:
    """Noise per axis that the instrument states: of positions in mm and of orientations in rad, None where it does not.

    Medians over the rows of each axis, since single readings may be far worse than the rest; root mean square of axes.
    """
    result = []
    for key, scales, unit in (("position_std", MM, "unit"), ("rotation_std", RAD, "rotation_unit")):
        axes = [
            scales[reading.get(unit, "mm" if scales is MM else "rad")]
            * _numbers(series, raw, f"readings.{target}", name)
            for target, reading in series.section["readings"].items()
            for name in reading.get(key, ())
        ]
        result.append(float(np.sqrt(np.mean([np.nanmedian(axis) ** 2 for axis in axes]))) if axes else None)
    return result[0], result[1]


def _read(
    series: Series, raw: pd.DataFrame, target: str, reading: Mapping[str, Any]
) -> Iterator[tuple[str, np.ndarray]]:
    """Columns of what was read of one target."""
    key = f"readings.{target}"
    for ours, theirs in zip(MEASURED, reading["position"], strict=True):
        yield ours, MM[reading.get("unit", "mm")] * _numbers(series, raw, key, theirs)
    if "rotation" in reading:
        angles = np.stack([_numbers(series, raw, key, name) for name in reading["rotation"]], axis=1)
        known = np.isfinite(angles).all(axis=1)
        turns = np.full((len(raw), 4), np.nan)
        in_rad = RAD[reading.get("rotation_unit", "rad")] * angles[known]
        turns[known] = Rotation.from_euler(reading["sequence"], in_rad).as_quat()
        yield from zip(QUATERNIONS["measured"], turns.T, strict=True)


def _held_out(series: Series, raw: pd.DataFrame) -> np.ndarray:
    """Which rows (n,) are held out: those that the file flags, else every third from the second on."""
    name = series.section.get("held_out")
    return np.arange(len(raw)) % 3 == 1 if name is None else _numbers(series, raw, "held_out", name) == 1.0


def _numbers(series: Series, raw: pd.DataFrame, key: str, name: str) -> np.ndarray:
    """A column (n,) of numbers, NaN where blank; raises ConfigError naming the first cell that holds none."""
    cells = series.column(raw, key, name)
    values = pd.to_numeric(cells, errors="coerce")
    wrong = np.flatnonzero(values.isna() & cells.notna())
    if len(wrong):
        where = f"row {wrong[0] + 2}, column {name}"
        raise ConfigError(f"{series.file}: {where}: {cells.iloc[wrong[0]]!r}; allowed: a number")
    return values.to_numpy(dtype=float)
