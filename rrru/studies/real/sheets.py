"""A real series of an arm as a campaign file in our own format: one row per target and stop, mm, rad, quaternions."""

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from rrru.campaign.ingest.sheet import MEASURED, QUATERNIONS
from rrru.campaign.ingest.spec import MM, RAD
from rrru.campaign.noise import typical
from rrru.errors import ConfigError, IngestError
from rrru.studies.real.series import Series

# columns: flags of held-out rows, and numbers of the rows in the file
HELD_OUT, PLACE = "held_out", "row"
TEMPERATURE = "temperature_c"


def sheet(series: Series, raw: pd.DataFrame) -> pd.DataFrame:
    """Columns of a campaign file with HELD_OUT and PLACE; rows in the order driven, the targets of each together.

    The set's section assigns the columns: joints, {actuator column: theirs}, in angle_unit, absent where they have our
    names; readings, {target: {position, unit, rotation, sequence, rotation_unit}}; temperature, in degrees Celsius;
    held_out. The row number replaces the time. Targets without readings are left out. Raises ConfigError for a missing
    column, for one that is not of numbers, for a blank joint of a row with readings, and where there are no readings.
    """
    section, parts = series.section, []
    common = {"trajectory": "poses", "time_s": np.arange(len(raw), dtype=float), HELD_OUT: _held_out(series, raw)}
    joints = joint_columns(series, raw)
    for ours, theirs in joints.items():
        scale = 1.0 if ours.endswith("_mm") else RAD[section.get("angle_unit", "rad")]
        common[ours] = scale * _numbers(series, raw, "joints", theirs)
    if "temperature" in section:
        common[TEMPERATURE] = _numbers(series, raw, "temperature", section["temperature"])
    for target, reading in section["readings"].items():
        part = pd.DataFrame(common | dict(_read(series, raw, target, reading)))
        parts.append(part.assign(target=target, **{PLACE: np.arange(1, len(raw) + 1)}))
    whole = pd.concat(parts).sort_values(PLACE, kind="stable")
    whole = whole[whole[[*MEASURED]].notna().all(axis=1)].reset_index(drop=True)
    if whole.empty:
        read = " or ".join(", ".join(reading["position"]) for reading in section["readings"].values())
        raise ConfigError(f"{series.file}: no row has numbers in {read}; allowed: numbers in some rows")
    for ours, theirs in joints.items():
        blank = whole.loc[whole[ours].isna(), PLACE]
        if len(blank):
            where = f"row {blank.iloc[0]}, column {theirs}"
            raise ConfigError(f"{series.file}: {where}: blank; allowed: a number where a target was seen")
    return whole


def joint_columns(series: Series, raw: pd.DataFrame) -> Mapping[str, str]:
    """Our actuator columns mapped to theirs; where the section names none, all of the file's with our names."""
    named = series.section.get("joints")
    return named or {name: name for name in raw if name.startswith("q") and name.endswith(("_rad", "_mm"))}


def in_series_terms(error: IngestError, series: Series, whole: pd.DataFrame) -> IngestError:
    """The IngestError of a sheet in terms of rows and columns of the series' file."""
    theirs, problems = dict(series.section.get("joints", {})) | {TEMPERATURE: series.section.get("temperature")}, []
    for problem in error.problems:
        row, column, names = problem.get("row"), problem.get("column"), theirs
        if row is not None and row <= len(whole):
            at = whole.iloc[row - 1]
            row, reading = int(at[PLACE]), series.section["readings"][at["target"]]
            names = theirs | dict(zip(MEASURED, reading["position"], strict=True))
        if column is not None:
            column = ", ".join(names.get(name, name) for name in column.split(", "))
        place = {"file": str(series.file), "row": row, "column": column, "value": in_file(problem["value"], whole)}
        problems.append(problem | place)
    return IngestError(problems)


def in_file(text: str, whole: pd.DataFrame) -> str:
    """A text with rows of a sheet, given as points of its single run or as rows, in rows of the file and targets."""

    def place(found: re.Match) -> str:
        """A row of the sheet in words."""
        number = int(found[1]) - 1
        if not 0 <= number < len(whole):
            return found[0]
        return f"row {whole[PLACE].iloc[number]} of {whole['target'].iloc[number]}"

    return re.sub(r"\b(?:run 1 point|row) (\d+)\b", place, text)


def stated_noise(series: Series, raw: pd.DataFrame) -> tuple[float | None, float | None]:
    """Noise per axis stated by the instrument: of positions in mm and of orientations in rad, None where not stated.

    See `rrru.campaign.noise.typical`. Raises ConfigError for a column whose median is not above 0, since every
    instrument has noise.
    """
    result = []
    for key, scales, unit in (("position_std", MM, "unit"), ("rotation_std", RAD, "rotation_unit")):
        axes = []
        for target, reading in series.section["readings"].items():
            scale = scales[reading.get(unit, "mm" if scales is MM else "rad")]
            for name in reading.get(key, ()):
                stated = _numbers(series, raw, f"readings.{target}", name)
                if np.isfinite(stated).any():
                    axes.append(scale * stated)
                    if np.nanmedian(stated) <= 0.0:
                        raise ConfigError(f"{series.file}: column {name}: 0 or less at the median; allowed: above 0")
        result.append(typical(axes) if axes else None)
    return result[0], result[1]


def _read(
    series: Series, raw: pd.DataFrame, target: str, reading: Mapping[str, Any]
) -> Iterator[tuple[str, np.ndarray]]:
    """Columns of the readings of one target."""
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
    """Flags (n,) of the held-out rows: those of the file, otherwise every third from the second on.

    Raises ConfigError for a flag that is neither 0 nor 1, and where no row is left for a fit.
    """
    name = series.section.get("held_out", HELD_OUT)
    if name not in raw and "held_out" not in series.section:
        return np.arange(len(raw)) % 3 == 1
    flags = _numbers(series, raw, "held_out", name)
    wrong = np.flatnonzero(~np.isin(flags, (0.0, 1.0)))
    if len(wrong):
        where = f"row {wrong[0] + 1}, column {name}"
        raise ConfigError(f"{series.file}: {where}: {raw[name].tolist()[wrong[0]]!r}; allowed: 0 or 1")
    if flags.all():
        raise ConfigError(f"{series.file}: column {name}: 1 in every row; allowed: 0 in those to fit on")
    return flags == 1.0


def _numbers(series: Series, raw: pd.DataFrame, key: str, name: str) -> np.ndarray:
    """A column (n,) of numbers, NaN where blank; raises ConfigError naming the first cell that is not a number."""
    cells = series.column(raw, key, name)
    values = pd.to_numeric(cells, errors="coerce").to_numpy(dtype=float)
    wrong = np.flatnonzero(np.isinf(values) | (np.isnan(values) & cells.notna().to_numpy()))
    if len(wrong):
        where = f"row {wrong[0] + 1}, column {name}"
        raise ConfigError(f"{series.file}: {where}: {cells.tolist()[wrong[0]]!r}; allowed: a number, or blank")
    return values
