"""The diagnosis of one campaign's gap on one page: where it lies, what causes it, and how far it shrinks."""

from textwrap import wrap

import numpy as np
from matplotlib.lines import Line2D

from rrru.errors import ConfigError
from rrru.figures import choose, gap_map, style

_BEFORE = {"color": "#777777", "marker": "o", "markerfacecolor": "white"}
_AFTER = {"color": style.BLUE, "marker": "s"}
_NOISE = style.TOLERANCE
# rows that stand below the library's effects
_APART = ("none", "unexplained")
_LEGS = {"each": "each leg", "same": "all legs alike", "1": "leg 1", "2": "leg 2", "3": "leg 3"}
_NOTHING = {"none": "nothing to add", "unexplained": "nothing in the library to add"}
# characters in a line of the headline, its height, and the height of a row of bars
_WIDE, _LINE_MM, _ROW_MM = 116, 3.7, 3.9
# width that the maps get
_MAP_MM = 74.0
# legs are named for effects at least this probable; numbers stand inside bars longer than this
_NAMED_FROM, _INSIDE_FROM = 0.05, 0.6
# more runs than this have no room for their trajectories' names, and for all their numbers
_NAMED_RUNS, _NUMBERED_RUNS = 9, 30
_KINDS = {"held_out": "held-out", "resimulated": "resimulated"}


@style.printed
def gap(tables, options):
    """The gap between the calibrated sim and the measurement. (a) Where: measured minus calibrated sim at the
    points from above and from the side, magnified as stated. (b) Why: probability of every effect, those of the
    verdict in colour. (c) How far it shrinks: gap on runs that were not fitted on, under the calibrated and the
    corrected sim, with the share closed. (d) Residual of every point.
    """
    campaign = options["campaign"]
    verdict = choose.of_campaign(tables, "gap_verdicts", campaign, "gap").iloc[0]
    causes = _ordered(choose.of_campaign(tables, "gap_attribute", campaign, "gap"))
    shrink = choose.of_campaign(tables, "gap_shrink", campaign, "gap")
    points = _sized(tables["gap_points"], campaign)
    used = points[points["used"]]
    lines = [line for text in _headline(verdict) for line in text]
    panels = _page(len(lines), len(causes), shrink["trajectory"].nunique(), used)
    _write(panels["headline"], _headline(verdict))
    worst = verdict[[f"worst_{axis}_mm" for axis in "xyz"]].to_numpy(dtype=float)
    arrows, beyond = gap_map.draw(
        {"top view": panels["top"], "side view": panels["side"]}, used, worst, options["z_down"]
    )
    bar = panels["top"].figure.colorbar(
        arrows, ax=panels["side"], location="bottom", aspect=40, fraction=0.08, extend="max" if beyond else "neither"
    )
    bar.set_label("measured minus calibrated sim (mm)")
    _causes(panels["causes"], causes, verdict)
    _shrink(panels["shrink"], shrink, verdict)
    _along(panels["along"], points, verdict)
    return panels["top"].figure


def _sized(points, campaign):
    """Points in the order driven with the sizes of both residuals; raises ConfigError where none is used."""
    if not points["used"].any():
        raise ConfigError(f"gap: campaign {campaign!r} has no point that the diagnosis used")
    sizes = {
        f"{name}_mm": np.linalg.norm(points[[f"{name}_{axis}_mm" for axis in "xyz"]].to_numpy(dtype=float), axis=1)
        for name in ("before", "after")
    }
    return points.assign(**sizes).sort_values(["run", "point"], kind="stable").reset_index(drop=True)


def _page(lines, causes, trajectories, used):
    """The empty panels by name on a figure that is as high as they need."""
    figure = style.new(style.DOUBLE_MM, 1.0)
    rows = [_ROW_MM * causes, _ROW_MM * trajectories]
    views = [_MAP_MM * gap_map.height_ratio(used, name) for name in ("top view", "side view")]
    # what stands around the panels takes part in the figure's height, not in their ratios
    heights = [_LINE_MM * lines, max(sum(rows) + 30.0, sum(views) + 36.0), 46.0]
    figure.set_size_inches(style.DOUBLE_MM / 25.4, min(sum(heights) + 4.0, 238.0) / 25.4)
    outer = figure.add_gridspec(3, 1, height_ratios=heights)
    middle = outer[1].subgridspec(1, 2, width_ratios=[1.0, 1.0])
    left, right = middle[0].subgridspec(2, 1, height_ratios=views), middle[1].subgridspec(2, 1, height_ratios=rows)
    places = {
        "headline": outer[0],
        "top": left[0],
        "side": left[1],
        "causes": right[0],
        "shrink": right[1],
        "along": outer[2],
    }
    panels = {name: figure.add_subplot(place) for name, place in places.items()}
    panels["top"].sharex(panels["side"])
    return panels


def _headline(verdict):
    """Lines of the verdict itself, and of what is to be known and done about it."""
    name = _named(verdict["effects"]) + (f", leg {verdict['leg']}" if verdict["leg"] else "")
    gap_mm = f"{style.number(verdict['gap_rms_mm'])} mm gap"
    closed = _NOTHING.get(verdict["effects"]) or _share(verdict, "of it closed")
    first = f"{name} (p {_probability(verdict['probability'], '= ', ' ')}): {gap_mm}, {closed}"
    place = ", ".join(f"{axis} {verdict[f'worst_{axis}_mm']:.0f}" for axis in "xyz").replace("-", "\N{MINUS SIGN}")
    facts = [f"noise {style.number(verdict['noise_rms_mm'])} mm", f"worst spot {place} mm"]
    facts += [f"{verdict['dropped_points']} outliers left out"] if verdict["dropped_points"] else []
    facts += [f"confusable with {_named(verdict['confusable_with'])}"] if verdict["confusable_with"] else []
    follow = wrap("; ".join(facts), _WIDE) + (
        wrap(f"next: {verdict['next_runs']}", _WIDE) if verdict["next_runs"] else []
    )
    return wrap(first, int(0.8 * _WIDE)), follow


def _write(axes, headline):
    """The headline, the verdict in bold."""
    axes.set_axis_off()
    total = sum(map(len, headline))
    row = 0
    for lines, weight in zip(headline, ("bold", "normal"), strict=True):
        for line in lines:
            place = {"transform": axes.transAxes, "ha": "left", "va": "top", "in_layout": False}
            axes.text(
                0.0, 1.0 - row / total, line, fontsize=8.5 if weight == "bold" else 7.5, fontweight=weight, **place
            )
            row += 1


def _ordered(causes):
    """Effects from the most probable on, none and unexplained below them."""
    apart = causes["effect"].isin(_APART)
    return causes.assign(apart=apart).sort_values(["apart", "probability", "effect"], ascending=[True, False, True])


def _causes(axes, causes, verdict):
    """Probability of every effect; those of the verdict in colour, with their legs."""
    rows = np.arange(len(causes)) + 0.5 * causes["apart"].to_numpy()
    chosen = causes["effect"].isin(verdict["effects"].split("+")).to_numpy()
    value = causes["probability"].to_numpy()
    axes.barh(rows, value, height=0.72, color=np.where(chosen, style.BLUE, "#bbbbbb"))
    for row, (_, cause) in zip(rows, causes.iterrows(), strict=True):
        legs = _LEGS.get(cause["legs"], cause["legs"]) if cause["probability"] >= _NAMED_FROM else ""
        untested = not (cause["apart"] or np.isfinite(cause["log_evidence"]))
        text = "not tested" if untested else _probability(cause["probability"]) + (f", {legs}" if legs else "")
        inside = cause["probability"] >= _INSIDE_FROM
        light = inside and cause["effect"] in verdict["effects"].split("+")
        look = {"ha": "right" if inside else "left", "va": "center", "fontsize": 7.0, "in_layout": False}
        axes.text(
            cause["probability"] + (-0.015 if inside else 0.015), row, text, color="white" if light else "black", **look
        )
    axes.set_yticks(rows, [_named(name) for name in causes["effect"]])
    axes.set(xlim=(0.0, 1.0), ylim=(rows[-1] + 0.6, -0.6), xlabel="probability", ylabel="effect")
    axes.tick_params(axis="y", length=0.0)
    axes.set_title("(b) what causes it")
    axes.grid(True, axis="x")


def _shrink(axes, shrink, verdict):
    """Gap of every trajectory before and after, beside the noise, with the share closed as a number."""
    kind = next(name for name in _KINDS if (shrink["kind"] == name).any())
    rows = shrink[shrink["kind"] == kind]
    first, last = (rows[rows["step"] == step].set_index("trajectory") for step in (0, rows["step"].max()))
    names = ["*"] * ("*" in first.index) + sorted((name for name in first.index if name != "*"), key=choose.natural)
    place = np.arange(len(names))
    values = [part.reindex(names)["gap_rms_mm"].to_numpy() for part in (first, last)]
    axes.axvline(verdict["noise_rms_mm"], **_NOISE)
    axes.hlines(place, *values, color="#bbbbbb", linewidth=0.9)
    axes.plot(values[0], place, linestyle="none", **_BEFORE)
    if rows["step"].max():
        axes.plot(values[1], place, linestyle="none", **_AFTER)
        texts = [_share(row) for _, row in last.reindex(names).iterrows()]
        axes.secondary_yaxis("right").set_yticks(place, texts)
        axes.text(
            1.05,
            1.035,
            "closed (95 %)",
            transform=axes.transAxes,
            ha="left",
            va="bottom",
            fontsize=7.0,
            in_layout=False,
        )
    axes.set_yticks(place, ["all" if name == "*" else choose.trajectory_label(name) for name in names])
    axes.set(
        xlim=(0.0, 1.08 * np.nanmax([*np.concatenate(values), verdict["noise_rms_mm"]])), ylim=(len(names) - 0.5, -0.5)
    )
    axes.set(xlabel=f"{_KINDS[kind]} gap, rms (mm)", ylabel="trajectory")
    axes.set_title("(c) how far it shrinks")
    axes.grid(True, axis="x")


def _along(axes, points, verdict):
    """Residual of every point in the order driven, before and after; runs are shaded in turn, points left out are
    crosses.
    """
    place = np.arange(len(points))
    used = points["used"].to_numpy(dtype=bool)
    top = 1.15 * np.nanmax([*points.loc[used, ["before_mm", "after_mm"]].to_numpy().ravel(), verdict["noise_rms_mm"]])
    middles = []
    for turn, (_, rows) in enumerate(points.groupby("run", sort=False)):
        at = rows.index.to_numpy()
        middles.append((at.mean(), rows["run"].iloc[0], choose.trajectory_label(rows["trajectory"].iloc[0])))
        if turn % 2:
            axes.axvspan(at[0] - 0.5, at[-1] + 0.5, facecolor="#f0f0f0", edgecolor="none", zorder=0)
        for column, look in (("before_mm", _BEFORE), ("after_mm", _AFTER)):
            axes.plot(at, rows[column].where(rows["used"]), color=look["color"], linewidth=0.8)
    axes.plot(place[~used], np.minimum(points["before_mm"][~used], 0.96 * top), "x", color=style.BLACK, clip_on=False)
    axes.axhline(verdict["noise_rms_mm"], **_NOISE)
    step = -(-len(middles) // _NUMBERED_RUNS)
    named = len(middles) <= _NAMED_RUNS
    axes.set_xticks(
        [at for at, *_ in middles[::step]],
        [f"{run}\n{name}" if named else f"{run}" for _, run, name in middles[::step]],
    )
    axes.set(xlim=(-0.5, len(points) - 0.5), ylim=(0.0, top), xlabel="run, in the order driven", ylabel="residual (mm)")
    axes.set_title("(d) residual along the runs")
    axes.legend(
        handles=_legend(points["after_mm"].notna().any(), not used.all()),
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=4,
        borderaxespad=0.1,
    )


def _legend(corrected, left_out):
    """What marks and lines of the lower panels are."""
    handles = [
        Line2D([], [], linestyle="-", label="calibrated sim", **_BEFORE),
        Line2D([], [], linestyle="-", label="corrected sim, held out", **_AFTER),
        Line2D([], [], label="noise, rms", **_NOISE),
        Line2D([], [], color=style.BLACK, marker="x", linestyle="none", label="left out"),
    ]
    return [handle for handle, drawn in zip(handles, (True, corrected, True, left_out), strict=True) if drawn]


def _named(effects):
    """Names of effects for reading."""
    return effects.replace("_", " ").replace("+", " + ")


def _probability(value, equals="", space=""):
    """A probability to two digits that claims no certainty."""
    return f">{space}0.99" if value > 0.995 else f"<{space}0.01" if value < 0.005 else f"{equals}{value:.2f}"


def _share(row, words=""):
    """Share closed with its interval in per cent; a dash where there is none."""
    if not np.isfinite(row["share_closed"]):
        return "–"
    value, low, high = (
        f"{100.0 * row[f'share_closed{end}']:.0f}".replace("-", "\N{MINUS SIGN}") for end in ("", "_low", "_high")
    )
    return f"{value} %{f' {words}' if words else ''} ({low} to {high})"
