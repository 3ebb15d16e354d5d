"""Figure of machines with measured lengths: the frame without and with the effects of the verdict."""

import numpy as np

from rrru.figures import style
from rrru.studies.real.figures import NOTHING

_BARE = {"color": style.VERMILION, "marker": "D", "markerfacecolor": "white"}
_FOUND = {"color": style.BLUE, "marker": "s"}
_PLACES = {"linestyle": "none", "markersize": 1.6, "markeredgewidth": 0.4}
_COLOURS = (style.BLUE, style.ORANGE, style.VERMILION, style.SKY, style.BLACK, style.GREY)
_MARKERS = ("o", "s", "^", "D", "v", "x")
_ROW_MM = 68.0


@style.printed
def lengths(tables, options):
    """Machines with measured lengths only, one row each. Left: the frame and the places, without effects and with those
    of the verdict. Middle and right: residuals of each length, without and with these effects; the scales differ.
    Circles: rejected readings, at the edge with their value where they are beyond it.
    """
    points, parameters = tables["real_points"], tables["real_parameters"]
    names = list(dict.fromkeys(points["campaign"])) if "campaign" in points else [""]
    if points.empty:
        return style.note(f"{options['set']}: {NOTHING}")
    figure = style.new(style.DOUBLE_MM, 14.0 + _ROW_MM * len(names))
    panels = figure.subplots(len(names), 3, squeeze=False, width_ratios=(1.3, 1.0, 1.0))
    for name, (frame, bare, found) in zip(names, panels, strict=True):
        machine = [table[table["campaign"] == name] if name else table for table in (points, parameters)]
        _draw_frame(frame, *machine, name)
        _draw_residuals(bare, machine[0], "bare_residual_mm", "frame alone")
        _draw_residuals(found, machine[0], "residual_mm", "with the verdict's effects")
    style.legend_above(figure, panels.ravel(), columns=8)
    return figure


def _draw_frame(axes, points, parameters, name):
    """Anchors and places in m, without and with the verdict's effects."""
    for prefix, look, label in (("bare_", _BARE, "frame alone"), ("", _FOUND, "with the verdict's effects")):
        anchors = _anchors(parameters, prefix)
        around = np.argsort(np.arctan2(*(anchors - anchors.mean(axis=0)).T[::-1]))
        closed = anchors[np.append(around, around[0])] / 1000.0
        axes.plot(closed[:, 0], closed[:, 1], linewidth=0.8, label=label, **look)
        places = points[[f"{prefix}x_mm", f"{prefix}y_mm"]].to_numpy() / 1000.0
        axes.plot(places[:, 0], places[:, 1], **(look | _PLACES))
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    axes.set_title(f"{name}: frame and places" if name else "frame and places")
    axes.grid(True)


def _anchors(parameters, prefix):
    """Anchors (n, 2) in mm: x and y of every name with both."""
    values = dict(zip(parameters["parameter"], parameters["value"], strict=True))
    names = [name.removesuffix("_x") for name in values if name.endswith("_x") and not name.startswith("bare_")]
    return np.array([[values[f"{prefix}{name}_{axis}"] for axis in "xy"] for name in names])


def _draw_residuals(axes, points, column, title):
    """Residual of every length over the rows; the scale is that of the used readings."""
    edge = 1.1 * float(points.loc[points["used"], column].abs().max())
    for k, (reading, residuals) in enumerate(points.groupby("reading", sort=False)):
        look = {"color": _COLOURS[k % len(_COLOURS)], "marker": _MARKERS[k % len(_MARKERS)], "markersize": 2.0}
        axes.plot(residuals["row"], residuals[column].where(residuals["used"]), linewidth=0.5, label=reading, **look)
        for row, value in residuals.loc[~residuals["used"], ["row", column]].to_numpy():
            place = float(np.clip(value, -edge, edge))
            axes.plot(row, place, "o", markersize=6.0, color=look["color"], markerfacecolor="none")
            if place != value:
                axes.annotate(
                    f"{value:.0f}", (row, place), (5, 0), textcoords="offset points", va="center", fontsize=6.0
                )
    axes.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=0)
    axes.set(xlabel="row", ylabel="measured - modelled length (mm)")
    axes.set_title(title)
    axes.grid(True)
