"""Figures of what paper B's experiments teach: training, slider corrections, benefits on the curve and away from it."""

import numpy as np

from rrru.figures import style
from rrru.studies.ptt3.figures.paths import experiments

# one colour and mark per experiment, in order
_EXPERIMENTS = (
    (style.BLACK, "o"),
    (style.BLUE, "s"),
    (style.SKY, "^"),
    (style.ORANGE, "v"),
    (style.VERMILION, "D"),
)
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
_READINGS = {
    ("paper_scaled", "correction"): ("scaled inputs, learns the correction", style.BLUE, "-"),
    ("paper_scaled", "position"): ("scaled inputs, learns the position", style.BLUE, (0, (3, 1))),
    ("paper_mm", "correction"): ("mm, learns the correction", style.VERMILION, "-"),
    ("paper_mm", "position"): ("mm, learns the position", style.VERMILION, (0, (3, 1))),
}
# below it only that a correction harms matters
_LOWEST_PERCENT = -50.0


def looks(names):
    """Colour and mark of every experiment."""
    return {name: _EXPERIMENTS[k % len(_EXPERIMENTS)] for k, name in enumerate(sorted(names))}


@style.printed
def ptt_training(tables, options):
    """Error of the network as neurons are added (paper B, Fig. 13, where 20 steps are enough: grey line). (a) The
    spread with the least cross-validated error, on training points and on points held back; the mark is the chosen
    number of neurons. (b) The paper's spread, read as of inputs scaled to -1 .. 1 or as mm, for a network that
    learns the correction and one that learns the corrected position.
    """
    spread, every = tables["ptt_spread"], tables["ptt_training"]
    colours = looks(every["experiment"].unique())
    figure = style.new(style.DOUBLE_MM, 78.0)
    left, right = figure.subplots(1, 2)
    for row in spread[spread["chosen"]].sort_values("experiment").itertuples():
        part = every[
            (every["experiment"] == row.experiment)
            & (every["spread_from"] == "candidate")
            & (every["spread_mm"] == row.spread_mm)
        ]
        colour, mark = colours[row.experiment]
        label = f"{row.experiment}: {row.spread_mm:g} mm, {row.neurons}"
        left.plot(part["neurons"], part["train_mse_mm2"], color=colour, label=label)
        left.plot(part["neurons"], part["validation_mse_mm2"], color=colour, linestyle=(0, (1, 1)))
        best = part[part["neurons"] == row.neurons]
        left.plot(
            best["neurons"], best["validation_mse_mm2"], color=colour, marker=mark, linestyle="none", markersize=4.5
        )
    left.plot([], [], color=style.GREY, label="training points")
    left.plot([], [], color=style.GREY, linestyle=(0, (1, 1)), label="held back (mark: chosen)")
    left.set_title("(a) chosen spread and neurons")
    first = sorted(every["experiment"].unique())[-1]
    for (source, learns), (label, colour, dashes) in _READINGS.items():
        part = every[(every["experiment"] == first) & (every["spread_from"] == source) & (every["learns"] == learns)]
        right.plot(part["neurons"], part["test_mse_mm2"], color=colour, linestyle=dashes, label=label)
    right.set_title(f"(b) the paper's spread, test points, {first}")
    for axes in (left, right):
        axes.axvline(20.0, color=style.GREY, linewidth=0.6, zorder=0)
        axes.set(yscale="log", xlabel="neurons", ylabel="mean squared error (mm²)")
        axes.legend(loc="upper right" if axes is left else "center right")
    return figure


@style.printed
def ptt_corrections(tables, options):
    """What every slider is moved by (paper B, Fig. 15), and by how much the exact inverse (eq. 11) differs from the
    Jacobian (eq. 12).
    """
    frame = tables["ptt_corrections"]
    colours = looks(frame["experiment"].unique())
    figure = style.new(style.DOUBLE_MM, 96.0)
    panels = figure.subplots(2, 3, sharex=True, sharey="row", height_ratios=(1.5, 1.0))
    for column, leg in enumerate((1, 2, 3)):
        for name, rows in experiments(frame[frame["leg"] == leg]):
            panels[0, column].plot(rows["point"], rows["inverse_mm"], color=colours[name][0], label=name)
            panels[1, column].plot(rows["point"], rows["difference_um"], color=colours[name][0])
        panels[0, column].set_title(f"({'abc'[column]}) slider {leg}")
        panels[1, column].set_xlabel("point")
    panels[0, 0].set_ylabel("correction (mm)")
    panels[1, 0].set_ylabel("exact less Jacobian (µm)")
    style.legend_above(figure, panels[0, :1])
    return figure


@style.printed
def ptt_benefit(tables, options):
    """(a) to (c) Benefit of every compensation on the test points, the robot driven again (paper B, eq. 21 and Fig.
    17), and the paper's bounds. Lines: 5 % to 95 % over redraws of noise and split, of the methods that are
    redrawn. (d), (e) Benefit of the network through the Jacobian with the curve begun at other azimuths, one draw
    each: the paper's height hangs on its first point.
    """
    frame = tables["ptt_benefit"][tables["ptt_benefit"]["set"] == "test"]
    figure = style.new(style.DOUBLE_MM, 148.0)
    grid = figure.add_gridspec(4, 2, height_ratios=(1.0, 1.0, 1.0, 1.35))
    panels = [figure.add_subplot(grid[0, :])]
    panels += [figure.add_subplot(grid[row, :], sharex=panels[0]) for row in (1, 2)]
    for letter, axes, axis in zip("abc", panels, _PUBLISHED_PERCENT, strict=True):
        _methods(axes, frame[frame["axis"] == axis], _PUBLISHED_PERCENT[axis])
        axes.set_title(f"({letter}) {axis}" + (", from the first point's" if axis == "z" else ""))
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
    for offset, (method, (label, colour, mark)) in zip(
        np.linspace(-0.33, 0.33, len(METHODS)), METHODS.items(), strict=True
    ):
        part = frame[frame["method"] == method].set_index("experiment").loc[names]
        place = np.arange(len(names)) + offset
        axes.vlines(place, part["benefit_low_percent"], part["benefit_high_percent"], color=colour, linewidth=0.7)
        axes.plot(
            place, part["benefit_percent"], color=colour, marker=mark, linestyle="none", markersize=4.0, label=label
        )
    axes.axhline(bound, label="published: at least", **style.TOLERANCE)
    drawn = frame.loc[frame["method"].isin(METHODS), ["benefit_percent", "benefit_low_percent"]]
    axes.set(ylim=(min(drawn.min().min(), bound) - 3.0, 101.0), ylabel="benefit (%)")
    axes.set_xticks(np.arange(len(names)), names)


def _starts(panels, frame):
    """Benefit in height of the paper's way over the azimuth of the first point, by the paper's reference and by the
    mean.
    """
    colours = looks(frame["experiment"].unique())
    titles = {
        "z": "(d) z, from the first point's, curve begun elsewhere",
        "z_mean": "(e) the same, z from the mean of all points",
    }
    for axes, (axis, title) in zip(panels, titles.items(), strict=True):
        for name, rows in frame[frame["axis"] == axis].groupby("experiment", sort=True):
            rows = rows.sort_values("start_deg")
            colour, mark = colours[name]
            axes.plot(rows["start_deg"], rows["benefit_percent"], color=colour, marker=mark, label=name)
        axes.axhline(_PUBLISHED_PERCENT["z"], **style.TOLERANCE)
        axes.set(xlabel="azimuth of the first point (°)", ylabel="benefit (%)", xticks=range(0, 361, 60))
        axes.set_title(title)
    panels[1].legend(loc="lower left", ncols=3, frameon=True, framealpha=1.0, edgecolor="none")


@style.printed
def ptt_extrapolation(tables, options):
    """Benefit of a correction where it was not learned: every experiment (dotted: the first) with the curve's
    radius, its height or the payload changed, and every experiment with the curve driven backwards. Below zero the
    correction harms.
    """
    frame = tables["ptt_extrapolation"]
    families = {
        "radius_mm": "radius changed by (mm)",
        "height_mm": "height changed by (mm)",
        "payload_kg": "payload changed by (kg)",
    }
    shown = {name: METHODS[name] for name in METHODS if name in set(frame["method"])}
    figure = style.new(style.DOUBLE_MM, 150.0)
    panels = figure.subplots(4, 3, sharey=True)
    for row, (family, label) in enumerate(families.items()):
        for column, axis in enumerate("xyz"):
            axes = panels[row, column]
            for method, look in shown.items():
                part = frame[
                    frame["family"].isin([family, "none"]) & (frame["axis"] == axis) & (frame["method"] == method)
                ]
                _every(axes, part, look)
            axes.set_xlabel(label)
    for column, axis in enumerate("xyz"):
        panels[0, column].set_title(f"{axis}" + (", from the first point's" if axis == "z" else ""), loc="center")
        _reversed(panels[3, column], frame[(frame["family"] == "reverse") & (frame["axis"] == axis)], shown)
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
    for k, (_, rows) in enumerate(part.groupby("experiment", sort=True)):
        rows = rows.sort_values("size")
        dashes = "-" if k else (0, (1, 1))
        value = rows["benefit_percent"]
        axes.plot(rows["size"], value, color=colour, marker=mark, linestyle=dashes, markersize=2.4, linewidth=0.7)
    axes.plot([], [], color=colour, marker=mark, markersize=3.0, label=label)


def _reversed(axes, part, shown):
    """Benefit on the curve driven backwards, per experiment."""
    names = sorted(part["experiment"].unique())
    for offset, (method, (_, colour, mark)) in zip(np.linspace(-0.25, 0.25, len(shown)), shown.items(), strict=True):
        value = part[part["method"] == method].set_index("experiment")["benefit_percent"].loc[names]
        axes.plot(np.arange(len(names)) + offset, value, color=colour, marker=mark, linestyle="none", markersize=3.5)
    axes.set_xticks(np.arange(len(names)), [name.removeprefix("ptt_") for name in names])
    axes.set_xlabel("experiment, curve backwards")
