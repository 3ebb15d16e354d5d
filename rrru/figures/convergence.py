"""How the genetic algorithm converges, seed by seed, against the optimum of its own objective."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from rrru.errors import ConfigError
from rrru.figures import choose, style
from rrru.figures.choose import Options, Tables

# smallest excess that is drawn, a nanometre: the log axis has no zero, and no smaller difference matters
_FLOOR_MM = 1e-6


@style.printed
def convergence(tables: Tables, options: Options) -> Figure:
    """Convergence of the genetic algorithm: excess of the best mean distance so far over the least one, for every
    seed, their median and quartiles; a run that has stopped keeps what it reached.
    """
    campaign = options["campaign"]
    if tables["genetic"].empty:
        return style.note("no genetic search: the robot has no compiled objective")
    history = choose.of_campaign(tables, "genetic_history", campaign, "convergence")
    runs = choose.of_campaign(tables, "genetic", campaign, "convergence")
    names = list(dict.fromkeys(history["calibration"]))
    missing = [name for name in names if not (runs["calibration"] == name).any()]
    if missing:
        lacking = f"no calibration {', '.join(missing)}"
        raise ConfigError(f"convergence: table genetic of campaign {campaign!r} has {lacking}")
    figure, panels = style.panel_grid(len(names), 55.0, sharex=True, sharey=True)
    for index, (name, axes) in enumerate(zip(names, panels[:, 0], strict=True)):
        optimum = float(runs.loc[runs["calibration"] == name, "optimum_mm"].iloc[0])
        _panel(axes, history[history["calibration"] == name], optimum)
        axes.set_title(f"({chr(97 + index)}) {choose.calibration_label(name)}, optimum {optimum:.4f} mm")
        lowest = index + 2 >= len(names)
        axes.tick_params(labelbottom=lowest)
        axes.set_xlabel("generation" if lowest else "")
        axes.set_ylabel("" if index % 2 else "excess over the optimum (mm)")
    style.legend_above(figure, panels[:, 0], columns=5 if len(names) > 1 else 2)
    return figure


def _panel(axes: Axes, history: pd.DataFrame, optimum: float) -> None:
    """Every seed as a thin line, their median and quartiles; a run that has stopped keeps what it reached."""
    wide = history.pivot(index="generation", columns="seed", values="best_mm").sort_index()
    excess = (wide.where(np.isfinite(wide)).ffill() - optimum).clip(lower=_FLOOR_MM)
    generations, ends = excess.index.to_numpy(), history.groupby("seed")["generation"].max()
    runs = [np.column_stack([generations, excess[seed]])[generations <= end] for seed, end in ends.items()]
    seeds = LineCollection(runs, colors=style.SKY, linewidths=0.4, zorder=1, label="one seed")
    axes.add_collection(seeds)
    last = np.array([run[-1] for run in runs])
    axes.plot(*last.T, ".", color=style.SKY, markersize=3.0, zorder=2, label="end of a run")
    low, high = excess.quantile(0.25, axis=1), excess.quantile(0.75, axis=1)
    axes.fill_between(generations, low, high, color=style.BLUE, alpha=0.25, linewidth=0.0, zorder=3, label="quartiles")
    median = f"median of {excess.shape[1]} seeds"
    axes.plot(generations, excess.median(axis=1), color=style.BLUE, linewidth=1.4, zorder=4, label=median)
    # generation 0, the initial population, has its place on a log axis that is linear up to 1
    axes.set_xscale("symlog", linthresh=1.0, linscale=0.3)
    axes.set_yscale("log")
    style.plain_log(axes.xaxis)
    style.plain_log(axes.yaxis)
    axes.set_xlim(0.0, None)
    axes.grid(True)
