"""Tables of the calibrations."""

from rrru.store.schema import CALIBRATION, CAMPAIGN, METHOD, Column, Table, numbers

_NOISE_FROM = (
    "given: by the configuration or from repeats, see campaigns; residuals: of this fit, where nothing was given or "
    "more is left"
)

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
            *numbers(
                mean_mm="mean distance: the paper's objective",
                rms_mm="root mean square distance",
                max_mm="largest distance",
                noise_mm="noise per axis that the standard errors assume",
            ),
            Column("noise_from", "str", _NOISE_FROM, allowed=("given", "residuals")),
            Column("rank", "int64", "parameter combinations that the points see, of 7"),
            *numbers(
                condition="condition number of the scaled Jacobian (angles as arcs at the end of the drive arm)",
                O1_observability="geometric mean of the singular values over sqrt(points)",
                O2_observability="inverse condition",
                O3_observability="smallest singular value",
                O4_observability="smallest squared over largest",
                O5_observability="inverse sum of inverse singular values",
            ),
            Column("evaluations", "int64", "evaluations of the residuals"),
            Column("parameters_at_bound", "int64", "parameters that ended at a bound"),
        ),
        ("campaign", "calibration", "method"),
    ),
    Table(
        "parameters",
        "tables/parameters.parquet",
        "Fitted deviations of the mechanism; da = dr - dR, since R and r enter only as r - R.",
        (
            CAMPAIGN,
            CALIBRATION,
            METHOD,
            Column("parameter", "str", "name of the parameter"),
            Column("unit", "str", "unit of the value", allowed=("rad", "mm")),
            *numbers(value="fitted deviation from the nominal value"),
            *numbers(True, standard_error="1 sigma; null for methods without one and for unseen parameters"),
            Column("seen", "bool", "false where the points do not determine it; its value is then nominal in part"),
            Column("at_bound", "bool", "true where the fit ended at a bound"),
            *numbers(True, true_value="the virtual robot's; null where nobody knows"),
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
            *numbers(True, correlation="-1 to 1; null where a parameter is not seen"),
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
            *numbers(singular_value="mm of the stacked positions per mm along the direction"),
            *numbers(True, standard_error_mm="1 sigma along the direction; null where it is not seen"),
            Column("parameter", "str", "name"),
            *numbers(weight="entry of the unit direction, angles as arcs at the end of the drive arm"),
        ),
        ("campaign", "calibration", "direction", "parameter"),
    ),
)
