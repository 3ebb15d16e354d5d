"""Tables of the Delta's zero calibration by vision."""

from rrru.store.schema import NUMBER, Column, Table, xyz

_VARIANT = Column("variant", "str", "how the zero errors were found; none: before")
_SOURCE = Column(
    "source",
    "str",
    "images: R_j and T_j of every image; one_rotation: the same images, one rotation for all; true_centres: for comparison; tracker",
    allowed=("none", "images", "one_rotation", "true_centres", "tracker"),
)
_MEASURE = Column(
    "measure",
    "str",
    "distances from the first pose (paper C); shape: all displacements, the frame's motion free; heights or positions in the base frame",
    allowed=("none", "distances", "shape", "heights", "positions"),
)
_DRIVES = ("dtheta1", "dtheta2", "dtheta3")
_POSE = (
    Column("pose", "int64", "number of the image, in the order driven"),
    Column(
        "plane",
        "str",
        "first: the paper's plane; second: the height that the variants on two planes add",
        allowed=("first", "second"),
    ),
    *xyz("command", "mm", "commanded position, calibration frame"),
)


def _per_drive(suffix, text):
    """A column of `delta_calibrations` for each drive; null before any calibration."""
    return tuple(Column(f"{name}_{suffix}_rad", NUMBER, f"{text} of drive {name[-1]}", True) for name in _DRIVES)


TABLES = (
    Table(
        "delta_truth",
        "delta/truth.parquet",
        "What only the virtual robot knows: optical centres in the target's frame.",
        (*_POSE, *xyz("true", "mm", "true optical centre, target frame")),
        ("pose",),
    ),
    Table(
        "delta_centres",
        "tables/delta_centres.parquet",
        "Optical centres as found in the images; dots are numbered from one of the first image, so that the origin is any dot of the target.",
        (
            *_POSE,
            *xyz("centre", "mm", "optical centre -R_j' T_j, target frame"),
            *xyz("one_rotation", "mm", "the same with one rotation for all images"),
            Column("dots", "int64", "dots found"),
            Column("reprojection_rms_px", NUMBER, "distance between dots found and dots of the fitted pose, RMS"),
        ),
        ("pose",),
    ),
    Table(
        "delta_dots",
        "tables/delta_dots.parquet",
        "Every dot found in every pose's image.",
        (
            Column("pose", "int64", "as in delta_centres"),
            Column("column", "int64", "number along the target's x, from a dot near the middle of the first image"),
            Column("row", "int64", "number along the target's y"),
            Column("x_px", NUMBER, "centre, from the middle of the first pixel to the right"),
            Column("y_px", NUMBER, "centre, downwards"),
        ),
        ("pose", "column", "row"),
    ),
    Table(
        "delta_picture",
        "tables/delta_picture.parquet",
        "The image of the first pose.",
        (
            Column("y_px", "int64", "pixel, downwards from 0"),
            Column("x_px", "int64", "pixel, to the right from 0"),
            Column("grey", "int64", "0 to 255"),
        ),
        ("y_px", "x_px"),
    ),
    Table(
        "delta_lens",
        "delta/lens.parquet",
        "The camera as calibrated from tilted views.",
        (
            Column("parameter", "str", "entry of the camera matrix (px), distortion, or RMS of the reprojection (px)"),
            Column("found", NUMBER, "as calibrated"),
        ),
        ("parameter",),
    ),
    Table(
        "delta_camera",
        "tables/delta_camera.parquet",
        "The camera as calibrated from tilted views, beside the true one.",
        (
            Column("parameter", "str", "as in delta_lens"),
            Column("found", NUMBER, "as calibrated"),
            Column("true", NUMBER, "of the virtual camera; null where there is none", True),
        ),
        ("parameter",),
    ),
    Table(
        "delta_poses",
        "tables/delta_poses.parquet",
        "Optical centres found in the images against the true ones; a shift common to all poses is left out, since the origin is any dot.",
        (
            *_POSE,
            *xyz("error", "mm", "found less true centre, less the mean over the poses"),
            *xyz("one_rotation_error", "mm", "the same with one rotation for all images"),
            Column("dots", "int64", "dots found"),
            Column("reprojection_rms_px", NUMBER, "as in delta_centres"),
        ),
        ("pose",),
    ),
    Table(
        "delta_calibrations",
        "tables/delta_calibrations.parquet",
        "Every way to find the zero errors, and the errors on the plane when they are fed back and the robot is driven again. The variant "
        "paper is the paper's single linear step with all distances alike; the others have converged and know that every distance carries "
        "the first pose's noise.",
        (
            _VARIANT,
            _SOURCE,
            _MEASURE,
            Column(
                "planes", "str", "one: z = 100; two: half of it and a second height", allowed=("none", "one", "two")
            ),
            Column("poses", "int64", "poses used"),
            Column("equations", NUMBER, "numbers that are fitted", True),
            Column("rank", NUMBER, "combinations of the three zero errors that they see", True),
            Column(
                "condition",
                NUMBER,
                "largest over smallest singular value of the Jacobian by the zero errors, rows brought to independent noise of one axis each "
                "(for the paper's step too, which itself counts all distances alike)",
                True,
            ),
            Column("residual_rms_mm", NUMBER, "RMS of what the fit leaves", True),
            Column(
                "noise_mm",
                NUMBER,
                "noise of one axis estimated from it, taken as alike along all axes (optical centres' is larger along the target than across); "
                "length errors count as noise here",
                True,
            ),
            *_per_drive("true", "true zero error"),
            *_per_drive("found", "zero error found"),
            *_per_drive("error", "found less true zero error"),
            *_per_drive(
                "standard_error",
                "standard error from noise_mm as if the lengths were exact, the first pose's noise in all distances counted: zero error",
            ),
            *_per_drive(
                "length_error",
                "1 sigma by which unknown length errors of all legs (`delta.length_error_mm`) move what is found, beside the standard error: "
                "zero error",
            ),
            *(
                Column(f"{frame}_{kind}_mm", NUMBER, f"{text} error on the plane, {where}")
                for frame, where in (
                    ("plane", "in the calibration frame, as published"),
                    ("base", "in the frame of the robot's base"),
                )
                for kind, text in (("mean", "mean"), ("max", "largest"))
            ),
        ),
        ("variant",),
    ),
    Table(
        "delta_observability",
        "tables/delta_observability.parquet",
        "Which combinations of the three zero errors a variant sees, best first, and what it mistakes for them.",
        (
            _VARIANT,
            Column("direction", "int64", "1: best seen"),
            *(Column(f"weight_{name}", NUMBER, f"share of {name} in the unit direction") for name in _DRIVES),
            Column("common_share", NUMBER, "squared part of the direction in which all drives move alike"),
            Column("kind", "str", "common: that part is more than half", allowed=("common", "differential")),
            Column(
                "singular_value",
                NUMBER,
                "mm of one axis's noise that the data change by per mm of arc at the end of the drive arm, see condition",
            ),
            Column("standard_error_rad", NUMBER, "of the combination, as in delta_calibrations"),
            Column(
                "per_length_rad_mm",
                NUMBER,
                "RMS error of the combination per mm (1 sigma) of unknown, independent length errors of all legs",
            ),
            Column(
                "per_scale_rad",
                NUMBER,
                "error of the combination when the target is 0.1 mm per m too large; null without a target",
                True,
            ),
        ),
        ("variant", "direction"),
    ),
    Table(
        "delta_robots",
        "tables/delta_robots.parquet",
        "The same calibrations on other robots, whose zero and length errors are drawn, with plates and noise as in delta_draws: mean error on "
        "the plane, over the robots.",
        (
            _VARIANT,
            Column("length_error_mm", NUMBER, "1 sigma of every leg's lengths"),
            Column("robots", "int64", "robots drawn"),
            *(
                Column(f"{frame}_{kind}_mm", NUMBER, f"{text} over the robots, {where}")
                for frame, where in (
                    ("plane", "in the calibration frame"),
                    ("base", "in the frame of the robot's base"),
                )
                for kind, text in (("median", "median"), ("high", "90th percentile"))
            ),
        ),
        ("variant", "length_error_mm"),
    ),
    Table(
        "delta_draws",
        "tables/delta_draws.parquet",
        "The same calibrations of the same robot with everything random drawn anew: dots of the plate, tilted views, noise of the dots' centres "
        "and of the tracker; dots are projected, not rendered. Percentiles over the draws.",
        (
            _VARIANT,
            Column("draws", "int64", "draws"),
            *(
                Column(f"{frame}_{kind}_{label}_mm", NUMBER, f"{share} of the {text} error on the plane, {where}")
                for frame, where in (
                    ("plane", "in the calibration frame"),
                    ("base", "in the frame of the robot's base"),
                )
                for kind, text in (("mean", "mean"), ("max", "largest"))
                for label, share in (("low", "5 %"), ("median", "median"), ("high", "95 %"))
            ),
        ),
        ("variant",),
    ),
    Table(
        "delta_points",
        "tables/delta_points.parquet",
        "Errors on the plane z = 0 as the tracker measures them, before (none) and after every variant is fed back.",
        (
            _VARIANT,
            Column("point", "int64", "number of the point"),
            *xyz("command", "mm", "commanded position, calibration frame"),
            *xyz("error", "mm", "error in the calibration frame, laid out by driving the robot along x and y"),
            *xyz("base_error", "mm", "error in the frame of the robot's base"),
            Column("error_mm", NUMBER, "size in the calibration frame"),
            Column("base_error_mm", NUMBER, "size in the base frame"),
        ),
        ("variant", "point"),
    ),
    Table(
        "delta_timings",
        "timings/delta/steps.parquet",
        "Wall time of one calibration from images on this machine.",
        (
            Column(
                "step",
                "str",
                "camera: from tilted views, once per camera; centres: from the poses' images; zero_errors: the paper's step",
            ),
            Column("images", "int64", "images read"),
            Column("seconds", NUMBER, "wall time"),
        ),
        ("step",),
    ),
)
