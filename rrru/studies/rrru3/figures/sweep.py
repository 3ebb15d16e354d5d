"""Figures 6 and 7 of paper A: the objective against the genetic algorithm's settings, with the scatter of seeds."""

import numpy as np
import pandas as pd
from matplotlib.ticker import FuncFormatter

from rrru.errors import ConfigError
from rrru.figures import choose, style
from rrru.studies.rrru3.paper import CROSSOVER, DESIGN, MIGRATION, SETTINGS

_SYMBOL = {"crossover_fraction": "P_c", "migration_fraction": "P_m"}
_PRINTED = {"crossover_fraction": CROSSOVER, "migration_fraction": MIGRATION}
# the settings chosen in the paper
_CHOSEN = {number.item: number.value for number in DESIGN}
_POPULATIONS = {"one": "one population", "islands": "islands"}
# resolution of the paper's four printed digits
_RESOLUTION_MM = 1e-4
_GOLDEN = 0.6180339887498949


@style.printed
def fig06(tables, options):
    """Objective against the crossover fraction (paper A, Fig. 6). (a) The published curve with half a unit of its
    last printed digit. (b), (c) The same algorithm run with many seeds: the excess of every run over the least mean
    distance, its median and quartiles, the seed whose curve is nearest to the published one, and the published curve
    above its own lowest value, on one axis that is linear below one printed digit. Open medians are worse than the best
    setting (Mann-Whitney, Holm, 5 %).
    """
    return _sweep(tables, options, "crossover_fraction", "fig06")


@style.printed
def fig07(tables, options):
    """Objective against the migration fraction (paper A, Fig. 7). (a) The published curve with half a unit of its
    last printed digit. (b), (c) The same algorithm run with many seeds: the excess of every run over the least mean
    distance, its median and quartiles, and the published curve above its own lowest value, on one axis that is
    linear below one printed digit. Open medians are worse than the best setting (Mann-Whitney, Holm, 5 %).
    """
    return _sweep(tables, options, "migration_fraction", "fig07")


def _sweep(tables, options, parameter, name):
    """The published curve, then for each kind of population the seeds' scatter, with one common log axis."""
    published = pd.Series(_PRINTED[parameter], index=[float(setting) for setting in SETTINGS])
    optimum = _optimum(tables, options, name)
    shown = ("sweep_runs", "sweep_pairs", "sweep_effect", "sweep_match")
    frames = {key: _shown(tables[key], parameter, options) for key in shown}
    kinds = [kind for kind in _POPULATIONS if (frames["sweep_runs"]["population"] == kind).any()]
    if not kinds:
        raise ConfigError(f"{name}: table sweep_runs has no runs of {parameter}")
    figure = style.new(style.DOUBLE_MM, 95.0)
    grid = figure.add_gridspec(1, 1 + len(kinds), width_ratios=[0.9, *([1.0] * len(kinds))])
    _as_printed(figure.add_subplot(grid[0]), published)
    first = None
    for column, kind in enumerate(kinds, start=1):
        axes = figure.add_subplot(grid[column], sharey=first)
        runs, pairs, effect, match = (frame[frame["population"] == kind] for frame in frames.values())
        _scatter(axes, runs, set(pairs.loc[pairs["distinguishable"].astype(bool), "value"]), optimum)
        _nearest_curve(axes, runs, match, optimum)
        _published_above(axes, published)
        axes.set_title(f"({'abc'[column]}) {_POPULATIONS[kind]}\n{_test(effect, parameter)}")
        axes.tick_params(labelleft=first is None)
        first = first or axes
    for axes in figure.axes:
        axes.set_xlabel(f"{parameter.replace('_', ' ')} ${_SYMBOL[parameter]}$")
        label = f"chosen in the paper, {_CHOSEN[parameter]}"
        axes.axvline(_CHOSEN[parameter], color=style.GREY, linewidth=0.8, linestyle=(0, (2, 2)), zorder=0, label=label)
        axes.grid(True)
    # some space above the highest point of all panels
    highest = max(axes.dataLim.y1 for axes in figure.axes[1:])
    first.set_ylim(-0.3 * _RESOLUTION_MM, 3.0 * max(highest, _RESOLUTION_MM))
    first.set_ylabel("mean distance above the optimum (mm)")
    style.legend_above(figure, figure.axes, columns=3)
    return figure


def _shown(frame, parameter, options):
    """Rows of one swept parameter in the interpretation of the study, with runs to the end."""
    chosen = (frame["operators"] == options["sweep_operators"]) & (frame["stop"] == "end")
    return frame[chosen & (frame["parameter"] == parameter)]


def _optimum(tables, options, name):
    """Least mean distance in mm of the calibration that was swept."""
    campaign, calibration, method = (options[key] for key in ("sweep_campaign", "sweep_calibration", "method"))
    rows = choose.of_campaign(tables, "calibrations", campaign, name)
    fitted = rows[(rows["calibration"] == calibration) & (rows["method"] == method)]
    if fitted.empty:
        known = ", ".join(sorted(set(rows["calibration"])))
        raise ConfigError(
            f"{name}: campaign {campaign!r} has no calibration {calibration!r} by {method!r}; it has {known}"
        )
    return float(fitted["mean_mm"].iloc[0])


def _as_printed(axes, published):
    """The published curve with half a unit of its last digit, on a separate axis."""
    bars = {"yerr": _RESOLUTION_MM / 2.0, "elinewidth": 0.7, "capsize": 1.5}
    axes.errorbar(published.index, published, label="published, as printed", **bars, **style.PUBLISHED)
    spread = published.max() - published.min()
    axes.set(title=f"(a) as published\nrange {spread:.4f} mm", ylabel="published fitness (mm)")
    axes.margins(x=0.06, y=0.12)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.4f}" if spread < 0.005 else f"{value:.2f}"))
    _settings_as_ticks(axes, published.index)


def _scatter(axes, runs, apart, optimum):
    """Every seed's excess over the optimum, median and quartiles per setting; apart: values worse than the best."""
    values = np.sort(runs["value"].unique())
    step = np.diff(values).min() if values.size > 1 else 0.1
    excess = runs["objective_mm"] - optimum
    finite = excess[np.isfinite(excess)].sort_values()
    groups = finite.groupby(runs["value"].reindex(finite.index))
    # sideways shifts of the dots; multiples of the golden section are well separated
    aside = 0.6 * step * (groups.cumcount() * _GOLDEN % 1.0 - 0.5)
    dots = {"linestyle": "none", "marker": ".", "markersize": 2.5, "color": style.SKY}
    label = f"one seed (optimum {optimum:.4f} mm)"
    axes.plot(runs["value"].reindex(finite.index) + aside, finite, label=label, zorder=2, **dots)
    low, middle, high = (groups.quantile(share) for share in (0.25, 0.5, 0.75))
    bars = {"color": style.BLUE, "linewidth": 1.8, "solid_capstyle": "butt"}
    # each bar ends in a gap
    places, ends = np.repeat(low.index, 3), np.stack([low, high, np.full(len(low), np.nan)], axis=1).ravel()
    axes.plot(places, ends, label="quartiles", zorder=3, **bars)
    distinguishable = middle.index.isin(apart)
    for worse in dict.fromkeys(distinguishable):
        label = "median, worse than the best setting" if worse else "median, not separable from the best"
        look = {"markersize": 4.0, "color": style.BLUE, "markerfacecolor": "white" if worse else style.BLUE}
        axes.plot(middle[distinguishable == worse], "o", label=label, zorder=4, **look)
    _settings_as_ticks(axes, values)
    if lost := len(excess) - len(finite):
        axes.text(0.03, 0.98, f"infeasible, not drawn: {lost}", transform=axes.transAxes, va="top", fontsize=7.0)


def _nearest_curve(axes, runs, match, optimum):
    """The curve of the one seed that is nearest to the published curve."""
    curve = runs[runs["seed"].isin(match["nearest_seed"])].set_index("value")["objective_mm"].sort_index() - optimum
    axes.plot(curve[np.isfinite(curve)], color=style.SKY, linewidth=0.9, label="seed nearest to the published curve")


def _published_above(axes, published):
    """The published curve above its own lowest value, on an axis that is linear up to one printed digit."""
    above = published - published.min()
    axes.plot(above.index, above, label=f"published, above its own lowest, {published.min():.4f} mm", **style.PUBLISHED)
    # the linear part shows differences below one digit as zero
    axes.set_yscale("symlog", linthresh=_RESOLUTION_MM, linscale=0.5)
    style.plain_log(axes.yaxis)
    band = {"facecolor": "#eeeeee", "edgecolor": "none", "zorder": 0}
    axes.axhspan(-_RESOLUTION_MM, _RESOLUTION_MM, label="within one printed digit", **band)


def _test(effect, parameter):
    """Kruskal-Wallis test of one sweep as text."""
    if effect.empty:
        return ""
    row = effect.iloc[0]
    text = f"Kruskal-Wallis: {_p(row['p_value'])}"
    return f"{text}\nwithout 1.0: {_p(row['p_value_mutating'])}" if parameter == "crossover_fraction" else text


def _p(value):
    """A p value as text."""
    return f"p = {value:.2g}" if value >= 1e-3 else "p < 0.001"


def _settings_as_ticks(axes, values):
    """Every second setting as a tick."""
    axes.set_xticks(list(values)[1::2] if len(values) > 3 else list(values))
