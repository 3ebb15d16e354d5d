"""Result tables of a made-up Delta study, small but shaped as real ones, for drawing figures without computing
anything.
"""

import numpy as np
import pandas as pd

from tests.schemas import check, filled

VARIANTS = ("none", "paper", "converged", "shape", "tracker_positions", "of_my_own")


def _poses():
    """Columns that the tables of the poses share, the second height with two poses."""
    x, y = (axis.ravel() for axis in np.meshgrid([-100.0, 0.0, 100.0], [-50.0, 50.0]))
    place = pd.DataFrame({"command_x_mm": np.append(x, x[:2]), "command_y_mm": np.append(y, y[:2])})
    number = np.arange(1, len(place) + 1)
    return place.assign(pose=number, plane=np.where(number > 6, "second", "first"), command_z_mm=100.0)


def image_tables():
    """The tables that the figure of the images reads."""
    poses = _poses()
    column, row = (axis.ravel() for axis in np.meshgrid(np.arange(-4, 5), np.arange(-3, 4)))
    dots = [
        pd.DataFrame(
            {
                "pose": p,
                "column": column + round(x / 10.0),
                "row": row + round(y / 10.0),
                "x_px": 60.0 + 12.0 * column,
                "y_px": 45.0 - 12.0 * row,
            }
        )
        for p, x, y in poses[["pose", "command_x_mm", "command_y_mm"]].itertuples(index=False)
    ]
    centres = {
        f"{name}_{axis}_mm": poses[f"command_{axis}_mm"] for name in ("centre", "one_rotation") for axis in "xyz"
    }
    errors = {
        f"{name}_{axis}_mm": 0.02 * np.sin(poses["pose"]) for name in ("error", "one_rotation_error") for axis in "xyz"
    }
    y, x = (axis.ravel() for axis in np.indices((90, 120)))
    return {
        "delta_dots": check("delta_dots", pd.concat(dots, ignore_index=True)),
        "delta_centres": check("delta_centres", poses.assign(**centres, dots=63, reprojection_rms_px=0.02)),
        "delta_poses": check("delta_poses", poses.assign(**errors, dots=63, reprojection_rms_px=0.02)),
        "delta_picture": check(
            "delta_picture", pd.DataFrame({"y_px": y, "x_px": x, "grey": np.where((x // 6 + y // 6) % 2, 210, 40)})
        ),
    }


def points():
    """`delta_points` of every variant on a small grid."""
    generator = np.random.default_rng(2)
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-200.0, 201.0, 100.0), np.arange(-200.0, 201.0, 100.0)))
    frames = []
    for variant in VARIANTS:
        vectors = {
            name: (1.0 if variant == "none" else 0.2) * generator.normal(0.4, 0.3, (len(x), 3))
            for name in ("error", "base_error")
        }
        frames.append(
            pd.DataFrame(
                {
                    "variant": variant,
                    "point": np.arange(1, len(x) + 1),
                    **{f"command_{axis}_mm": values for axis, values in zip("xyz", (x, y, 0.0 * x), strict=True)},
                    **{
                        f"{name}_{axis}_mm": vector[:, k]
                        for name, vector in vectors.items()
                        for k, axis in enumerate("xyz")
                    },
                    **{f"{name}_mm": np.linalg.norm(vector, axis=1) for name, vector in vectors.items()},
                }
            )
        )
    return check("delta_points", pd.concat(frames, ignore_index=True))


def calibrations(point_rows):
    """`delta_calibrations` that fit the points."""
    sizes = point_rows.groupby("variant", sort=False)[["error_mm", "base_error_mm"]].agg(["mean", "max"])
    rows = [
        {"variant": name, "source": "none", "measure": "none", "planes": "none"}
        | {
            f"{frame}_{kind}_mm": row[column, kind]
            for frame, column in (("plane", "error_mm"), ("base", "base_error_mm"))
            for kind in ("mean", "max")
        }
        for name, row in sizes.iterrows()
    ]
    return filled("delta_calibrations", rows)


def draws(rows):
    """`delta_draws` about the calibrations."""
    sides = {"low": 0.8, "median": 1.0, "high": 1.3}
    sizes = [f"{frame}_{kind}" for frame in ("plane", "base") for kind in ("mean", "max")]
    columns = {f"{size}_{side}_mm": factor * rows[f"{size}_mm"] for size in sizes for side, factor in sides.items()}
    return check("delta_draws", rows[["variant"]].assign(draws=20, **columns))


def observability():
    """`delta_observability` of every variant but `none`."""
    rows = [
        {
            "variant": name,
            "direction": k + 1,
            "common_share": 0.99 if k == 0 else 0.005,
            "kind": "common" if k == 0 else "differential",
            "singular_value": 0.8 / 4.0**k,
            "standard_error_rad": 2e-4 * 4.0**k,
        }
        for name in VARIANTS[1:]
        for k in range(3)
    ]
    return filled("delta_observability", rows)


def delta_tables():
    """Every table that the figures of the Delta's study read."""
    point_rows = points()
    rows = calibrations(point_rows)
    own = {
        "delta_points": point_rows,
        "delta_calibrations": rows,
        "delta_draws": draws(rows),
        "delta_observability": observability(),
    }
    return image_tables() | own
