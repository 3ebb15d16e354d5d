"""The schema of every result table: what `results/README.md` prints and `rrru.report.tables` checks."""

from dataclasses import dataclass

import pandera.pandas as pa


@dataclass(frozen=True)
class Column:
    """One column: name with its unit, kind (int64, float64, str, bool), meaning; `allowed` lists the values of a closed set."""

    name: str
    kind: str
    description: str
    nullable: bool = False
    allowed: tuple = ()


@dataclass(frozen=True)
class Table:
    """One table: where it lies below results/, what a row is, its columns and the columns that name a row."""

    name: str
    path: str
    description: str
    columns: tuple[Column, ...]
    key: tuple[str, ...]

    def pandera(self):
        """Pandera schema: exactly these columns, typed, null only where allowed, key unique."""
        return pa.DataFrameSchema(
            {
                column.name: pa.Column(
                    column.kind, checks=[pa.Check.isin(column.allowed)] if column.allowed else None, nullable=column.nullable
                )
                for column in self.columns
            },
            strict=True,
            coerce=True,
            unique=list(self.key) or None,
        )


def _xyz(prefix, suffix, text, nullable=False):
    """Three columns for the axes."""
    return tuple(Column(f"{prefix}_{axis}_{suffix}", "float64", f"{text}, {axis}", nullable) for axis in "xyz")


STATUS = ("ok", "outlier", "near_singularity", "unsolved")

_ALL = (
    Table(
        "measurements",
        "campaigns/{campaign}/measurements.parquet",
        "One row per commanded point: what was commanded and what the instrument saw.",
        (
            Column("run", "int64", "number of the pass, from 1 in the order driven"),
            Column("trajectory", "str", "name of the trajectory"),
            Column("point", "int64", "number of the point in its run, from 1"),
            Column("time_s", "float64", "time since the campaign's start; null where the file has none", True),
            *_xyz("command", "mm", "commanded position, robot frame"),
            *(Column(f"theta{k}_rad", "float64", f"commanded drive angle of leg {k}") for k in (1, 2, 3)),
            *_xyz("measured", "mm", "measured position, robot frame; null where the point was not measured", True),
            Column("speed_mm_s", "float64", "speed of the run; null where the file has none", True),
            Column("payload_kg", "float64", "payload on the platform; null where the file has none", True),
            Column("status", "str", "ok: used in fits; every other point is kept, reported and left out of fits", allowed=STATUS),
        ),
        ("run", "point"),
    ),
)

TABLES = {table.name: table for table in _ALL}
