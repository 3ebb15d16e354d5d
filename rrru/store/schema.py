"""What a schema is made of, and the columns that many tables share."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """One column: name with its unit, kind (int64, float64, str, bool), meaning; `allowed` lists the values of a closed
    set.
    """

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

    @property
    def names(self):
        """The columns' names in order."""
        return [column.name for column in self.columns]

    def pandera(self):
        """Pandera schema: exactly these columns, typed, null only where allowed, key unique."""
        import pandera.pandas as pa

        def checked(column):
            values = pa.Check.isin(column.allowed) if column.allowed else None
            return pa.Column(column.kind, checks=values, nullable=column.nullable)

        columns = {column.name: checked(column) for column in self.columns}
        return pa.DataFrameSchema(columns, strict=True, coerce=True, unique=list(self.key) or None)


def xyz(prefix, suffix, text, nullable=False):
    """Three columns for the axes."""
    return tuple(Column(f"{prefix}_{axis}_{suffix}", "float64", f"{text}, {axis}", nullable) for axis in "xyz")


def numbers(nullable=False, **texts):
    """One column of numbers per name, with its description."""
    return tuple(Column(name, "float64", text, nullable) for name, text in texts.items())


CAMPAIGN = Column("campaign", "str", "name of the campaign in the configuration")
CALIBRATION = Column("calibration", "str", "set of trajectories that was calibrated on; none before any calibration")
METHOD = Column(
    "method",
    "str",
    "how: least_squares, least_mean_distance (the optimum of the paper's objective), genetic; none before",
)
MODE = Column(
    "mode",
    "str",
    "before: measured minus commanded; model: measured minus calibrated model; closed_loop: driven again with corrected commands",
    allowed=("before", "model", "closed_loop"),
)
NUMBER = "float64"

SETTING = (
    Column("parameter", "str", "swept setting", allowed=("crossover_fraction", "migration_fraction")),
    Column("population", "str", "one population, or islands", allowed=("one", "islands")),
    Column("value", NUMBER, "value of the setting"),
)
HISTORY = (
    Column("seed", "int64", "number of the run"),
    Column("generation", "int64", "0: initial population"),
    Column("best_mm", NUMBER, "lowest mean distance so far"),
    Column("mean_mm", NUMBER, "mean over the population; infinite where a member is out of reach"),
)

STATUS = ("ok", "outlier", "near_singularity", "unsolved")
