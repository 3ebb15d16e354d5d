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


_CAMPAIGN = Column("campaign", "str", "name of the campaign in the configuration")
_CALIBRATION = Column("calibration", "str", "set of trajectories that was calibrated on; none before any calibration")
_METHOD = Column("method", "str", "how: least_squares, least_mean_distance (the optimum of the paper's objective), genetic; none before")
_MODE = Column(
    "mode",
    "str",
    "before: measured minus commanded; model: measured minus calibrated model; closed_loop: driven again with corrected commands",
    allowed=("before", "model", "closed_loop"),
)
_NUMBER = "float64"

_SETTING = (
    Column("parameter", "str", "swept setting", allowed=("crossover_fraction", "migration_fraction")),
    Column("population", "str", "one population, or islands", allowed=("one", "islands")),
    Column("value", _NUMBER, "value of the setting"),
)
_HISTORY = (
    Column("seed", "int64", "number of the run"),
    Column("generation", "int64", "0: initial population"),
    Column("best_mm", _NUMBER, "lowest mean distance so far"),
    Column("mean_mm", _NUMBER, "mean over the population; infinite where a member is out of reach"),
)

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
    Table(
        "truth",
        "campaigns/{campaign}/truth.parquet",
        "What only the virtual robot knows, one row per commanded point.",
        (
            Column("run", "int64", "as in measurements"),
            Column("trajectory", "str", "as in measurements"),
            Column("point", "int64", "as in measurements"),
            *_xyz("true", "mm", "true position, wobble included; null where the chains do not close", True),
            Column("platform_rotation_rad", _NUMBER, "angle by which the platform has turned; null where the chains do not close", True),
        ),
        ("run", "point"),
    ),
    Table(
        "singularity",
        "tables/singularity.parquet",
        "Distance of every commanded point from both kinds of singularity (smallest singular value of three unit rows: 0 at it, 1 at best).",
        (
            _CAMPAIGN,
            Column("run", "int64", "as in measurements"),
            Column("trajectory", "str", "as in measurements"),
            Column("point", "int64", "as in measurements"),
            Column("translational_measure", _NUMBER, "0 where the platform can move with locked drives"),
            Column("constraint_measure", _NUMBER, "0 where the platform can turn with locked drives; eq. (8) does not see it"),
            Column("constraint_determinant", _NUMBER, "changes its sign across a constraint singularity"),
            Column("status", "str", "as in measurements", allowed=STATUS),
        ),
        ("campaign", "run", "point"),
    ),
    Table(
        "campaigns",
        "tables/campaigns.parquet",
        "One row per campaign: where it came from and what state it is in.",
        (
            _CAMPAIGN,
            Column("robot", "str", "mechanism"),
            Column("source", "str", "virtual robot or file"),
            Column("points", "int64", "commanded points"),
            Column("runs", "int64", "passes"),
            *(Column(name, "int64", f"points with status {name}") for name in STATUS),
            Column("noise_mm", _NUMBER, "measuring noise per axis, 1 sigma"),
            Column(
                "noise_from",
                "str",
                "given: by the configuration; repeats: pooled over repeated points; residuals: from the fit of all points",
                allowed=("given", "repeats", "residuals"),
            ),
            Column("registration_rms_mm", _NUMBER, "residual of the frame registration; null where the frame was the robot's", True),
            Column("registration_max_mm", _NUMBER, "largest residual of the frame registration", True),
            Column("min_translational_measure", _NUMBER, "nearest approach to a translational singularity"),
            Column("min_constraint_measure", _NUMBER, "nearest approach to a constraint singularity"),
            Column("notes", "str", "what was computed or missing on ingest; empty where nothing was"),
        ),
        ("campaign",),
    ),
    Table(
        "calibrations",
        "tables/calibrations.parquet",
        "One row per calibration: how well it fits and how well the points determine it.",
        (
            _CAMPAIGN,
            _CALIBRATION,
            _METHOD,
            Column("points", "int64", "points fitted"),
            Column("mean_mm", _NUMBER, "mean distance: the paper's objective"),
            Column("rms_mm", _NUMBER, "root mean square distance"),
            Column("max_mm", _NUMBER, "largest distance"),
            Column("noise_mm", _NUMBER, "noise per axis that the standard errors assume"),
            Column(
                "noise_from",
                "str",
                "given, or residuals where nothing was given or the fit leaves more than that",
                allowed=("given", "residuals"),
            ),
            Column("rank", "int64", "parameter combinations that the points see, of 7"),
            Column("condition", _NUMBER, "condition number of the scaled Jacobian (angles as arcs at the end of the drive arm)"),
            *(
                Column(f"O{k}_observability", _NUMBER, text)
                for k, text in enumerate(
                    (
                        "geometric mean of the singular values over sqrt(points)",
                        "inverse condition",
                        "smallest singular value",
                        "smallest squared over largest",
                        "inverse sum of inverse singular values",
                    ),
                    start=1,
                )
            ),
            Column("evaluations", "int64", "evaluations of the residuals"),
            Column("parameters_at_bound", "int64", "parameters that ended at a bound"),
        ),
        ("campaign", "calibration", "method"),
    ),
    Table(
        "parameters",
        "tables/parameters.parquet",
        "Fitted errors of the mechanism; da = dr - dR, since R and r enter only as r - R.",
        (
            _CAMPAIGN,
            _CALIBRATION,
            _METHOD,
            Column("parameter", "str", "name of the error"),
            Column("unit", "str", "unit of the value", allowed=("rad", "mm")),
            Column("value", _NUMBER, "fitted error"),
            Column("standard_error", _NUMBER, "1 sigma; null for methods without one and for unseen parameters", True),
            Column("seen", "bool", "false where the points do not determine the parameter; its value then is the nominal one in part"),
            Column("at_bound", "bool", "true where the fit ended at a bound"),
            Column("true_value", _NUMBER, "the virtual robot's; null where nobody knows", True),
        ),
        ("campaign", "calibration", "method", "parameter"),
    ),
    Table(
        "correlations",
        "tables/correlations.parquet",
        "Correlation of the least-squares estimates.",
        (
            _CAMPAIGN,
            _CALIBRATION,
            Column("parameter_a", "str", "name"),
            Column("parameter_b", "str", "name"),
            Column("correlation", _NUMBER, "-1 to 1; null where a parameter is not seen", True),
        ),
        ("campaign", "calibration", "parameter_a", "parameter_b"),
    ),
    Table(
        "observability",
        "tables/observability.parquet",
        "Directions of parameter space from the best seen to the worst, and what each is made of.",
        (
            _CAMPAIGN,
            _CALIBRATION,
            Column("direction", "int64", "1: best seen"),
            Column("singular_value", _NUMBER, "mm of the stacked positions per mm along the direction"),
            Column("standard_error_mm", _NUMBER, "1 sigma along the direction; null where it is not seen", True),
            Column("parameter", "str", "name"),
            Column("weight", _NUMBER, "entry of the unit direction, angles as arcs at the end of the drive arm"),
        ),
        ("campaign", "calibration", "direction", "parameter"),
    ),
    Table(
        "errors",
        "tables/errors.parquet",
        "Error of every point before calibration and under every calibration.",
        (
            _CAMPAIGN,
            _CALIBRATION,
            _METHOD,
            _MODE,
            Column("run", "int64", "as in measurements"),
            Column("trajectory", "str", "as in measurements"),
            Column("point", "int64", "as in measurements"),
            *_xyz("error", "mm", "error; null where the point was not used", True),
            Column("error_mm", _NUMBER, "size of the error", True),
        ),
        ("campaign", "calibration", "method", "mode", "run", "point"),
    ),
    Table(
        "error_summary",
        "tables/error_summary.parquet",
        "The errors per trajectory (and all_lines, all), with accuracies after ISO 9283.",
        (
            _CAMPAIGN,
            _CALIBRATION,
            _METHOD,
            _MODE,
            Column("trajectory", "str", "trajectory, all_lines or all"),
            Column("points", "int64", "points with an error"),
            *(
                Column(f"{name}_mm", _NUMBER, f"{text} of the error's size", True)
                for name, text in (("min", "minimum"), ("mean", "mean"), ("rms", "root mean square"), ("max", "maximum"))
            ),
            Column("repeats", "int64", "smallest number of passes under the same conditions"),
            Column("pose_accuracy_mm", _NUMBER, "ISO 9283 AP: largest distance of a barycentre from its command", True),
            Column("path_accuracy_mm", _NUMBER, "ISO 9283 AT: the same, across the path only", True),
            Column("repeatability_mm", _NUMBER, "ISO 9283 RP: largest l + 3 S_l; null without repeats", True),
        ),
        ("campaign", "calibration", "method", "mode", "trajectory"),
    ),
    Table(
        "workspace",
        "campaigns/{campaign}/workspace.parquet",
        "Regular grid over two slices of the workspace: xz at y = 0, and xy through the middle of the commanded points.",
        (
            _CAMPAIGN,
            Column("slice", "str", "plane", allowed=("xz", "xy")),
            *(Column(f"{axis}_mm", _NUMBER, f"grid point, {axis}, robot frame") for axis in "xyz"),
            Column("reachable", "bool", "true where all three legs reach"),
            Column("translational_measure", _NUMBER, "as in singularity; null out of reach", True),
            Column("constraint_measure", _NUMBER, "as in singularity; null out of reach", True),
            Column("constraint_determinant", _NUMBER, "as in singularity; null out of reach", True),
        ),
        ("slice", "x_mm", "y_mm", "z_mm"),
    ),
    Table(
        "genetic",
        "tables/genetic.parquet",
        "One row per run of the genetic algorithm with the chosen settings, beside the least mean distance that it should find.",
        (
            _CAMPAIGN,
            _CALIBRATION,
            Column("seed", "int64", "number of the run"),
            Column("objective_mm", _NUMBER, "mean distance that the run reached"),
            Column("generations", "int64", "generations done"),
            Column("evaluations", "int64", "evaluations of the objective"),
            Column("stopped", "str", "why it stopped", allowed=("generations", "stalled")),
            Column("polished_mm", _NUMBER, "mean distance after a local polish from where the run ended"),
            Column("optimum_mm", _NUMBER, "least mean distance, found from the least-squares fit"),
            Column("excess", _NUMBER, "objective_mm / optimum_mm - 1"),
            Column("polished_excess", _NUMBER, "polished_mm / optimum_mm - 1"),
            *(
                Column(name, _NUMBER, "error that the run found, rad" if name.startswith("dtheta") else "error that the run found, mm")
                for name in ("dtheta1", "dtheta2", "dtheta3", "dL1", "dL2", "dL3", "dR", "dr")
            ),
            Column("da", _NUMBER, "dr - dR, the part of both that can be identified, mm"),
        ),
        ("campaign", "calibration", "seed"),
    ),
    Table(
        "genetic_history",
        "tables/genetic_history.parquet",
        "Convergence of the runs in `genetic`: every generation up to 100, every 10th after it, and the last.",
        (_CAMPAIGN, _CALIBRATION, *_HISTORY),
        ("campaign", "calibration", "seed", "generation"),
    ),
    Table(
        "genetic_against_least_squares",
        "tables/genetic_against_least_squares.parquet",
        "Methods side by side on every calibration; the genetic algorithm's entries are medians over its seeds.",
        (
            _CAMPAIGN,
            _CALIBRATION,
            _METHOD,
            Column("runs", "int64", "seeds; 1 for what has none"),
            Column("mean_mm", _NUMBER, "mean distance reached (median over the seeds)"),
            Column("worst_mean_mm", _NUMBER, "mean distance of the worst seed"),
            Column("excess", _NUMBER, "mean_mm over the least mean distance - 1"),
            Column("evaluations", _NUMBER, "evaluations of all residuals (median over the seeds)"),
            Column("angle_error_rad", _NUMBER, "RMS deviation of the drive-angle errors from the truth; null where nobody knows it", True),
            Column("length_error_mm", _NUMBER, "RMS deviation of dL1, dL2, dL3 and da from the truth", True),
        ),
        ("campaign", "calibration", "method"),
    ),
    Table(
        "timings",
        "timings/timings.parquet",
        "Time of one calibration by each method on this machine; the only table whose bytes differ from run to run.",
        (
            _CAMPAIGN,
            _CALIBRATION,
            _METHOD,
            Column("seconds", _NUMBER, "wall time of one calibration (median over the seeds)"),
        ),
        ("campaign", "calibration", "method"),
    ),
    Table(
        "sweep_runs",
        "tables/sweep_runs.parquet",
        "One row per run of the sweeps of the crossover and migration fraction.",
        (
            *_SETTING,
            Column("seed", "int64", "number of the run"),
            Column("objective_mm", _NUMBER, "mean distance that the run reached"),
            Column("generations", "int64", "generations done"),
            Column("evaluations", "int64", "evaluations of the objective"),
            Column("stopped", "str", "why it stopped", allowed=("generations", "stalled")),
            *(
                Column(name, _NUMBER, "error that the run found, rad" if name.startswith("dtheta") else "error that the run found, mm")
                for name in ("dtheta1", "dtheta2", "dtheta3", "dL1", "dL2", "dL3", "dR", "dr")
            ),
        ),
        ("parameter", "population", "value", "seed"),
    ),
    Table(
        "sweep_history",
        "tables/sweep_history.parquet",
        "Convergence of the runs in `sweep_runs`: every generation up to 100, every 10th after it, and the last.",
        (*_SETTING, *_HISTORY),
        ("parameter", "population", "value", "seed", "generation"),
    ),
    Table(
        "sweep_effect",
        "tables/sweep_effect.parquet",
        "Whether a setting's effect can be told from the seeds' scatter: Kruskal-Wallis test over all values.",
        (
            *_SETTING[:2],
            Column("settings", "int64", "values compared"),
            Column("runs", "int64", "runs compared"),
            Column("statistic", _NUMBER, "H"),
            Column("p_value", _NUMBER, "chance of such differences if the setting did nothing"),
            Column("epsilon_squared", _NUMBER, "share of the rank variance that the setting explains"),
            Column("statistic_mutating", _NUMBER, "H without the crossover fraction 1.0, where nothing mutates"),
            Column("p_value_mutating", _NUMBER, "the same"),
            Column("epsilon_squared_mutating", _NUMBER, "the same"),
            Column("distinguishable_mutating", "bool", "p_value_mutating below 5 %"),
        ),
        ("parameter", "population"),
    ),
    Table(
        "sweep_pairs",
        "tables/sweep_pairs.parquet",
        "Every value against the one with the lowest median: Mann-Whitney test, corrected after Holm.",
        (
            *_SETTING,
            Column("best_value", _NUMBER, "value with the lowest median"),
            Column("median_mm", _NUMBER, "median mean distance"),
            Column("difference_mm", _NUMBER, "median minus that of the best value"),
            Column("difference_low_mm", _NUMBER, "lower end of the 95 % bootstrap interval", True),
            Column("difference_high_mm", _NUMBER, "upper end", True),
            Column("p_value", _NUMBER, "Mann-Whitney, two-sided"),
            Column("p_holm", _NUMBER, "corrected for the number of values"),
            Column("distinguishable", "bool", "p_holm below 5 %"),
        ),
        ("parameter", "population", "value"),
    ),
    Table(
        "published",
        "tables/published.parquet",
        "Every number that paper A prints, beside what this study gives.",
        (
            Column("item", "str", "what the number is"),
            Column("source", "str", "table, figure, section or sentence of the paper"),
            Column("unit", "str", "unit as printed"),
            Column("published", _NUMBER, "printed number"),
            Column("here", _NUMBER, "this study's number; null where it has none", True),
            Column("ratio", _NUMBER, "here / published; null where either is null or zero", True),
            Column("note", "str", "what differs, and why"),
        ),
        ("item", "source"),
    ),
    Table(
        "audit",
        "tables/audit.parquet",
        "Misprints and contradictions of paper A, each recomputed.",
        (
            Column("where", "str", "place in the paper"),
            Column("printed", "str", "what stands there"),
            Column("right", "str", "what should"),
            Column("check", "str", "what is computed to show it"),
            Column("unit", "str", "unit of the two values"),
            Column("value_printed", _NUMBER, "what the printed form gives; null where it gives nothing", True),
            Column("value_right", _NUMBER, "what the right form or the independent check gives; null where it gives nothing", True),
            Column("shown", "bool", "true where the numbers show the misprint or contradiction"),
        ),
        ("where", "check"),
    ),
)

TABLES = {table.name: table for table in _ALL}
