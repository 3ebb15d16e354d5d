"""Tables of the campaigns."""

from rrru.store.schema import CAMPAIGN, NUMBER, STATUS, Column, Table, numbers, xyz

_POINT = (
    Column("run", "int64", "as in measurements"),
    Column("trajectory", "str", "as in measurements"),
    Column("point", "int64", "as in measurements"),
)
_NOISE_FROM = "given: by the configuration; repeats: pooled over repeated points; residuals: from the fit of all points"
_MEASURES = ("translational_measure", "constraint_measure", "constraint_determinant")
_STATUS_MEANS = (
    "every point is kept; outlier and unsolved are left out of fits, "
    "near_singularity only with use_near_singularity: false"
)


def _measurements(name, robots, drive, meaning):
    """Schema of the measurement table of robots whose actuator values stand in columns such as theta1_rad."""
    return Table(
        name,
        "campaigns/{campaign}/measurements.parquet",
        f"One row per commanded point, {robots}: what was commanded and what the instrument saw.",
        (
            Column("run", "int64", "number of the pass, from 1 in the order driven"),
            Column("trajectory", "str", "name of the trajectory"),
            Column("point", "int64", "number of the point in its run, from 1"),
            *numbers(True, time_s="time since the campaign's start; null where the file has none"),
            *xyz("command", "mm", "commanded position, robot frame"),
            *numbers(**{drive.format(leg): f"commanded {meaning} {leg}" for leg in (1, 2, 3)}),
            *xyz("measured", "mm", "measured position, robot frame; null where the point was not measured", True),
            *numbers(True, speed_mm_s="speed of the run; null where the file has none"),
            *numbers(True, payload_kg="payload on the platform; null where the file has none"),
            Column("status", "str", _STATUS_MEANS, allowed=STATUS),
        ),
        ("run", "point"),
    )


TABLES = (
    _measurements("measurements", "robots with drive arms", "theta{}_rad", "drive angle of leg"),
    _measurements("slider_measurements", "robots with sliders", "slider{}_mm", "position of slider"),
    Table(
        "truth",
        "campaigns/{campaign}/truth.parquet",
        "What only the virtual robot knows, one row per commanded point.",
        (
            *_POINT,
            *xyz("true", "mm", "true position, non-repeatability included; null where the chains do not close", True),
            *numbers(True, platform_rotation_rad="the platform's turn; null where the chains do not close"),
        ),
        ("run", "point"),
    ),
    Table(
        "singularity",
        "tables/singularity.parquet",
        "Distance of every commanded point from both kinds of singularity (smallest singular value of three unit rows: "
        "0 at it, 1 at best).",
        (
            CAMPAIGN,
            *_POINT,
            *numbers(
                translational_measure="0 where the platform can move with locked drives",
                constraint_measure="0 where the platform can turn with locked drives; eq. (8) does not see it",
                constraint_determinant="changes its sign across a constraint singularity",
            ),
            Column("status", "str", "as in measurements", allowed=STATUS),
        ),
        ("campaign", "run", "point"),
    ),
    Table(
        "workspace",
        "campaigns/{campaign}/workspace.parquet",
        "Regular grid over two slices of the workspace: xz at y = 0, xy through the middle of the commanded points.",
        (
            CAMPAIGN,
            Column("slice", "str", "plane", allowed=("xz", "xy")),
            *numbers(**{f"{axis}_mm": f"grid point, {axis}, robot frame" for axis in "xyz"}),
            Column("reachable", "bool", "true where all three legs reach"),
            *numbers(True, **dict.fromkeys(_MEASURES, "as in singularity; null out of reach")),
        ),
        ("slice", "x_mm", "y_mm", "z_mm"),
    ),
    Table(
        "campaigns",
        "tables/campaigns.parquet",
        "One row per campaign: where it came from and what state it is in.",
        (
            CAMPAIGN,
            Column("robot", "str", "mechanism"),
            Column("source", "str", "virtual robot or file"),
            Column("points", "int64", "commanded points"),
            Column("runs", "int64", "passes"),
            *(Column(name, "int64", f"points with status {name}") for name in STATUS),
            Column("noise_mm", NUMBER, "measuring noise per axis, 1 sigma"),
            Column("noise_from", "str", _NOISE_FROM, allowed=("given", "repeats", "residuals")),
            *numbers(
                True,
                platform_mass_kg="the real robot's platform, as given; null where it was not",
                registration_rms_mm="residual of the frame registration; null where the frame was the robot's",
                registration_max_mm="largest residual of the frame registration",
            ),
            *numbers(
                min_translational_measure="nearest approach to a translational singularity",
                min_constraint_measure="nearest approach to a constraint singularity",
            ),
            Column("notes", "str", "what was computed or missing on ingest; empty where nothing was"),
        ),
        ("campaign",),
    ),
)
