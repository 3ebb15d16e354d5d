"""Figures of the Delta's zero calibration by vision: images, errors on the plane, observability by variant."""

import numpy as np
import pandas as pd
from matplotlib.colors import Normalize
from matplotlib.lines import Line2D

from rrru.errors import ConfigError
from rrru.figures import style

_NAMES = {
    "none": "before",
    "paper": "distances, one step (paper)",
    "converged": "distances",
    "two_heights": "distances, two heights",
    "shape": "shape",
    "shape_two_heights": "shape, two heights",
    "one_rotation": "one rotation: distances",
    "one_rotation_two_heights": "one rotation: two heights",
    "one_rotation_shape": "one rotation: shape",
    "true_centres": "true centres: distances",
    "true_centres_two_heights": "true centres: two heights",
    "tracker_heights": "tracker: heights",
    "tracker_positions": "tracker: positions",
}
_COMMON = {"color": style.BLUE, "marker": "s", "linestyle": "none"}
_DIFFERENTIAL = {"color": style.VERMILION, "marker": "o", "markerfacecolor": "white", "linestyle": "none"}
_MEAN = {"color": style.BLUE, "marker": "s", "linestyle": "none"}
_MAX = {"color": style.BLACK, "marker": "|", "markersize": 6.0, "linestyle": "none"}
_DRAWS = {"color": style.BLUE, "alpha": 0.3, "linewidth": 4.5}
_RANGE = {"color": "#bbbbbb", "linewidth": 0.9}
_FOUND = {"color": style.ORANGE, "marker": "+", "markersize": 4.0, "linestyle": "none"}


@style.printed
def delta_images(tables, options):
    """Images of the Delta's camera (paper C, Figs. 3 and 6). (a) The image of the first pose with the centres of the
    detected dots. (b) Dots that are complete in any image, those of (a) in colour, and the optical centres with their
    errors, magnified as stated.
    """
    dots, poses = _rows(tables, "delta_dots", "delta_images"), _rows(tables, "delta_poses", "delta_images")
    figure = style.new(style.DOUBLE_MM, 80.0)
    image, plate = figure.subplots(1, 2, width_ratios=[1.0, 1.0])
    picture = tables["delta_picture"].pivot(index="y_px", columns="x_px", values="grey").to_numpy()
    first = dots[dots["pose"] == dots["pose"].min()]
    image.imshow(picture, cmap="gray", vmin=0, vmax=255, interpolation="none")
    image.plot(first["x_px"], first["y_px"], **_FOUND, label="dot found")
    image.set(xlabel="column (pixel)", ylabel="row (pixel)")
    image.set_title(f"(a) image of pose {first['pose'].iloc[0]}, {len(first)} dots")
    _plate(plate, dots, first, poses, tables["delta_centres"])
    style.legend_above(figure, [image, plate], columns=3)
    return figure


def _plate(axes, dots, first, poses, centres):
    """The dots that were seen, numbered in pitches, and the centres with magnified errors."""
    pitch, dot = _pitch(dots, centres), {"marker": ".", "linestyle": "none", "markersize": 1.6}
    seen = dots.drop_duplicates(["column", "row"])
    for rows, colour, where in ((seen, "#bbbbbb", "any image"), (first, style.ORANGE, "(a)")):
        axes.plot(pitch * rows["column"], pitch * rows["row"], color=colour, label=f"dot seen in {where}", **dot)
    place = centres[["centre_x_mm", "centre_y_mm"]].to_numpy()
    error = poses[["error_x_mm", "error_y_mm"]].to_numpy()
    factor = style.magnification(np.linalg.norm(error, axis=1), np.ptp(place, axis=0).max(), 0.12)
    arrows = {"angles": "xy", "scale_units": "xy", "scale": 1.0 / factor, "width": 0.004}
    for plane, colour, marker in (("first", style.BLUE, "o"), ("second", style.BLACK, "^")):
        rows = (centres["plane"] == plane).to_numpy()
        if rows.any():
            look = {"color": colour, "marker": marker, "markerfacecolor": "white", "linestyle": "none"}
            axes.plot(*place[rows].T, label=f"optical centre, {plane} height", **look)
            axes.quiver(*place[rows].T, *error[rows].T, color=colour, **arrows)
    axes.set(xlabel="x of the target (mm)", ylabel="y of the target (mm)", aspect="equal")
    axes.set_title(f"(b) target; errors magnified {factor:g} times")


def _pitch(dots, centres):
    """Pitch of the dots in mm: the optical centre's longest way over that of the middle of the seen dots."""
    middle = dots.groupby("pose")[["column", "row"]].mean().to_numpy()
    place = centres.sort_values("pose")[["centre_x_mm", "centre_y_mm"]].to_numpy()
    way = np.linalg.norm(place - place[0], axis=1)
    far = way.argmax()
    return float(np.rint(way[far] / np.linalg.norm(middle[far] - middle[0])))


@style.printed
def delta_errors(tables, options):
    """Errors on the plane before and after the paper's calibration (paper C, Figs. 7 and 8): colour is the size of
    the error in the calibration frame, arrows its part in the plane, magnified as stated. Below, mean and largest
    error of every variant, and the range of the mean over draws of plate, views and noise, (c) in the
    calibration frame, (d) in the frame of the robot's base.
    """
    names = ("delta_points", "delta_calibrations", "delta_draws")
    points, calibrations, draws = (_rows(tables, name, "delta_errors") for name in names)
    draws = draws.set_index("variant").reindex(calibrations["variant"])
    figure = style.new(style.DOUBLE_MM, 92.0 + 4.6 * len(calibrations))
    grid = figure.add_gridspec(2, 1, height_ratios=[78.0, 10.0 + 4.6 * len(calibrations)])
    upper, lower = grid[0].subgridspec(1, 2), grid[1].subgridspec(1, 2)
    for place, (variant, title) in enumerate((("none", "before"), ("paper", "after the paper's calibration"))):
        rows = points[points["variant"] == variant]
        if rows.empty:
            raise ConfigError(f"delta_errors: table delta_points has no variant {variant!r}")
        _map(figure.add_subplot(upper[place]), rows, f"({'ab'[place]}) {title}")
    left = figure.add_subplot(lower[0])
    right = figure.add_subplot(lower[1], sharey=left)
    _sizes(left, calibrations, draws, "plane", "(c) calibration frame")
    _sizes(right, calibrations, draws, "base", "(d) frame of the base")
    right.tick_params(labelleft=False)
    left.legend(loc="lower left", bbox_to_anchor=(0.0, 1.06), ncols=3, borderaxespad=0.2)
    return figure


def _map(axes, rows, title):
    """Size of the error as colour, its part in the plane as arrows; mean and largest in the title."""
    x, y, size = (rows[column].to_numpy() for column in ("command_x_mm", "command_y_mm", "error_mm"))
    flat = rows[["error_x_mm", "error_y_mm"]].to_numpy()
    factor = style.magnification(np.linalg.norm(flat, axis=1), np.ptp(x), 0.12)
    colour = {"c": size, "cmap": style.SEQUENTIAL, "norm": Normalize(0.0, size.max())}
    marks = axes.scatter(x, y, s=46.0, marker="s", linewidths=0.0, **colour)
    axes.quiver(x, y, *flat.T, angles="xy", scale_units="xy", scale=1.0 / factor, width=0.003, color="black")
    limits = x.min() - 0.08 * np.ptp(x), x.max() + 0.08 * np.ptp(x)
    axes.set(xlim=limits, ylim=limits, aspect="equal", xlabel="x (mm)", ylabel="y (mm)")
    axes.set_title(f"{title}\nmean {size.mean():.3f} mm, largest {size.max():.3f} mm")
    bar = axes.figure.colorbar(marks, ax=axes, location="bottom", aspect=40, fraction=0.05)
    bar.set_label(f"error (mm); arrows magnified {factor:g} times")


def _sizes(axes, calibrations, draws, frame, title):
    """Mean and largest error of every variant in a frame, and the mean's range over draws."""
    mean, largest = (calibrations[f"{frame}_{of}_mm"] for of in ("mean", "max"))
    rows = np.arange(len(calibrations))
    low, high = (draws[f"{frame}_mean_{side}_mm"].to_numpy() for side in ("low", "high"))
    axes.hlines(rows, low, high, **_DRAWS, label=f"mean in {draws['draws'].max():g} draws, 5 to 95 %")
    axes.hlines(rows, mean, largest, **_RANGE)
    axes.plot(mean, rows, **_MEAN, label="mean")
    axes.plot(largest, rows, **_MAX, label="largest")
    axes.set(xlim=(0.0, 1.08 * max(largest.max(), np.nanmax(high))), xlabel="error on the plane (mm)")
    _name_rows(axes, calibrations["variant"], title)
    axes.set_ylabel("variant" if frame == "plane" else "")


def _name_rows(axes, variants, title):
    """A row per variant, the first one on top."""
    axes.set_yticks(range(len(variants)), [_NAMES.get(name, name) for name in variants])
    axes.set(ylim=(len(variants) - 0.5, -0.5))
    axes.tick_params(axis="y", length=0.0)
    axes.set_title(title)
    axes.grid(True, axis="x")


@style.printed
def delta_observability(tables, options):
    """Observability of the three zero errors by variant: equal errors of all drives (common) and their differences
    (differential). (a) Singular value. (b) Standard error. (c) Error per unknown length error of 1 mm.
    """
    rows = _rows(tables, "delta_observability", "delta_observability")
    place, names = pd.factorize(rows["variant"])
    figure = style.new(style.DOUBLE_MM, 24.0 + 5.4 * len(names))
    panels = figure.subplots(1, 3, sharey=True)
    columns = {
        "singular_value": ("(a) observability", "singular value (mm/mm)", 1.0),
        "standard_error_rad": ("(b) uncertainty", "standard error (mrad)", 1e3),
        "per_length_rad_mm": ("(c) length errors", "error per length (mrad/mm)", 1e3),
    }
    kinds = {"all drives alike (common)": ("common", _COMMON), "differential": ("differential", _DIFFERENTIAL)}
    for axes, (column, (title, label, factor)) in zip(panels, columns.items(), strict=True):
        values = factor * rows[column]
        low, high = (values.groupby(place).agg(of) for of in ("min", "max"))
        axes.hlines(low.index, low, high, **_RANGE)
        for kind, look in kinds.values():
            axes.plot(values[rows["kind"] == kind], place[rows["kind"] == kind], **look)
        axes.set(xlabel=label)
        if column == "per_length_rad_mm":
            axes.set_xlim(left=0.0)
        else:
            axes.set_xscale("log")
            style.plain_log(axes.xaxis)
        _name_rows(axes, names, title)
    panels[0].set_ylabel("variant")
    handles = [Line2D([], [], **look, label=label) for label, (_, look) in kinds.items()]
    figure.legend(handles=handles, loc="outside upper center", ncols=2)
    return figure


def _rows(tables, name, figure):
    """A table; raises ConfigError where it is empty."""
    if tables[name].empty:
        raise ConfigError(f"{figure}: table {name} is empty")
    return tables[name]
