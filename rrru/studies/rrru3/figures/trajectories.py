"""Figures 9 to 12 of paper A: errors along the straight lines and along the spiral, before and after calibration."""

import numpy as np
from matplotlib.ticker import MaxNLocator

from rrru.figures import choose, style

_PATTERN = "line_*"
_AXES = "xyz"
_COLUMNS = [f"error_{axis}_mm" for axis in _AXES]
# paper A, 3: the error that the task allows
TOLERANCE_MM = 2.0
_BAND_ALPHA, _BAND_LABEL = 0.15, "90 % of other draws"
# kinds of `redraw_errors` by the option that names the calibration
_BANDS = {"calibration_lines": "line", "calibration_spiral": "spiral"}


@style.printed
def fig09(tables, options):
    """Group 1 before and after the line calibration (paper A, Fig. 9). (a) Commanded and attained points in the
    vertical plane, deviations magnified as stated. (b) Size of the error at every point. Light bands: the middle 90 %
    of other draws. Grey: points near a constraint singularity. Where a trajectory was passed more than once, curves are
    means over the passes, darker bands their range.
    """
    name = choose.trajectories(tables["measurements"], _PATTERN, "fig09")[0]
    places = choose.stations(tables["measurements"], name)
    curves = _before_and_after(tables, options, "fig09")
    figure = style.new(style.DOUBLE_MM, 105.0)
    plane, sizes = figure.subplots(2, 1, height_ratios=[0.8, 1.0])
    factor = _plane(plane, places, curves)
    plane.set_title(f"(a) {choose.trajectory_label(name)}: points, deviations magnified {factor:g} times")
    for curve in curves:
        _draw_along(sizes, curve, places)
    _mark_tolerance(sizes)
    _shade_near_singular(sizes, places)
    sizes.set(xlabel="point", ylabel="position error (mm)", ylim=(0.0, None))
    sizes.set_title(f"(b) size of the error{_pass_note(places)}")
    _finish_axis(sizes, places)
    style.legend_above(figure, [plane, sizes])
    return figure


@style.printed
def fig10(tables, options):
    """Every line before and after the line calibration (paper A, Fig. 10). (a) The lines in the middle, (b) the
    outer ones. The numbers are the smallest and largest error. Light bands: the middle 90 % of other draws. Grey:
    points near a constraint singularity. Where a trajectory was passed more than once, curves are means over the
    passes, darker bands their range.
    """
    curves = _before_and_after(tables, options, "fig10")
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
        _mark_tolerance(axes)
    _outer_labels(grid, cells)
    # the upper row always has an empty place at its end
    style.legend_inside(grid[0, -1], cells.values())
    return figure


@style.printed
def fig11(tables, options):
    """The spiral after both calibrations (paper A, Fig. 11). (a) Commanded and attained path, deviations magnified
    as stated. (b) to (d) Errors along the axes, with the tolerance of the task. Light bands: the middle 90 % of other
    draws. Grey: points near a constraint singularity. Where a trajectory was passed more than once, curves are means
    over the passes, darker bands their range.
    """
    name = choose.trajectories(tables["measurements"], "*spiral*", "fig11")[0]
    places = choose.stations(tables["measurements"], name)
    curves = _both_calibrations(tables, options, "fig11")
    figure = style.new(style.DOUBLE_MM, 100.0)
    # the layout engine does not arrange a 3-D panel: it has a fixed place at the left
    figure.get_layout_engine().set(rect=(0.5, 0.0, 0.5, 1.0))
    path = figure.add_axes((0.0, 0.0, 0.47, 0.9), projection="3d")
    grid = figure.add_gridspec(3, 1)
    _path(path, places, [("before calibration", style.BEFORE, choose.before(tables, options, "fig11")), *curves])
    first = None
    tags = [choose.trajectory_label(options[key]) for key in ("calibration_lines", "calibration_spiral")]
    for row, axis in enumerate(_AXES):
        axes = first = figure.add_subplot(grid[row], sharex=first, sharey=first)
        _component(axes, places, curves, tags, axis)
        axes.set_title(f"({'bcd'[row]}) {axis}{_pass_note(places)}")
        axes.tick_params(labelbottom=row == len(_AXES) - 1)
    axes.set_xlabel("point")
    style.legend_above(figure, figure.axes)
    return figure


@style.printed
def fig12(tables, options):
    """The lines except the first after the line and the spiral calibration (paper A, Fig. 12). The numbers are the
    smallest and largest error. Light bands: the middle 90 % of other draws. Grey: points near a constraint
    singularity. Where a trajectory was passed more than once, curves are means over the passes, darker bands their
    range.
    """
    curves = _both_calibrations(tables, options, "fig12")
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
        ranges = [_draw_along(axes, curve, places) for curve in curves]
        _shade_near_singular(axes, places)
        axes.set_title(f"{marks.get(name, '')}{choose.trajectory_label(name)}{_pass_note(places)}")
        _finish_axis(axes, places)
        for row, (tag, (_, look, _), (low, high)) in enumerate(zip(tags, curves, ranges, strict=True)):
            text = f"{choose.trajectory_label(tag)} {style.number(low)} to {style.number(high)} mm"
            place = {"transform": axes.transAxes, "ha": "right", "va": "top", "in_layout": False}
            # orange is too light for text
            color = "#8a5f00" if look["color"] == style.ORANGE else look["color"]
            axes.text(0.97, 0.97 - 0.11 * row, text, fontsize=7.0, color=color, **place)
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


def _path(axes, places, curves):
    """Commanded path in space and the attained ones with magnified deviations; z points down."""
    ground = places.drop_duplicates("station").set_index("station").sort_index()
    command = ground[[f"{axis}_mm" for axis in _AXES]].to_numpy()
    deviations = [choose.along(errors, places, _COLUMNS)[0].to_numpy() for _, _, errors in curves]
    factor = style.magnification(np.concatenate(deviations).ravel(), np.ptp(command, axis=0).max())
    axes.plot(*command.T, label="commanded", **style.COMMANDED)
    attained = [command + factor * deviation for deviation in deviations]
    for (label, look, _), points in zip(curves, attained, strict=True):
        axes.plot(*points.T, label=label, **look)
    everything = np.concatenate([command, *attained])
    low, high = np.nanmin(everything, axis=0), np.nanmax(everything, axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(high[2], low[2]))
    axes.set_box_aspect(np.maximum(high - low, 1.0), zoom=0.83)
    axes.view_init(elev=35.0, azim=-60.0)
    axes.set(xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm), down")
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4))
        axis.set_pane_color("white")
        axis.set_tick_params(pad=-1.0)
        axis.labelpad = -1.0
    axes.zaxis.set_rotate_label(False)
    axes.zaxis.label.set_rotation(90.0)
    axes.zaxis.labelpad = 1.0
    axes.text2D(0.06, 0.97, f"(a) path, deviations magnified {factor:g} times", transform=axes.transAxes)


def _component(axes, places, curves, tags, axis):
    """Error along one axis after each calibration, the ranges as numbers above the panel."""
    ranges = [_draw_along(axes, curve, places, f"error_{axis}_mm") for curve in curves]
    texts = [
        f"{tag} {style.number(low)} to {style.number(high)}" for tag, (low, high) in zip(tags, ranges, strict=True)
    ]
    axes.set_title("; ".join(texts) + " mm", loc="right", fontsize=7.0)
    axes.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=0)
    _mark_tolerance(axes, (1.0, -1.0))
    _shade_near_singular(axes, places)
    axes.set_ylabel(f"{axis} error (mm)")
    _finish_axis(axes, places)


def _curve(tables, options, key, look, name):
    """Label, look and rows of `errors` of the errors after a calibration."""
    errors, mode = choose.after(tables, options, options[key], name)
    if mode == "closed_loop":
        errors = _with_band(errors, tables, _BANDS[key])
    return choose.after_label(options[key], mode), look, errors


def _with_band(errors, tables, kind):
    """Rows of `errors` with the range over other draws of a kind of `redraw_errors`, where there is one."""
    bands = tables["redraw_errors"]
    bands = bands[bands["calibration"] == kind].drop(columns="calibration")
    return errors if bands.empty else errors.merge(bands, on=["run", "trajectory", "point"], how="left")


def _before_and_after(tables, options, name):
    """Curves (label, look, rows of `errors`) before and after the line calibration, for a figure of that name."""
    before = ("before calibration", style.BEFORE, _with_band(choose.before(tables, options, name), tables, "none"))
    return [before, _curve(tables, options, "calibration_lines", style.LINES, name)]


def _both_calibrations(tables, options, name):
    """Curves (label, look, rows of `errors`) after the line calibration and after the spiral's."""
    looks = {"calibration_lines": style.LINES, "calibration_spiral": style.SPIRAL}
    return [_curve(tables, options, key, look, name) for key, look in looks.items()]


def _draw_along(axes, curve, places, column="error_mm"):
    """Draw a curve along a path, its mean over the passes and their range; returns lowest and highest value.

    Behind a curve with a range over other draws this range is a lighter band.
    """
    label, look, errors = curve
    mean, low, high = choose.along(errors, places, (column,))
    axes.plot(mean.index, mean[column], label=label, **look)
    if f"{column}_low" in errors:
        _, bottom, top = choose.along(errors, places, (f"{column}_low", f"{column}_high"))
        band = {"color": look["color"], "alpha": _BAND_ALPHA, "linewidth": 0.0, "zorder": 0.5}
        axes.fill_between(mean.index, bottom[f"{column}_low"], top[f"{column}_high"], label=_BAND_LABEL, **band)
    if choose.passes(places) > 1:
        band = {"color": look["color"], "alpha": 0.18, "linewidth": 0.0}
        axes.fill_between(mean.index, low[column], high[column], label="range over the passes", **band)
    return low[column].min(), high[column].max()


def _shade_near_singular(axes, places):
    """Shade the stations near a constraint singularity, where the platform can rotate."""
    near = np.unique(places.loc[places["status"] == "near_singularity", "station"])
    label = "near a singularity"
    for stretch in np.split(near, np.flatnonzero(np.diff(near) > 1) + 1) if near.size else []:
        axes.axvspan(stretch[0] - 0.5, stretch[-1] + 0.5, facecolor="#eeeeee", edgecolor="none", zorder=0, label=label)
        label = None


def _mark_tolerance(axes, signs=(1.0,)):
    """Mark the error that the task allows."""
    label = f"tolerance, {TOLERANCE_MM:g} mm"
    for sign in signs:
        axes.axhline(sign * TOLERANCE_MM, label=label, **style.TOLERANCE)
        label = None


def _pass_note(places):
    """Number of passes where there is more than one: curves are then means."""
    count = choose.passes(places)
    return f", {count} passes" if count > 1 else ""


def _finish_axis(axes, places):
    """Whole points on the axis, half a point free at both ends, a grid."""
    axes.set_xlim(0.5, places["station"].max() + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    axes.grid(True)
