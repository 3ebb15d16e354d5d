"""Figures 9, 10 and 12 of paper A: the straight lines before and after calibration."""

import numpy as np

from rrru.figures import choose, style
from rrru.studies.rrru3.figures import panels

_PATTERN = "line_*"


@style.printed
def fig09(tables, options):
    """Group 1 before and after the line calibration (paper A, Fig. 9). (a) Commanded and attained points in the
    vertical plane, deviations magnified as stated. (b) Size of the error at every point. Light bands: the middle 90 %
    of other draws. Grey: points near a constraint singularity. Where a trajectory was passed more than once, curves are
    means over the passes, darker bands their range.
    """
    name = choose.trajectories(tables["measurements"], _PATTERN, "fig09")[0]
    places = choose.stations(tables["measurements"], name)
    curves = panels.before_and_after(tables, options, "fig09")
    figure = style.new(style.DOUBLE_MM, 105.0)
    plane, sizes = figure.subplots(2, 1, height_ratios=[0.8, 1.0])
    factor = _plane(plane, places, curves)
    plane.set_title(f"(a) {choose.trajectory_label(name)}: points, deviations magnified {factor:g} times")
    for curve in curves:
        panels.draw_along(sizes, curve, places)
    panels.tolerance(sizes)
    panels.shade_near_singular(sizes, places)
    sizes.set(xlabel="point", ylabel="position error (mm)", ylim=(0.0, None))
    sizes.set_title(f"(b) size of the error{panels.pass_note(places)}")
    panels.finish(sizes, places)
    style.legend_above(figure, [plane, sizes])
    return figure


@style.printed
def fig10(tables, options):
    """Every line before and after the line calibration (paper A, Fig. 10). (a) The lines in the middle, (b) the
    outer ones. The numbers are the smallest and largest error. Light bands: the middle 90 % of other draws. Grey:
    points near a constraint singularity. Where a trajectory was passed more than once, curves are means over the
    passes, darker bands their range.
    """
    curves = panels.before_and_after(tables, options, "fig10")
    names = choose.trajectories(tables["measurements"], _PATTERN, "fig10")
    inner, outer = names[:3], names[3:]
    columns = 4
    rows = 1 + -(-len(outer) // columns)
    figure = style.new(style.DOUBLE_MM, 46.0 * rows)
    grid = figure.subplots(rows, columns, sharey=True, squeeze=False)
    cells = {**dict(zip(inner, grid[0], strict=False)), **dict(zip(outer, grid[1:].ravel(), strict=False))}
    marks = {inner[0]: "(a) ", **({outer[0]: "(b) "} if outer else {})}
    _error_panels(tables["measurements"], cells, curves, ("before", "after"), marks)
    for axes in cells.values():
        panels.tolerance(axes)
    _outer_labels(grid, cells)
    # the upper row always has an empty place at its end
    style.legend_inside(grid[0, -1], cells.values())
    return figure


@style.printed
def fig12(tables, options):
    """The lines except the first after the line and the spiral calibration (paper A, Fig. 12). The numbers are the
    smallest and largest error. Light bands: the middle 90 % of other draws. Grey: points near a constraint
    singularity. Where a trajectory was passed more than once, curves are means over the passes, darker bands their
    range.
    """
    curves = panels.both_calibrations(tables, options, "fig12")
    names = choose.trajectories(tables["measurements"], _PATTERN, "fig12")
    names = names[1:] or names
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    figure = style.new(style.DOUBLE_MM, 12.0 + 46.0 * rows)
    grid = figure.subplots(rows, columns, sharey=True, squeeze=False)
    cells = dict(zip(names, grid.ravel(), strict=False))
    tags = (options["calibration_lines"], options["calibration_spiral"])
    _error_panels(tables["measurements"], cells, curves, tags, {})
    _outer_labels(grid, cells)
    style.legend_above(figure, cells.values())
    return figure


def _plane(axes, places, curves):
    """Commanded points and measured ones in the vertical plane along the line; how much deviations are magnified."""
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
    axes.grid(True)
    return factor


def _error_panels(paths, cells, curves, tags, marks):
    """One panel per line with its curves and, in numbers behind their tags, their ranges."""
    for name, axes in cells.items():
        places = choose.stations(paths, name)
        ranges = [panels.draw_along(axes, curve, places) for curve in curves]
        panels.shade_near_singular(axes, places)
        axes.set_title(f"{marks.get(name, '')}{choose.trajectory_label(name)}{panels.pass_note(places)}")
        panels.finish(axes, places)
        for row, (tag, (_, look, _), (low, high)) in enumerate(zip(tags, curves, ranges, strict=True)):
            text = f"{choose.trajectory_label(tag)} {style.number(low)} to {style.number(high)} mm"
            place = {"transform": axes.transAxes, "ha": "right", "va": "top", "in_layout": False}
            axes.text(0.97, 0.97 - 0.11 * row, text, fontsize=7.0, color=_dark(look["color"]), **place)
    # space for the numbers above the highest curve
    top = max((axes.dataLim.y1 for axes in cells.values() if np.isfinite(axes.dataLim.y1)), default=1.0)
    next(iter(cells.values())).set_ylim(0.0, 1.45 * top)


def _outer_labels(grid, cells):
    """Labels at the left and below the lowest used panel of each column; unused panels vanish."""
    used = set(cells.values())
    for axes in set(grid.ravel()) - used:
        axes.set_axis_off()
    for row in grid:
        row[0].set_ylabel("position error (mm)")
    for column in grid.T:
        lowest = [axes for axes in column if axes in used]
        if lowest:
            lowest[-1].set_xlabel("point")


def _dark(color):
    """The colour of a number: orange is too light for text."""
    return "#8a5f00" if color == style.ORANGE else color
