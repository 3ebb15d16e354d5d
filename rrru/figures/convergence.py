"""How the genetic algorithm converges, seed by seed, against the optimum of its own objective."""

import numpy as np

from rrru.errors import ConfigError
from rrru.figures import choose, style

# a nanometre: no difference between mean distances is smaller in earnest
_FLOOR_MM = 1e-6


@style.printed
def convergence(tables, options):
    """Convergence of the genetic algorithm: excess of the best mean distance so far over the least one, for every
    seed, their median and quartiles; a run that has stopped keeps what it reached.
    """
    campaign = options["campaign"]
    history = choose.of_campaign(tables, "genetic_history", campaign, "convergence")
    runs = choose.of_campaign(tables, "genetic", campaign, "convergence")
    names = list(dict.fromkeys(history["calibration"]))
    missing = [name for name in names if not (runs["calibration"] == name).any()]
    if missing:
        raise ConfigError(
            f"convergence: table genetic of campaign {campaign!r} has no calibration {', '.join(missing)}"
        )
    columns = min(len(names), 2)
    rows = -(-len(names) // columns)
    figure = style.new(style.DOUBLE_MM if columns > 1 else style.SINGLE_MM, 14.0 + 55.0 * rows)
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes in grid.ravel()[len(names) :]:
        axes.set_axis_off()
    for place, (name, axes) in enumerate(zip(names, grid.ravel(), strict=False)):
        optimum = float(runs.loc[runs["calibration"] == name, "optimum_mm"].iloc[0])
        _panel(axes, history[history["calibration"] == name], optimum)
        axes.set_title(f"({chr(97 + place)}) {choose.calibration_label(name)}, optimum {optimum:.4f} mm")
        axes.tick_params(labelbottom=place + columns >= len(names))
        if place + columns >= len(names):
            axes.set_xlabel("generation")
    for row in grid:
        row[0].set_ylabel("excess over the optimum (mm)")
    style.legend_above(figure, grid.ravel()[: len(names)], columns=5 if columns > 1 else 2)
    return figure


def _panel(axes, history, optimum):
    """Every seed as a thin line, their median and quartiles; a run that has stopped keeps what it reached."""
    wide = history.pivot(index="generation", columns="seed", values="best_mm").sort_index()
    ends = history.groupby("seed")["generation"].max()
    excess = wide.where(np.isfinite(wide)).ffill() - optimum
    # a log axis has no zero: a run that has reached the optimum is drawn there
    excess = excess.clip(lower=_FLOOR_MM)
    place = excess.index.to_numpy()
    for seed in excess:
        alive = excess.index <= ends[seed]
        axes.plot(place[alive], excess.loc[alive, seed], color=style.SKY, linewidth=0.4, zorder=1, label="one seed")
        axes.plot(
            ends[seed],
            excess.loc[ends[seed], seed],
            ".",
            color=style.SKY,
            markersize=3.0,
            zorder=2,
            label="end of a run",
        )
    low, high = excess.quantile(0.25, axis=1), excess.quantile(0.75, axis=1)
    axes.fill_between(place, low, high, color=style.BLUE, alpha=0.25, linewidth=0.0, zorder=3, label="quartiles")
    axes.plot(
        place,
        excess.median(axis=1),
        color=style.BLUE,
        linewidth=1.4,
        zorder=4,
        label=f"median of {excess.shape[1]} seeds",
    )
    # generation 0, the initial population, has its place on a log axis that is linear up to 1
    axes.set_xscale("symlog", linthresh=1.0, linscale=0.3)
    axes.set_yscale("log")
    style.plain_log(axes.xaxis)
    style.plain_log(axes.yaxis)
    axes.set_xlim(0.0, None)
    axes.grid(True)
