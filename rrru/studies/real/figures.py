"""Figures of real machines: models of arms step by step with the budget of the gap, waves of every joint, and frames of
machines with measured lengths without and with the effects of the verdict.
"""

from textwrap import fill

import numpy as np
from matplotlib.ticker import LogLocator

from rrru.figures import style

_OURS = {"color": style.BLUE, "marker": "s"}
_OTHERS = {"color": style.VERMILION, "marker": "D", "markerfacecolor": "white", "linestyle": "none"}
_KINDS = {"effect": style.BLUE, "unexplained": style.VERMILION}
# heights of a row, of a joint's panel where there are few and where there are many; least number of many
_ROW_MM, _JOINT_MM, _LOW_MM, _MANY = 56.0, 36.0, 24.0, 8
# characters in a line of a panel's title, by number of panels in a row
_LINE = {1: 110, 2: 54, 3: 34}
_LEAST = 0.005
NOTHING = "no usable file of this set was found"
_MICRORAD = 1e6
_BARE = {"color": style.VERMILION, "marker": "D", "markerfacecolor": "white"}
_FOUND = {"color": style.BLUE, "marker": "s"}
_PLACES = {"linestyle": "none", "markersize": 1.6, "markeredgewidth": 0.4}
_COLOURS = (style.BLUE, style.ORANGE, style.VERMILION, style.SKY, style.BLACK, style.GREY)
_MARKERS = ("o", "s", "^", "D", "v", "x")
_MACHINE_MM = 68.0


@style.printed
def steps(tables, options):
    """Real robot, a row per series. Left: held-out residuals of the models, our fits, published fits of the same
    models, and last the model of the named causes. a: frames, b: + geometry, c: + compliance of the drives, c2: across
    the joints, c3: of a trunk, d: + two harmonics of the drives, e: + drift of the base. Right: budget of the gap, with
    95 % intervals; correlated parts may sum to more than the whole gap.
    """
    verdicts, models, budget = (tables[name] for name in ("real_verdicts", "real_steps", "real_budget"))
    # refused series have nothing to draw
    verdicts = verdicts[verdicts["campaign"].isin(models["campaign"])]
    if verdicts.empty:
        return style.note(f"{options['set']}: {NOTHING}")
    figure = style.new(style.DOUBLE_MM, 8.0 + _ROW_MM * len(verdicts))
    panels = figure.subplots(len(verdicts), 2, squeeze=False, width_ratios=(1.2, 1.0))
    for row, (left, right) in zip(verdicts.to_dict("records"), panels, strict=True):
        _draw_models(left, models[models["campaign"] == row["campaign"]], row)
        _draw_budget(right, budget[budget["campaign"] == row["campaign"]])
        verdict = row["effects"].replace("_", " ").replace("+", " + ")
        verdict += f", p = {row['probability']:.2f}" if np.isfinite(row["probability"]) else ""
        left.set_title(f"{row['campaign']}\n{fill(verdict, _LINE[2])}", fontsize=7.0)
    return figure


def _draw_models(axes, own, row):
    """Held-out rms of the models."""
    axes.plot(own["model"], own["held_out_rms_mm"], label="held-out rows", **_OURS)
    known = {model: row[f"reference_{model}_rms_mm"] for model in "abcde"}
    known = {model: value for model, value in known.items() if np.isfinite(value) and model in set(own["model"])}
    if known:
        axes.plot([*known], [*known.values()], label="published fit", **_OTHERS)
    axes.set(yscale="log", ylabel="rms (mm)", xlabel="model")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 5.0, 7.0)))
    style.plain_log(axes.yaxis)
    axes.grid(True)
    axes.legend()


def _draw_budget(axes, rows):
    """Parts of a budget as bars with their intervals, the largest on top."""
    shown = rows[(rows["share"] > _LEAST) & ~rows["kind"].isin(["covariance", "sampling"])]
    if shown.empty:
        axes.set_axis_off()
        axes.text(0.5, 0.5, "no budget", ha="center", va="center", transform=axes.transAxes)
        return
    shown = shown.sort_values("share", kind="stable")
    names = [part.replace("_", " ") for part in shown["part"]]
    places = np.arange(len(shown))
    axes.barh(places, 100.0 * shown["share"], color=[_KINDS.get(kind, "#aaaaaa") for kind in shown["kind"]], height=0.6)
    low, high = (100.0 * shown[name] for name in ("share_low", "share_high"))
    axes.hlines(places, low.clip(lower=0.0), high, color=style.BLACK, linewidth=0.7)
    axes.set_yticks(places, names)
    # keeps the thickness of bars for one or two parts, at the top
    axes.set_ylim(min(len(shown) - 3, 0) - 0.6, len(shown) - 0.4)
    axes.set_xlim(left=0.0)
    axes.set(xlabel="share of the gap's mean square (%)")
    axes.grid(True, axis="x")


@style.printed
def spectrum(tables, options):
    """Waves of every joint's angle in a real arm, a column per series: amplitude of a single wave fitted to the
    residuals of the calibrated model (before) and of the model of the named causes (after). Bars: estimated error
    function of the joint. Orders closer than the resolution are not distinguishable.
    """
    waves = tables["real_spectrum"]
    if waves.empty:
        return style.note(f"{options['set']}: {NOTHING}")
    names, joints = (list(dict.fromkeys(waves[name])) for name in ("campaign", "joint"))
    row_mm = _LOW_MM if len(joints) > _MANY else _JOINT_MM
    figure = style.new(style.DOUBLE_MM, 16.0 + row_mm * len(joints))
    panels = figure.subplots(len(joints), len(names), squeeze=False, sharex=True, sharey="row")
    for column, name in enumerate(names):
        for axes, joint in zip(panels[:, column], joints, strict=True):
            _draw_waves(axes, waves[(waves["campaign"] == name) & (waves["joint"] == joint)])
        panels[0, column].set_title(fill(name.replace("_", " "), _LINE.get(len(names), 20)))
        panels[-1, column].set_xlabel("waves per turn")
    for axes, joint in zip(panels[:, 0], joints, strict=True):
        axes.set_ylabel(f"{joint}\n(µrad)")
        axes.set_ylim(bottom=0.0)
    style.legend_above(figure, panels.ravel(), columns=3)
    return figure


def _draw_waves(axes, own):
    """Amplitudes of one joint over the orders, with the resolution in the corner."""
    if own["found_rad"].any():
        axes.bar(own["order"], _MICRORAD * own["found_rad"], color="#cccccc", label="found function")
    axes.plot(own["order"], _MICRORAD * own["before_rad"], color=style.VERMILION, label="before")
    axes.plot(own["order"], _MICRORAD * own["after_rad"], color=style.BLUE, label="after")
    for resolution in own["resolution"].head(1):
        place = {"transform": axes.transAxes, "ha": "right", "va": "top", "fontsize": 7.0, "in_layout": False}
        axes.text(0.98, 0.95, f"resolution {resolution:.1f}", **place)
    axes.grid(True)


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
    figure = style.new(style.DOUBLE_MM, 14.0 + _MACHINE_MM * len(names))
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
