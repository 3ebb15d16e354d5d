"""Figures 9, 10 and 12 of paper A: the straight lines before and after calibration."""

import numpy as np
from matplotlib.ticker import MaxNLocator

from rrru.figures import choose, style

LINE_PATTERN = "line_*"
# paper A, 3: the error that the task allows
TOLERANCE_MM = 2.0


@style.printed
def fig09(tables, options):
    """Group 1 before and after the line calibration (paper A, Fig. 9). (a) Commanded and attained points in the
    vertical plane, deviations magnified as stated. (b) Size of the error at every point. Grey: points near a
    constraint singularity. Where a trajectory was passed more than once, curves are means over the passes, bands
    their range.
    """
    paths, calibration = tables["measurements"], options["calibration_lines"]
    name = choose.trajectories(paths, LINE_PATTERN, "fig09")[0]
    places = choose.stations(paths, name)
    after, mode = choose.after(tables, options, calibration, "fig09")
    curves = [
        ("before calibration", style.BEFORE, choose.before(tables, options, "fig09")),
        (choose.after_label(calibration, mode), style.LINES, after),
    ]
    figure = style.new(style.DOUBLE_MM, 105.0)
    plane, sizes = figure.subplots(2, 1, height_ratios=[0.8, 1.0])
    _plane(plane, places, curves)
    plane.set_title(f"(a) {choose.trajectory_label(name)}: {plane.get_title(loc='left')}")
    for label, look, errors in curves:
        draw_along(sizes, errors, places, look, label)
    tolerance(sizes)
    shade_near_singular(sizes, places)
    sizes.set(xlabel="point", ylabel="position error (mm)", ylim=(0.0, None))
    sizes.set_title(f"(b) size of the error{pass_note(places)}")
    finish(sizes, places)
    style.legend_above(figure, [plane, sizes])
    return figure


@style.printed
def fig10(tables, options):
    """Every line before and after the line calibration (paper A, Fig. 10). (a) The lines in the middle, (b) the
    outer ones. The numbers are the smallest and largest error. Grey: points near a constraint singularity. Where a
    trajectory was passed more than once, curves are means over the passes, bands their range.
    """
    calibration = options["calibration_lines"]
    after, mode = choose.after(tables, options, calibration, "fig10")
    curves = [
        ("before calibration", style.BEFORE, choose.before(tables, options, "fig10")),
        (choose.after_label(calibration, mode), style.LINES, after),
    ]
    names = choose.trajectories(tables["measurements"], LINE_PATTERN, "fig10")
    inner, outer = names[:3], names[3:]
    columns = 4
    rows = 1 + -(-len(outer) // columns)
    figure = style.new(style.DOUBLE_MM, 46.0 * rows)
    grid = figure.subplots(rows, columns, sharey=True, squeeze=False)
    cells = [*zip(inner, grid[0], strict=False), *zip(outer, grid[1:].ravel(), strict=False)]
    marks = {inner[0]: "(a) ", **({outer[0]: "(b) "} if outer else {})}
    _error_panels(tables, cells, curves, ("before", "after"), marks)
    for axes in set(grid.ravel()) - {axes for _, axes in cells}:
        axes.set_axis_off()
    for _, axes in cells:
        tolerance(axes)
    _outer_labels(grid, cells, "position error (mm)")
    # the upper row always has an empty place at its end
    style.legend_inside(grid[0, -1], [axes for _, axes in cells])
    return figure


@style.printed
def fig12(tables, options):
    """The lines but the first under the line and the spiral calibration (paper A, Fig. 12). The numbers are the
    smallest and largest error. Grey: points near a constraint singularity. Where a trajectory was passed more than
    once, curves are means over the passes, bands their range.
    """
    curves = []
    for calibration, look in (
        (options["calibration_lines"], style.LINES),
        (options["calibration_spiral"], style.SPIRAL),
    ):
        errors, mode = choose.after(tables, options, calibration, "fig12")
        curves.append((choose.after_label(calibration, mode), look, errors))
    names = choose.trajectories(tables["measurements"], LINE_PATTERN, "fig12")
    names = names[1:] or names
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    figure = style.new(style.DOUBLE_MM, 12.0 + 46.0 * rows)
    grid = figure.subplots(rows, columns, sharey=True, squeeze=False)
    cells = list(zip(names, grid.ravel(), strict=False))
    _error_panels(tables, cells, curves, (options["calibration_lines"], options["calibration_spiral"]), {})
    for axes in grid.ravel()[len(names) :]:
        axes.set_axis_off()
    _outer_labels(grid, cells, "position error (mm)")
    style.legend_above(figure, [axes for _, axes in cells])
    return figure


def _plane(axes, places, curves):
    """Commanded points and measured ones with magnified deviations, in the vertical plane along the line."""
    ground = places.drop_duplicates("station").set_index("station").sort_index()
    along = max("xy", key=lambda axis: np.ptp(ground[f"{axis}_mm"]))
    columns = [f"error_{along}_mm", "error_z_mm"]
    means = [choose.along(errors, places, columns)[0] for _, _, errors in curves]
    span = max(np.ptp(ground[f"{along}_mm"]), np.ptp(ground["z_mm"]))
    factor = style.magnification(np.concatenate([mean.to_numpy().ravel() for mean in means]), span)
    axes.plot(ground[f"{along}_mm"], ground["z_mm"], label="commanded", **style.COMMANDED)
    for (label, look, _), mean in zip(curves, means, strict=True):
        x = ground[f"{along}_mm"] + factor * mean[columns[0]]
        z = ground["z_mm"] + factor * mean["error_z_mm"]
        # hairlines tie every point to its command
        axes.plot([ground[f"{along}_mm"], x], [ground["z_mm"], z], color=look["color"], linewidth=0.35, zorder=1)
        axes.plot(x, z, label=label, **look)
    axes.set(xlabel=f"{along} (mm)", ylabel="z (mm), down", aspect="equal", adjustable="datalim")
    axes.invert_yaxis()
    axes.set_title(f"points, deviations magnified {factor:g} times")
    axes.grid(True)


def _error_panels(tables, cells, curves, tags, marks):
    """One panel per line with its curves and, in numbers behind their tags, their ranges."""
    for name, axes in cells:
        places = choose.stations(tables["measurements"], name)
        ranges = [draw_along(axes, errors, places, look, label) for label, look, errors in curves]
        shade_near_singular(axes, places)
        axes.set_title(f"{marks.get(name, '')}{choose.trajectory_label(name)}{pass_note(places)}")
        finish(axes, places)
        for row, (tag, (_, look, _), (low, high)) in enumerate(zip(tags, curves, ranges, strict=True)):
            text = f"{choose.trajectory_label(tag)} {style.number(low)} to {style.number(high)} mm"
            place = {"transform": axes.transAxes, "ha": "right", "va": "top", "in_layout": False}
            axes.text(0.97, 0.97 - 0.11 * row, text, fontsize=7.0, color=_dark(look["color"]), **place)
    # room for the numbers above the highest curve
    top = max((axes.dataLim.y1 for _, axes in cells if np.isfinite(axes.dataLim.y1)), default=1.0)
    cells[0][1].set_ylim(0.0, 1.45 * top)


def _outer_labels(grid, cells, label):
    """Labels at the left and below the lowest used panel of each column."""
    used = {axes for _, axes in cells}
    for row in grid:
        row[0].set_ylabel(label)
    for column in grid.T:
        lowest = [axes for axes in column if axes in used]
        if lowest:
            lowest[-1].set_xlabel("point")


def draw_along(axes, errors, places, look, label, column="error_mm"):
    """Draw an error along a path: its mean over the passes and, where there are several, their range. Returns lowest
    and highest value.
    """
    mean, low, high = choose.along(errors, places, (column,))
    axes.plot(mean.index, mean[column], label=label, **look)
    if choose.passes(places) > 1:
        band = {"color": look["color"], "alpha": 0.18, "linewidth": 0.0}
        axes.fill_between(mean.index, low[column], high[column], label="range over the passes", **band)
    return low[column].min(), high[column].max()


def shade_near_singular(axes, places):
    """Shade the stations near a constraint singularity, where the platform can turn."""
    near = np.unique(places.loc[places["status"] == "near_singularity", "station"])
    label = "near a singularity"
    for stretch in np.split(near, np.flatnonzero(np.diff(near) > 1) + 1) if near.size else []:
        axes.axvspan(stretch[0] - 0.5, stretch[-1] + 0.5, facecolor="#eeeeee", edgecolor="none", zorder=0, label=label)
        label = None


def tolerance(axes, signs=(1.0,)):
    """Mark the error that the task allows."""
    label = f"tolerance, {TOLERANCE_MM:g} mm"
    for sign in signs:
        axes.axhline(sign * TOLERANCE_MM, label=label, **style.TOLERANCE)
        label = None


def pass_note(places):
    """Number of passes where there is more than one: curves are then means."""
    count = choose.passes(places)
    return f", {count} passes" if count > 1 else ""


def finish(axes, places):
    """Whole points on the axis, half a point of room at both ends, a grid."""
    axes.set_xlim(0.5, places["station"].max() + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    axes.grid(True)


def _dark(color):
    """The colour of a number: orange is too light for text."""
    return "#8a5f00" if color == style.ORANGE else color
