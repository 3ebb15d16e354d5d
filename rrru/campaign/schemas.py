"""Tables of the campaigns."""

from rrru.store.schema import CAMPAIGN, NUMBER, STATUS, Column, Table, xyz


def _measurements(name, robots, drives):
    """Schema of the measurement table of robots with certain columns of actuator values."""
    return Table(
        name,
        "campaigns/{campaign}/measurements.parquet",
        f"One row per commanded point, {robots}: what was commanded and what the instrument saw.",
        (
            Column("run", "int64", "number of the pass, from 1 in the order driven"),
            Column("trajectory", "str", "name of the trajectory"),
            Column("point", "int64", "number of the point in its run, from 1"),
            Column("time_s", "float64", "time since the campaign's start; null where the file has none", True),
            *xyz("command", "mm", "commanded position, robot frame"),
            *drives,
            *xyz("measured", "mm", "measured position, robot frame; null where the point was not measured", True),
            Column("speed_mm_s", "float64", "speed of the run; null where the file has none", True),
            Column("payload_kg", "float64", "payload on the platform; null where the file has none", True),
            Column(
                "status",
                "str",
                "every point is kept; outlier and unsolved are left out of fits, near_singularity only with use_near_singularity: false",
                allowed=STATUS,
            ),
        ),
        ("run", "point"),
    )


TABLES = (
    _measurements(
        "measurements",
        "robots with drive arms",
        [Column(f"theta{k}_rad", NUMBER, f"commanded drive angle of leg {k}") for k in (1, 2, 3)],
    ),
    _measurements(
        "slider_measurements",
        "robots with sliders",
        [Column(f"slider{k}_mm", NUMBER, f"commanded position of slider {k}") for k in (1, 2, 3)],
    ),
    Table(
        "truth",
        "campaigns/{campaign}/truth.parquet",
        "What only the virtual robot knows, one row per commanded point.",
        (
            Column("run", "int64", "as in measurements"),
            Column("trajectory", "str", "as in measurements"),
            Column("point", "int64", "as in measurements"),
            *xyz("true", "mm", "true position, wobble included; null where the chains do not close", True),
            Column(
                "platform_rotation_rad",
                NUMBER,
                "angle by which the platform has turned; null where the chains do not close",
                True,
            ),
        ),
        ("run", "point"),
    ),
    Table(
        "singularity",
        "tables/singularity.parquet",
        "Distance of every commanded point from both kinds of singularity (smallest singular value of three unit rows: 0 at it, 1 at best).",
        (
            CAMPAIGN,
            Column("run", "int64", "as in measurements"),
            Column("trajectory", "str", "as in measurements"),
            Column("point", "int64", "as in measurements"),
            Column("translational_measure", NUMBER, "0 where the platform can move with locked drives"),
            Column(
                "constraint_measure",
                NUMBER,
                "0 where the platform can turn with locked drives; eq. (8) does not see it",
            ),
            Column("constraint_determinant", NUMBER, "changes its sign across a constraint singularity"),
            Column("status", "str", "as in measurements", allowed=STATUS),
        ),
        ("campaign", "run", "point"),
    ),
    Table(
        "workspace",
        "campaigns/{campaign}/workspace.parquet",
        "Regular grid over two slices of the workspace: xz at y = 0, and xy through the middle of the commanded points.",
        (
            CAMPAIGN,
            Column("slice", "str", "plane", allowed=("xz", "xy")),
            *(Column(f"{axis}_mm", NUMBER, f"grid point, {axis}, robot frame") for axis in "xyz"),
            Column("reachable", "bool", "true where all three legs reach"),
            Column("translational_measure", NUMBER, "as in singularity; null out of reach", True),
            Column("constraint_measure", NUMBER, "as in singularity; null out of reach", True),
            Column("constraint_determinant", NUMBER, "as in singularity; null out of reach", True),
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
            Column(
                "noise_from",
                "str",
                "given: by the configuration; repeats: pooled over repeated points; residuals: from the fit of all points",
                allowed=("given", "repeats", "residuals"),
            ),
            Column("platform_mass_kg", NUMBER, "the real robot's platform, as given; null where it was not", True),
            Column(
                "registration_rms_mm",
                NUMBER,
                "residual of the frame registration; null where the frame was the robot's",
                True,
            ),
            Column("registration_max_mm", NUMBER, "largest residual of the frame registration", True),
            Column("min_translational_measure", NUMBER, "nearest approach to a translational singularity"),
            Column("min_constraint_measure", NUMBER, "nearest approach to a constraint singularity"),
            Column("notes", "str", "what was computed or missing on ingest; empty where nothing was"),
        ),
        ("campaign",),
    ),
)
