"""Figures of paper B's experiments along the curve: path, errors before and after, residuals of the network."""

import numpy as np

from rrru.figures import style

AXES = "xyz"
_BEFORE = {"color": style.BLACK, "linewidth": 0.8, "linestyle": (0, (3, 1))}
_AFTER = {"color": style.BLUE, "linewidth": 0.9}
_COLOURS = dict(zip(AXES, (style.BLUE, style.VERMILION, style.GREY), strict=True))
_TEST = {"linestyle": "none", "marker": "o", "markersize": 2.4, "markerfacecolor": "white"}


def experiments(frame, by="point"):
    """Names of the experiments of a table in order, with the rows of each, sorted."""
    return [(name, rows.sort_values(by)) for name, rows in frame.groupby("experiment", sort=True)]


@style.printed
def ptt_path(tables, options):
    """The curve of every experiment from above, and its height: commanded, measured (paper B, Figs. 10 and 12) and
    driven again with the network's correction (Fig. 18). Deviations are magnified as stated; heights are relative
    to the first point.
    """
    parts = experiments(tables["ptt_points"])
    figure = style.new(style.DOUBLE_MM, 88.0)
    panels = figure.subplots(2, len(parts), squeeze=False, sharex="row", sharey="row", height_ratios=(1.0, 0.8))
    deviations = np.concatenate([_vectors(rows, "before") for _, rows in parts])
    span = np.ptp(_vectors(parts[0][1], "command"), axis=0)
    across = style.magnification(deviations[:, :2], span[0], 0.2)
    upwards = style.magnification(deviations[:, 2], max(span[2], 1.0), 0.2)
    for column, (name, rows) in enumerate(parts):
        command = _vectors(rows, "command")
        above, height = panels[:, column]
        for label, prefix, look in (("before compensation", "before", _BEFORE), ("driven again", "after", _AFTER)):
            moved = command + _vectors(rows, prefix) * np.array([across, across, upwards])
            above.plot(moved[:, 0], moved[:, 1], label=label, **look)
            height.plot(rows["point"], moved[:, 2], **look)
        above.plot(command[:, 0], command[:, 1], label="commanded", color=style.ORANGE, linewidth=2.4, zorder=0)
        height.plot(rows["point"], command[:, 2], color=style.ORANGE, linewidth=2.4, zorder=0)
        above.set(aspect="equal", xlabel="x (mm)")
        above.set_title(name, loc="center")
        height.set_xlabel("point")
    panels[0, 0].set_ylabel(f"y (mm), deviations × {across:g}")
    panels[1, 0].set_ylabel(f"z (mm), deviations × {upwards:g}")
    style.legend_above(figure, panels[0, :1])
    return figure


@style.printed
def ptt_errors(tables, options):
    """Errors along the axes before compensation and when driven again (paper B, Fig. 16); heights are relative to
    the first point.
    """
    parts = experiments(tables["ptt_points"])
    figure = style.new(style.DOUBLE_MM, 100.0)
    panels = figure.subplots(3, len(parts), squeeze=False, sharex=True, sharey="row")
    for column, (name, rows) in enumerate(parts):
        for row, axis in enumerate(AXES):
            axes = panels[row, column]
            axes.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=0)
            axes.plot(rows["point"], rows[f"before_{axis}_mm"], label="before compensation", **_BEFORE)
            axes.plot(rows["point"], rows[f"after_{axis}_mm"], label="driven again", **_AFTER)
            axes.margins(x=0.02)
        panels[0, column].set_title(name, loc="center")
        panels[2, column].set_xlabel("point")
    for row, axis in enumerate(AXES):
        panels[row, 0].set_ylabel(f"{axis} error (mm)")
    style.legend_above(figure, panels[0, :1])
    return figure


@style.printed
def ptt_network(tables, options):
    """Residuals of the chosen network: its corrected positions minus those learned (paper B, Fig. 14).
    Circles: test points.
    """
    parts = experiments(tables["ptt_points"])
    figure = style.new(style.DOUBLE_MM, 24.0 + 21.0 * len(parts))
    panels = figure.subplots(len(parts), 1, squeeze=False, sharex=True, sharey=True)[:, 0]
    for axes, (name, rows) in zip(panels, parts, strict=True):
        test = rows[rows["set"] == "test"]
        axes.axhline(0.0, color="#cccccc", linewidth=0.5, zorder=0)
        for axis, colour in _COLOURS.items():
            left, label = f"network_{axis}_mm", f"{axis}, test point"
            axes.plot(rows["point"], 1e3 * rows[left], color=colour, linewidth=0.7, label=axis)
            axes.plot(test["point"], 1e3 * test[left], color=colour, label=label, **_TEST)
        axes.set_title(name)
        axes.set_ylabel("residual (µm)")
        axes.margins(x=0.01)
    panels[-1].set_xlabel("point")
    style.legend_above(figure, panels[:1], columns=6)
    return figure


def _vectors(rows, name):
    """Values (n, 3) of a table's columns name_x_mm, name_y_mm and name_z_mm."""
    return rows[[f"{name}_{axis}_mm" for axis in "xyz"]].to_numpy(dtype=float)
