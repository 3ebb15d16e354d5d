"""Figures 6 and 7 of paper A: the objective reached against the genetic algorithm's settings, beside the scatter of
seeds.
"""

import numpy as np
import pandas as pd
from matplotlib.ticker import FuncFormatter

from rrru.errors import ConfigError
from rrru.figures import choose, style
from rrru.studies.rrru3.paper import CROSSOVER, MIGRATION, SETTINGS

# paper A, 3.1: the settings that were chosen there
_CHOSEN = {"crossover_fraction": 0.8, "migration_fraction": 0.7}
_PRINTED = {"crossover_fraction": CROSSOVER, "migration_fraction": MIGRATION}
_SYMBOL = {"crossover_fraction": "P_c", "migration_fraction": "P_m"}
_POPULATIONS = {"one": "one population", "islands": "islands"}
# the paper prints four digits: smaller differences cannot be told apart there
_RESOLUTION_MM = 1e-4
_GOLDEN = 0.6180339887498949


@style.printed
def fig06(tables, options):
    """Objective against the crossover fraction (paper A, Fig. 6). (a) The published curve with half a unit of its
    last printed digit. (b), (c) The same algorithm run with many seeds: what every run reached above the least mean
    distance, its median and quartiles, and the published curve above its own lowest value, on one axis that is
    linear below one printed digit. Open medians are worse than the best setting (Mann-Whitney, Holm, 5 %).
    """
    return _sweep(tables, options, "crossover_fraction", "fig06")


@style.printed
def fig07(tables, options):
    """Objective against the migration fraction (paper A, Fig. 7). (a) The published curve with half a unit of its
    last printed digit. (b), (c) The same algorithm run with many seeds: what every run reached above the least mean
    distance, its median and quartiles, and the published curve above its own lowest value, on one axis that is
    linear below one printed digit. Open medians are worse than the best setting (Mann-Whitney, Holm, 5 %).
    """
    return _sweep(tables, options, "migration_fraction", "fig07")


def _sweep(tables, options, parameter, name):
    """The published curve as printed, then for each kind of population the seeds' scatter and the published curve on
    one log axis.
    """
    published = pd.Series(_PRINTED[parameter], index=[float(setting) for setting in SETTINGS])
    optimum = _optimum(tables, options, name)
    runs = tables["sweep_runs"]
    runs = runs[runs["parameter"] == parameter]
    kinds = [kind for kind in _POPULATIONS if (runs["population"] == kind).any()]
    if not kinds:
        raise ConfigError(f"{name}: table sweep_runs has no runs of {parameter}")
    figure = style.new(style.DOUBLE_MM, 95.0)
    grid = figure.add_gridspec(1, 1 + len(kinds), width_ratios=[0.9, *([1.0] * len(kinds))])
    printed = figure.add_subplot(grid[0])
    _as_printed(printed, published, parameter)
    first = None
    for column, kind in enumerate(kinds, start=1):
        axes = figure.add_subplot(grid[column], sharey=first)
        _scatter(axes, runs[runs["population"] == kind], _pairs(tables, parameter, kind), optimum, published)
        axes.set_title(f"({'abc'[column]}) {_POPULATIONS[kind]}\n{_test(tables, parameter, kind)}")
        axes.set_xlabel(_axis_label(parameter))
        _mark_chosen(axes, parameter)
        axes.tick_params(labelleft=first is None)
        first = first or axes
    # some room above the highest point of all panels
    first.set_ylim(-0.3 * _RESOLUTION_MM, 3.0 * max(max(axes.dataLim.y1 for axes in figure.axes[1:]), _RESOLUTION_MM))
    first.set_ylabel("mean distance above the optimum (mm)")
    style.legend_above(figure, figure.axes, columns=3)
    return figure


def _optimum(tables, options, name):
    """Least mean distance in mm of the calibration that was swept."""
    rows = choose.of_campaign(tables, "calibrations", options["sweep_campaign"], name)
    found = rows[(rows["calibration"] == options["sweep_calibration"]) & (rows["method"] == options["method"])]
    if found.empty:
        raise ConfigError(
            f"{name}: campaign {options['sweep_campaign']!r} has no calibration {options['sweep_calibration']!r} by {options['method']!r};"
            f" it has {', '.join(sorted(set(rows['calibration'])))}"
        )
    return float(found["mean_mm"].iloc[0])


def _pairs(tables, parameter, kind):
    """Settings whose objective is told apart from the best setting's."""
    pairs = tables["sweep_pairs"]
    rows = pairs[(pairs["parameter"] == parameter) & (pairs["population"] == kind)]
    return set(rows.loc[rows["distinguishable"].astype(bool), "value"])


def _as_printed(axes, published, parameter):
    """The published curve with half a unit of its last digit, on an axis of its own."""
    bars = {"yerr": _RESOLUTION_MM / 2.0, "elinewidth": 0.7, "capsize": 1.5}
    axes.errorbar(published.index, published, label="published, as printed", **bars, **style.PUBLISHED)
    spread = published.max() - published.min()
    axes.set_title(f"(a) as published\nrange {spread:.4f} mm")
    axes.set(xlabel=_axis_label(parameter), ylabel="published fitness (mm)")
    axes.grid(True)
    axes.margins(x=0.06, y=0.12)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.4f}" if spread < 0.005 else f"{value:.2f}"))
    _mark_chosen(axes, parameter)
    _whole_settings(axes, published.index)


def _scatter(axes, runs, apart, optimum, published):
    """Every seed's excess over the optimum, median and quartiles per setting, and the published excess over its own
    lowest value.
    """
    values = np.sort(runs["value"].unique())
    step = np.diff(values).min() if values.size > 1 else 0.1
    lost = 0
    for value in values:
        excess = np.sort(runs.loc[runs["value"] == value, "objective_mm"].to_numpy()) - optimum
        finite = excess[np.isfinite(excess)]
        lost += len(excess) - len(finite)
        if not finite.size:
            continue
        # the dots stand side by side; multiples of the golden section never come close to each other
        aside = 0.6 * step * (np.arange(len(finite)) * _GOLDEN % 1.0 - 0.5)
        label = f"one seed (optimum {optimum:.4f} mm)"
        axes.plot(
            value + aside, finite, linestyle="none", marker=".", markersize=2.5, color=style.SKY, label=label, zorder=2
        )
        low, middle, high = np.quantile(finite, [0.25, 0.5, 0.75])
        axes.plot(
            [value, value],
            [low, high],
            color=style.BLUE,
            linewidth=1.8,
            solid_capstyle="butt",
            label="quartiles",
            zorder=3,
        )
        told = value in apart
        label = "median, worse than the best setting" if told else "median, not told apart from the best"
        inside = "white" if told else style.BLUE
        axes.plot(value, middle, "o", markersize=4.0, color=style.BLUE, markerfacecolor=inside, label=label, zorder=4)
    above = published - published.min()
    axes.plot(above.index, above, label=f"published, above its own lowest, {published.min():.4f} mm", **style.PUBLISHED)
    # linear up to one printed digit, so that no difference is shown as one
    axes.set_yscale("symlog", linthresh=_RESOLUTION_MM, linscale=0.5)
    style.plain_log(axes.yaxis)
    axes.axhspan(
        -_RESOLUTION_MM,
        _RESOLUTION_MM,
        facecolor="#eeeeee",
        edgecolor="none",
        zorder=0,
        label="within one printed digit",
    )
    axes.grid(True)
    _whole_settings(axes, values)
    if lost:
        axes.text(0.03, 0.98, f"infeasible, not drawn: {lost}", transform=axes.transAxes, va="top", fontsize=7.0)


def _test(tables, parameter, kind):
    """Kruskal-Wallis test of one sweep as text."""
    effect = tables["sweep_effect"]
    row = effect[(effect["parameter"] == parameter) & (effect["population"] == kind)]
    if row.empty:
        return ""
    row = row.iloc[0]
    text = f"Kruskal-Wallis: {_p(row['p_value'])}"
    return f"{text}\nwithout 1.0: {_p(row['p_value_mutating'])}" if parameter == "crossover_fraction" else text


def _p(value):
    """A p value as text."""
    return f"p = {value:.2g}" if value >= 1e-3 else "p < 0.001"


def _axis_label(parameter):
    """Name and symbol of a setting, which has no unit."""
    return f"{parameter.replace('_', ' ')} ${_SYMBOL[parameter]}$"


def _mark_chosen(axes, parameter):
    """Mark the setting that the paper chose."""
    chosen = _CHOSEN[parameter]
    axes.axvline(
        chosen, color=style.GREY, linewidth=0.8, linestyle=(0, (2, 2)), zorder=0, label=f"chosen in the paper, {chosen}"
    )


def _whole_settings(axes, values):
    """Every second setting as a tick."""
    axes.set_xticks(list(values)[1::2] if len(values) > 3 else list(values))
