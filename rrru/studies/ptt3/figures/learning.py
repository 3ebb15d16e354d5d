"""Figures of learning from paper B's experiments: training, slider corrections, benefits on and off the curve."""

import numpy as np

from rrru.figures import style
from rrru.figures.choose import where
from rrru.studies.ptt3.figures.paths import experiments

# one colour and mark per experiment, in order
_COLOURS = (style.BLACK, style.BLUE, style.SKY, style.ORANGE, style.VERMILION)
_MARKS = "os^vD"
METHODS = {
    "rbf_inverse": ("network, exact inverse", style.BLUE, "o"),
    "rbf_jacobian": ("network, Jacobian", style.SKY, "s"),
    "rbf_paper": ("paper's spread, scaled inputs", style.GREY, "^"),
    "rbf_paper_mm": ("paper's spread, mm", style.GREY, "v"),
    "interpolator": ("biharmonic spline", style.BLACK, "x"),
    "parameters": ("calibrated model", style.ORANGE, "D"),
    "rbf_after_parameters": ("network after calibration", style.VERMILION, "*"),
}
# paper B, section 3.3: "reduced by at least"
_PUBLISHED_PERCENT = {"x": 90.0, "y": 90.0, "z": 80.0}
_SOURCES = {"paper_scaled": ("scaled inputs", style.BLUE), "paper_mm": ("mm", style.VERMILION)}
_LEARNS = {"correction": "-", "position": (0, (3, 1))}
_FAMILIES = {
    "radius_mm": "radius changed by (mm)",
    "height_mm": "height changed by (mm)",
    "payload_kg": "payload changed by (kg)",
}
_STARTS = {
    "z": "(d) z, relative to the first point, other starts",
    "z_mean": "(e) the same, z relative to the mean of all points",
}
# lower limit of the axis; below it only the sign matters
_LOWEST_PERCENT = -50.0


def looks(names):
    """Colour and mark of every experiment."""
    return {name: (_COLOURS[k % 5], _MARKS[k % 5]) for k, name in enumerate(sorted(names))}


def _axis_title(axis):
    """An axis, and the reference of the paper's heights."""
    return axis + (", relative to the first point" if axis == "z" else "")


@style.printed
def ptt_training(tables, options):
    """Error of the network as neurons are added (paper B, Fig. 13, where 20 steps are enough: grey line). (a) The
    spread with the least cross-validated error, on training points and in cross-validation; the mark is the chosen
    number of neurons. (b) The paper's spread, for inputs scaled to -1 .. 1 or as mm, for a network that
    learns the correction and one that learns the corrected position.
    """
    spread, every = tables["ptt_spread"], tables["ptt_training"]
    colours = looks(every["experiment"].unique())
    figure = style.new(style.DOUBLE_MM, 78.0)
    left, right = figure.subplots(1, 2)
    for row in spread[spread["chosen"]].sort_values("experiment").itertuples():
        part = where(every, experiment=row.experiment, spread_from="candidate", spread_mm=row.spread_mm)
        colour, mark = colours[row.experiment]
        label = f"{row.experiment}: {row.spread_mm:g} mm, {row.neurons}"
        left.plot(part["neurons"], part["train_mse_mm2"], color=colour, label=label)
        left.plot(part["neurons"], part["validation_mse_mm2"], color=colour, linestyle=(0, (1, 1)))
        best = where(part, neurons=row.neurons)["validation_mse_mm2"]
        left.plot([row.neurons], best, color=colour, marker=mark, linestyle="none", markersize=4.5)
    left.plot([], [], color=style.GREY, label="training points")
    left.plot([], [], color=style.GREY, linestyle=(0, (1, 1)), label="cross-validation (mark: chosen)")
    left.set_title("(a) chosen spread and neurons")
    last = every["experiment"].max()
    for source, (unit, colour) in _SOURCES.items():
        for learns, dashes in _LEARNS.items():
            part = where(every, experiment=last, spread_from=source, learns=learns)
            label = f"{unit}, learns the {learns}"
            right.plot(part["neurons"], part["test_mse_mm2"], color=colour, linestyle=dashes, label=label)
    right.set_title(f"(b) the paper's spread, test points, {last}")
    for axes, corner in ((left, "upper right"), (right, "center right")):
        axes.axvline(20.0, color=style.GREY, linewidth=0.6, zorder=0)
        axes.set(yscale="log", xlabel="neurons", ylabel="mean squared error (mm²)")
        axes.legend(loc=corner)
    return figure


@style.printed
def ptt_corrections(tables, options):
    """Corrections of every slider (paper B, Fig. 15), and the difference between the exact inverse (eq. 11) and the
    Jacobian (eq. 12).
    """
    frame = tables["ptt_corrections"]
    colours = looks(frame["experiment"].unique())
    figure = style.new(style.DOUBLE_MM, 96.0)
    panels = figure.subplots(2, 3, sharex=True, sharey="row", height_ratios=(1.5, 1.0))
    for column, leg in enumerate((1, 2, 3)):
        for name, rows in experiments(where(frame, leg=leg)):
            panels[0, column].plot(rows["point"], rows["inverse_mm"], color=colours[name][0], label=name)
            panels[1, column].plot(rows["point"], rows["difference_um"], color=colours[name][0])
        panels[0, column].set_title(f"({'abc'[column]}) slider {leg}")
        panels[1, column].set_xlabel("point")
    panels[0, 0].set_ylabel("correction (mm)")
    panels[1, 0].set_ylabel("exact - Jacobian (µm)")
    style.legend_above(figure, panels[0, :1])
    return figure


@style.printed
def ptt_benefit(tables, options):
    """(a) to (c) Benefit of every compensation on the test points, the robot driven again (paper B, eq. 21 and Fig.
    17), and the paper's bounds. Lines: 5 % to 95 % over redraws of noise and split, of the methods that are
    redrawn. (d), (e) Benefit of the network through the Jacobian for other start azimuths of the curve, one draw
    each: the paper's height depends on its first point.
    """
    frame = where(tables["ptt_benefit"], set="test")
    figure = style.new(style.DOUBLE_MM, 148.0)
    grid = figure.add_gridspec(4, 2, height_ratios=(1.0, 1.0, 1.0, 1.35))
    panels = [figure.add_subplot(grid[0, :])]
    panels += [figure.add_subplot(grid[row, :], sharex=panels[0]) for row in (1, 2)]
    for letter, axes, axis in zip("abc", panels, _PUBLISHED_PERCENT, strict=True):
        _methods(axes, where(frame, axis=axis), _PUBLISHED_PERCENT[axis])
        axes.set_title(f"({letter}) {_axis_title(axis)}")
        axes.tick_params(labelbottom=axes is panels[-1])
    panels[-1].set_xlabel("experiment")
    style.legend_above(figure, panels[:1], columns=4)
    lower = [figure.add_subplot(grid[3, 0])]
    lower.append(figure.add_subplot(grid[3, 1], sharey=lower[0]))
    _starts(lower, tables["ptt_start"])
    return figure


def _methods(axes, frame, bound):
    """Benefit along one axis of every method in every experiment, with its range where it has one."""
    names = sorted(frame["experiment"].unique())
    for k, (method, (label, colour, mark)) in enumerate(METHODS.items()):
        part = where(frame, method=method).set_index("experiment").loc[names]
        place = np.arange(len(names)) + np.linspace(-0.33, 0.33, len(METHODS))[k]
        look = {"color": colour, "marker": mark, "linestyle": "none", "markersize": 4.0, "label": label}
        axes.vlines(place, part["benefit_low_percent"], part["benefit_high_percent"], color=colour, linewidth=0.7)
        axes.plot(place, part["benefit_percent"], **look)
    axes.axhline(bound, label="published: at least", **style.TOLERANCE)
    drawn = frame.loc[frame["method"].isin(METHODS), ["benefit_percent", "benefit_low_percent"]]
    axes.set(ylim=(min(drawn.min().min(), bound) - 3.0, 101.0), ylabel="benefit (%)")
    axes.set_xticks(np.arange(len(names)), names)


def _starts(panels, frame):
    """Benefit in height of the paper's method over the start azimuth, relative to the first point and to the mean."""
    colours = looks(frame["experiment"].unique())
    for axes, (axis, title) in zip(panels, _STARTS.items(), strict=True):
        for name, rows in experiments(where(frame, axis=axis), "start_deg"):
            colour, mark = colours[name]
            axes.plot(rows["start_deg"], rows["benefit_percent"], color=colour, marker=mark, label=name)
        axes.axhline(_PUBLISHED_PERCENT["z"], **style.TOLERANCE)
        axes.set(xlabel="azimuth of the first point (°)", ylabel="benefit (%)", xticks=range(0, 361, 60))
        axes.set_title(title)
    panels[1].legend(loc="lower left", ncols=3, frameon=True, framealpha=1.0, edgecolor="none")


@style.printed
def ptt_extrapolation(tables, options):
    """Extrapolation of a correction: benefit in every experiment (dotted: the first) with another radius or height of
    the curve, another payload, and with the curve driven backwards. A negative benefit means larger errors.
    """
    frame = tables["ptt_extrapolation"]
    shown = {name: METHODS[name] for name in METHODS if name in set(frame["method"])}
    figure = style.new(style.DOUBLE_MM, 150.0)
    panels = figure.subplots(4, 3, sharey=True)
    for column, axis in enumerate("xyz"):
        along = where(frame, axis=axis)
        for axes, (family, label) in zip(panels[:, column], _FAMILIES.items(), strict=False):
            part = along[along["family"].isin([family, "none"])]
            for method, look in shown.items():
                _every(axes, where(part, method=method), look)
            axes.set_xlabel(label)
        panels[0, column].set_title(_axis_title(axis), loc="center")
        _reversed(panels[3, column], where(along, family="reverse"), shown)
    for axes in panels.ravel():
        axes.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=0)
    panels[0, 0].set_ylim(_LOWEST_PERCENT, 104.0)
    for axes in panels[:, 0]:
        axes.set_ylabel("benefit (%)")
    style.legend_above(figure, panels[0, :1], columns=4)
    return figure


def _every(axes, part, look):
    """One line per experiment, dotted for the first."""
    label, colour, mark = look
    for k, (_, rows) in enumerate(experiments(part, "size")):
        dashes = "-" if k else (0, (1, 1))
        line = {"color": colour, "marker": mark, "linestyle": dashes, "markersize": 2.4, "linewidth": 0.7}
        axes.plot(rows["size"], rows["benefit_percent"], **line)
    axes.plot([], [], color=colour, marker=mark, markersize=3.0, label=label)


def _reversed(axes, part, shown):
    """Benefit on the curve driven backwards, per experiment."""
    names = sorted(part["experiment"].unique())
    for k, (method, (_, colour, mark)) in enumerate(shown.items()):
        value = where(part, method=method).set_index("experiment")["benefit_percent"].loc[names]
        place = np.arange(len(names)) + np.linspace(-0.25, 0.25, len(shown))[k]
        axes.plot(place, value, color=colour, marker=mark, linestyle="none", markersize=3.5)
    axes.set_xticks(np.arange(len(names)), [name.removeprefix("ptt_") for name in names])
    axes.set_xlabel("experiment, curve driven backwards")
