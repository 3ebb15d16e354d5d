"""Tables of the calibrations and of the errors under them."""

from rrru.store.schema import CALIBRATION, CAMPAIGN, METHOD, MODE, NUMBER, Column, Table, xyz

TABLES = (
    Table(
        "calibrations",
        "tables/calibrations.parquet",
        "One row per calibration: how well it fits and how well the points determine it.",
        (
            CAMPAIGN,
            CALIBRATION,
            METHOD,
            Column("points", "int64", "points fitted"),
            Column("mean_mm", NUMBER, "mean distance: the paper's objective"),
            Column("rms_mm", NUMBER, "root mean square distance"),
            Column("max_mm", NUMBER, "largest distance"),
            Column("noise_mm", NUMBER, "noise per axis that the standard errors assume"),
            Column(
                "noise_from",
                "str",
                "given: by the configuration or from repeats, see campaigns; residuals: of this fit, where nothing was given or more is left",
                allowed=("given", "residuals"),
            ),
            Column("rank", "int64", "parameter combinations that the points see, of 7"),
            Column(
                "condition",
                NUMBER,
                "condition number of the scaled Jacobian (angles as arcs at the end of the drive arm)",
            ),
            *(
                Column(f"O{k}_observability", NUMBER, text)
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
            CAMPAIGN,
            CALIBRATION,
            METHOD,
            Column("parameter", "str", "name of the error"),
            Column("unit", "str", "unit of the value", allowed=("rad", "mm")),
            Column("value", NUMBER, "fitted error"),
            Column("standard_error", NUMBER, "1 sigma; null for methods without one and for unseen parameters", True),
            Column(
                "seen",
                "bool",
                "false where the points do not determine the parameter; its value then is the nominal one in part",
            ),
            Column("at_bound", "bool", "true where the fit ended at a bound"),
            Column("true_value", NUMBER, "the virtual robot's; null where nobody knows", True),
        ),
        ("campaign", "calibration", "method", "parameter"),
    ),
    Table(
        "correlations",
        "tables/correlations.parquet",
        "Correlation of the least-squares estimates.",
        (
            CAMPAIGN,
            CALIBRATION,
            Column("parameter_a", "str", "name"),
            Column("parameter_b", "str", "name"),
            Column("correlation", NUMBER, "-1 to 1; null where a parameter is not seen", True),
        ),
        ("campaign", "calibration", "parameter_a", "parameter_b"),
    ),
    Table(
        "observability",
        "tables/observability.parquet",
        "Directions of parameter space from the best seen to the worst, and what each is made of.",
        (
            CAMPAIGN,
            CALIBRATION,
            Column("direction", "int64", "1: best seen"),
            Column("singular_value", NUMBER, "mm of the stacked positions per mm along the direction"),
            Column("standard_error_mm", NUMBER, "1 sigma along the direction; null where it is not seen", True),
            Column("parameter", "str", "name"),
            Column("weight", NUMBER, "entry of the unit direction, angles as arcs at the end of the drive arm"),
        ),
        ("campaign", "calibration", "direction", "parameter"),
    ),
    Table(
        "errors",
        "tables/errors.parquet",
        "Error of every point before calibration and under every calibration.",
        (
            CAMPAIGN,
            CALIBRATION,
            METHOD,
            MODE,
            Column("run", "int64", "as in measurements"),
            Column("trajectory", "str", "as in measurements"),
            Column("point", "int64", "as in measurements"),
            *xyz("error", "mm", "error; null where the point was not used", True),
            Column("error_mm", NUMBER, "size of the error", True),
        ),
        ("campaign", "calibration", "method", "mode", "run", "point"),
    ),
    Table(
        "error_summary",
        "tables/error_summary.parquet",
        "The errors per trajectory (and all_lines, all), with accuracies after ISO 9283.",
        (
            CAMPAIGN,
            CALIBRATION,
            METHOD,
            MODE,
            Column("trajectory", "str", "trajectory, all_lines or all"),
            Column("points", "int64", "points with an error"),
            *(
                Column(f"{name}_mm", NUMBER, f"{text} of the error's size", True)
                for name, text in (
                    ("min", "minimum"),
                    ("mean", "mean"),
                    ("rms", "root mean square"),
                    ("max", "maximum"),
                )
            ),
            Column("repeats", "int64", "smallest number of passes under the same conditions"),
            Column(
                "pose_accuracy_mm",
                NUMBER,
                "ISO 9283 AP: largest distance of a barycentre from its command (mode model: from the model's position)",
                True,
            ),
            Column("path_accuracy_mm", NUMBER, "ISO 9283 AT: the same, across the path only", True),
            Column("repeatability_mm", NUMBER, "ISO 9283 RP: largest l + 3 S_l; null with fewer than 3 repeats", True),
        ),
        ("campaign", "calibration", "method", "mode", "trajectory"),
    ),
)
