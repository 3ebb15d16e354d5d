"""Tables of the errors before and under every calibration."""

from rrru.store.schema import CALIBRATION, CAMPAIGN, METHOD, MODE, Column, Table, numbers, xyz

_SIZES = {"min": "minimum", "mean": "mean", "rms": "root mean square", "max": "maximum"}

TABLES = (
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
            *numbers(True, error_mm="size of the error"),
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
            *numbers(True, **{f"{name}_mm": f"{text} of the error's size" for name, text in _SIZES.items()}),
            Column("repeats", "int64", "smallest number of passes under the same conditions"),
            *numbers(
                True,
                pose_accuracy_mm="ISO 9283 AP: largest distance of a barycentre from its command "
                "(mode model: from the model's position)",
                path_accuracy_mm="ISO 9283 AT: the same, across the path only",
                repeatability_mm="ISO 9283 RP: largest l + 3 S_l; null with fewer than 3 repeats",
            ),
        ),
        ("campaign", "calibration", "method", "mode", "trajectory"),
    ),
)
