"""Tables of the genetic algorithm and its sweeps."""

from rrru.store.schema import CALIBRATION, CAMPAIGN, HISTORY, METHOD, NUMBER, SETTING, Column, Table

TABLES = (
    Table(
        "genetic",
        "tables/genetic.parquet",
        "One row per run of the genetic algorithm with the chosen settings, beside the least mean distance that it should find.",
        (
            CAMPAIGN,
            CALIBRATION,
            Column("seed", "int64", "number of the run"),
            Column("objective_mm", NUMBER, "mean distance that the run reached"),
            Column("generations", "int64", "generations done"),
            Column("evaluations", "int64", "evaluations of the objective"),
            Column("stopped", "str", "why it stopped", allowed=("generations", "stalled")),
            Column("polished_mm", NUMBER, "mean distance after a local polish from where the run ended"),
            Column("optimum_mm", NUMBER, "least mean distance within the bounds, found from the least-squares fit"),
            Column("polish_evaluations", "int64", "evaluations of the local polish"),
            Column("excess", NUMBER, "objective_mm / optimum_mm - 1; null where the optimum is zero", True),
            Column("polished_excess", NUMBER, "polished_mm / optimum_mm - 1; null where the optimum is zero", True),
            *(
                Column(
                    name,
                    NUMBER,
                    f"error that the run found, {'rad' if name.startswith('dtheta') else 'mm'}; null for a robot without it",
                    True,
                )
                for name in (
                    "dtheta1",
                    "dtheta2",
                    "dtheta3",
                    "dL1",
                    "dL2",
                    "dL3",
                    "dR",
                    "dr",
                    "db1",
                    "db2",
                    "db3",
                    "dL",
                    "dl1",
                    "dl2",
                )
            ),
            Column(
                "da", NUMBER, "dr - dR, the part of both that can be identified, mm; null for a robot without it", True
            ),
        ),
        ("campaign", "calibration", "seed"),
    ),
    Table(
        "genetic_history",
        "tables/genetic_history.parquet",
        "Convergence of the runs in `genetic`: every generation up to 100, every 10th after it, and the last.",
        (CAMPAIGN, CALIBRATION, *HISTORY),
        ("campaign", "calibration", "seed", "generation"),
    ),
    Table(
        "genetic_against_least_squares",
        "tables/genetic_against_least_squares.parquet",
        "Methods side by side on every calibration; the genetic algorithm's entries are medians over its seeds.",
        (
            CAMPAIGN,
            CALIBRATION,
            METHOD,
            Column("runs", "int64", "seeds; 1 for what has none"),
            Column("mean_mm", NUMBER, "mean distance reached (median over the seeds)"),
            Column("worst_mean_mm", NUMBER, "mean distance of the worst seed"),
            Column("excess", NUMBER, "mean_mm over the least mean distance - 1; null where that is zero", True),
            Column("evaluations", NUMBER, "evaluations of all residuals (median over the seeds)"),
            Column(
                "angle_error_rad",
                NUMBER,
                "RMS deviation of the drive-angle errors from the truth; null where nobody knows it",
                True,
            ),
            Column("length_error_mm", NUMBER, "RMS deviation of dL1, dL2, dL3 and da from the truth", True),
        ),
        ("campaign", "calibration", "method"),
    ),
    Table(
        "timings",
        "timings/{campaign}.parquet",
        "Time of one calibration by each method on this machine; the only table whose bytes differ from run to run.",
        (
            CAMPAIGN,
            CALIBRATION,
            METHOD,
            Column("seconds", NUMBER, "wall time of one calibration (median over the seeds)"),
        ),
        ("campaign", "calibration", "method"),
    ),
    Table(
        "sweep_runs",
        "tables/sweep_runs.parquet",
        "One row per run of the sweeps of the crossover and migration fraction.",
        (
            *SETTING,
            Column("seed", "int64", "number of the run"),
            Column("objective_mm", NUMBER, "mean distance that the run reached"),
            Column("generations", "int64", "generations done"),
            Column("evaluations", "int64", "evaluations of the objective"),
            Column("stopped", "str", "why it stopped", allowed=("generations", "stalled")),
            *(
                Column(
                    name,
                    NUMBER,
                    "error that the run found, rad" if name.startswith("dtheta") else "error that the run found, mm",
                )
                for name in ("dtheta1", "dtheta2", "dtheta3", "dL1", "dL2", "dL3", "dR", "dr")
            ),
        ),
        ("parameter", "population", "value", "seed"),
    ),
    Table(
        "sweep_history",
        "tables/sweep_history.parquet",
        "Convergence of the runs in `sweep_runs`: every generation up to 100, every 10th after it, and the last.",
        (*SETTING, *HISTORY),
        ("parameter", "population", "value", "seed", "generation"),
    ),
    Table(
        "sweep_effect",
        "tables/sweep_effect.parquet",
        "Whether a setting's effect can be told from the seeds' scatter: Kruskal-Wallis test over all values.",
        (
            *SETTING[:2],
            Column("settings", "int64", "values compared"),
            Column("runs", "int64", "runs compared"),
            Column("statistic", NUMBER, "H"),
            Column("p_value", NUMBER, "chance of such differences if the setting did nothing"),
            Column("epsilon_squared", NUMBER, "share of the rank variance that the setting explains"),
            Column("statistic_mutating", NUMBER, "H without the crossover fraction 1.0, where nothing mutates"),
            Column("p_value_mutating", NUMBER, "the same"),
            Column("epsilon_squared_mutating", NUMBER, "the same"),
            Column("distinguishable_mutating", "bool", "p_value_mutating below 5 %"),
        ),
        ("parameter", "population"),
    ),
    Table(
        "sweep_pairs",
        "tables/sweep_pairs.parquet",
        "Every value against the one with the lowest median: Mann-Whitney test, corrected after Holm.",
        (
            *SETTING,
            Column("best_value", NUMBER, "value with the lowest median"),
            Column("median_mm", NUMBER, "median mean distance"),
            Column("difference_mm", NUMBER, "median minus that of the best value"),
            Column("difference_low_mm", NUMBER, "lower end of the 95 % bootstrap interval", True),
            Column("difference_high_mm", NUMBER, "upper end", True),
            Column("p_value", NUMBER, "Mann-Whitney, two-sided"),
            Column("p_holm", NUMBER, "corrected for the number of values"),
            Column("distinguishable", "bool", "p_holm below 5 %"),
        ),
        ("parameter", "population", "value"),
    ),
)
