"""Figure 11 of paper A: the spiral before calibration and after both calibrations."""

import numpy as np
from matplotlib.ticker import MaxNLocator

from rrru.figures import choose, style
from rrru.studies.rrru3.figures import panels

_AXES = "xyz"
_COLUMNS = [f"error_{axis}_mm" for axis in _AXES]


@style.printed
def fig11(tables, options):
    """The spiral after both calibrations (paper A, Fig. 11). (a) Commanded and attained path, deviations magnified
    as stated. (b) to (d) Errors along the axes, with the tolerance of the task. Light bands: the middle 90 % of other
    draws. Grey: points near a constraint singularity. Where a trajectory was passed more than once, curves are means
    over the passes, darker bands their range.
    """
    name = choose.trajectories(tables["measurements"], "*spiral*", "fig11")[0]
    places = choose.stations(tables["measurements"], name)
    curves = panels.both_calibrations(tables, options, "fig11")
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
        axes.set_title(f"({'bcd'[row]}) {axis}{panels.pass_note(places)}")
        axes.tick_params(labelbottom=row == len(_AXES) - 1)
    axes.set_xlabel("point")
    style.legend_above(figure, figure.axes)
    return figure


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
    ranges = [panels.draw_along(axes, curve, places, f"error_{axis}_mm") for curve in curves]
    texts = [
        f"{tag} {style.number(low)} to {style.number(high)}" for tag, (low, high) in zip(tags, ranges, strict=True)
    ]
    axes.set_title("; ".join(texts) + " mm", loc="right", fontsize=7.0)
    axes.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=0)
    panels.tolerance(axes, (1.0, -1.0))
    panels.shade_near_singular(axes, places)
    axes.set_ylabel(f"{axis} error (mm)")
    panels.finish(axes, places)
