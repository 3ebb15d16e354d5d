"""The diagnosis of one campaign's gap on one page: where it is largest, what causes it, and how far it shrinks.

Its maps show the gap as arrows over the workspace, a top view and a side view below it. Its budget is one stacked bar
with the intervals of its parts.
"""

import re
from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import TypeAlias, TypedDict

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.quiver import Quiver
from matplotlib.ticker import MaxNLocator

from rrru.arrays import FloatArray
from rrru.errors import ConfigError
from rrru.figures import choose, style
from rrru.figures.choose import Options, Tables

# axes by the name of their panel; lower and upper end of a bar
Panels: TypeAlias = dict[str, Axes]
_Limits: TypeAlias = tuple[float, float]

_BEFORE: style.Look = {"color": "#777777", "marker": "o", "markerfacecolor": "white"}
_AFTER: style.Look = {"color": style.BLUE, "marker": "s"}
_NOISE = style.TOLERANCE
# rows below the library's effects
_APART = ("none", "unexplained")
_NOTHING = {"none": "nothing to add", "unexplained": "nothing in the library to add"}
# characters in a line of the headline, its height, and the height of a row of bars
_WIDE, _LINE_MM, _ROW_MM = 116, 3.7, 3.9
# width that the maps get, and the most that a page is high
_MAP_MM, _MOST_MM = 74.0, 238.0
_BUDGET_MM = 16.0
# steps of the arrows' scale: more numbers run into one another
_TICKS, _FEW_TICKS = 5, 3
# legs are named for effects at least this probable; numbers stand inside bars longer than this
_NAMED_FROM, _INSIDE_FROM = 0.05, 0.6
# letters that a bar of probability 1 holds; next to a shorter one the page's margin holds as many as half of it
_BAR_LETTERS = 20
# more runs than this have no room for their trajectories' names, and for all their numbers
_NAMED_RUNS, _NUMBERED_RUNS = 9, 30
# width of the 95 % interval of a share from which the headline has no number, as in rrru.diagnosis.options
_UNDETERMINED = 0.9
# decision of rrru.diagnosis.verdict on an effect without a probability
_NOT_TESTED = "not tested"
_KINDS = {"held_out": "held-out", "resimulated": "resimulated"}
# replaces a space at which no line may end
_JOINT = "\N{NO-BREAK SPACE}"

# axes of each view
_VIEWS = {"top view": ("x", "y"), "side view": ("x", "z")}
# more arrows than this hide each other
_MOST_ARROWS = 400
# the largest arrow over the width of the view, and the size that the scale holds; single larger ones may stand out
_ARROW_SHARE, _LARGEST_PERCENT = 0.08, 99.0
_MARGIN = 0.03
# points of a path are nearer to each other than this share of the workspace
_PATH_SHARE = 0.2
_ARROW: style.Look = {"width": 0.0035, "headwidth": 3.5, "headlength": 4.0, "headaxislength": 3.5}
_RING: style.Look = {
    "color": style.VERMILION,
    "marker": "o",
    "markersize": 9.0,
    "markerfacecolor": "none",
    "markeredgewidth": 1.4,
}

# parts of the budget by kind
_KIND_COLOURS = {"scatter": "#aaaaaa", "runs": "#cccccc", "unexplained": "#d55e00", "calibration": "#eeeeee"}
_SMALL_COLOUR = "#f4f4f4"
# of the products of two parts, which complete the parts to the whole
_HATCH = "/////"
# a part of so many times the whole is cancelled by others: its size says nothing
_MOST_SHARE = 3.0
_EFFECT_COLOURS = (style.BLUE, "#56b4e9", "#009e73", "#cc79a7", "#f0e442", "#0072b2")
# parts of a smaller share are drawn together, or not named; names stand inside of parts wider than this for each letter
_LEAST_PART, _NAMED_PART, _LETTER_SHARE = 0.01, 0.03, 0.0125
# of names above and below the bar
_NAME_HEIGHTS = (0.34, -0.36)


class _DriveNames(TypedDict):
    """Names of the robot's drives, and the word for one of them."""

    drives: Sequence[str]
    noun: str


@style.printed
def gap(tables: Tables, options: Options) -> Figure:
    """The gap between the calibrated model and the measurement. On top its budget: the share of its mean square that
    each effect makes, that does not repeat, and that nothing explains, with 95 % intervals as thin lines; covariances
    of confounded parts (hatched) complete them to 1; a note is there where parts cancel each other. The probability
    in the headline is that of exactly these causes, of a group alone that one of it acts. (a) Where: measured minus
    calibrated model at the points from above and from the side, magnified as stated. (b) Why: probability of every
    effect, those of the verdict in colour, those of a group hatched. (c) Remaining gap: at points that the fit has
    not used, under the calibrated and the corrected model, with the explained fraction of its mean square; (?) where
    too few readings bound it. (d) Residual of every point.
    """
    campaign, frames = options["campaign"], {}
    for name in ("gap_verdicts", "gap_attribute", "gap_shrink", "gap_budget"):
        frames[name] = choose.of_campaign(tables, name, campaign, "gap")
    verdict, causes, shrink = frames["gap_verdicts"].iloc[0], _ordered(frames["gap_attribute"]), frames["gap_shrink"]
    words: _DriveNames = {"drives": options["drives"], "noun": options["drive_noun"]}
    points, headline = _sized(tables["gap_points"], campaign), _headline(verdict, causes, words)
    used = points[points["used"]]
    figure, panels = _page(sum(map(len, headline)), len(causes), len(_rows_of(shrink["trajectory"])), used)
    _write(panels["headline"], headline)
    draw_budget(panels["budget"], frames["gap_budget"])
    _map(figure, panels, used, verdict, options["z_down"], "(a) ")
    _causes(panels["causes"], causes, verdict, words)
    _shrink(panels["shrink"], shrink, verdict)
    _along(panels["along"], points, verdict)
    _fit_views(figure, panels, used)
    return figure


@style.printed
def gap_map(tables: Tables, options: Options) -> Figure:
    """Residual errors: measured minus calibrated model at the points, from above and from the side. An arrow
    points to where the robot really was, magnified as stated; dark is far. The ring is where the mean over neighbouring
    points is largest.
    """
    campaign = options["campaign"]
    verdict = choose.of_campaign(tables, "gap_verdicts", campaign, "gap_map").iloc[0]
    points = _sized(tables["gap_points"], campaign)
    used = points[points["used"]]
    heights = [_MAP_MM * _height_ratio(used, name) for name in _VIEWS]
    figure = style.new(style.SINGLE_MM, sum(heights) + 36.0)
    axes = figure.subplots(2, 1, height_ratios=heights)
    panels = dict(zip(_VIEWS, axes, strict=True))
    axes[0].sharex(axes[1])
    _map(figure, panels, used, verdict, options["z_down"])
    _fit_views(figure, panels, used)
    return figure


def _map(figure: Figure, panels: Panels, used: pd.DataFrame, verdict: pd.Series, z_down: bool, mark: str = "") -> None:
    """Both views of the gap with the scale of their arrows."""
    worst = verdict[[f"worst_{axis}_mm" for axis in "xyz"]].to_numpy(dtype=float)
    arrows, beyond, factor = _draw_arrows(panels, used, worst, z_down)
    panels["top view"].set_title(f"{mark}gap, magnified {factor:g} times; ring: worst region")
    place: style.Look = {"location": "bottom", "aspect": 40, "fraction": 0.08, "extend": "max" if beyond else "neither"}
    bar = figure.colorbar(arrows, ax=panels["side view"], ticks=MaxNLocator(_TICKS), **place)
    bar.set_label("measured minus calibrated model (mm)")


def _sized(points: pd.DataFrame, campaign: str) -> pd.DataFrame:
    """Points in the order driven with the sizes of both residuals; raises ConfigError where none is used."""
    if not points["used"].any():
        raise ConfigError(f"gap: campaign {campaign!r} has no point that the diagnosis used")
    for name in ("before", "after"):
        vectors = points[[f"{name}_{axis}_mm" for axis in "xyz"]].to_numpy(dtype=float)
        points = points.assign(**{f"{name}_mm": np.linalg.norm(vectors, axis=1)})
    return points.sort_values(["run", "point"], kind="stable").reset_index(drop=True)


def _page(lines: int, causes: int, trajectories: int, used: pd.DataFrame) -> tuple[Figure, Panels]:
    """A figure that is as high as its panels need, and these by name, empty."""
    rows = [_ROW_MM * causes, _ROW_MM * trajectories]
    views = [_MAP_MM * _height_ratio(used, name) for name in _VIEWS]
    # labels around the panels count in the figure's height, not in the ratios of the panels
    middle, others = max(sum(rows) + 30.0, sum(views) + 36.0), (_LINE_MM * lines, _BUDGET_MM, 46.0, 4.0)
    heights = [*others[:2], min(middle, _MOST_MM - sum(others)), others[2]]
    figure = style.new(style.DOUBLE_MM, sum(heights) + others[3])
    outer = figure.add_gridspec(4, 1, height_ratios=heights)
    sides = outer[2].subgridspec(1, 2, width_ratios=[1.0, 1.0])
    left, right = (side.subgridspec(2, 1, height_ratios=size) for side, size in ((sides[0], views), (sides[1], rows)))
    names = ("headline", "budget", *_VIEWS, "causes", "shrink", "along")
    places = (outer[0], outer[1], left[0], left[1], right[0], right[1], outer[3])
    panels = {name: figure.add_subplot(place) for name, place in zip(names, places, strict=True)}
    panels["top view"].sharex(panels["side view"])
    return figure, panels


def _headline(verdict: pd.Series, causes: pd.DataFrame, words: _DriveNames) -> tuple[list[str], list[str]]:
    """Lines of the verdict itself, and of its facts and the next step."""
    groups = {names.split(" | ")[0]: names.replace(" | ", " or ") for names in verdict["groups"].split("; ")}
    effects = verdict["effects"].split("+")
    possible = set(causes.loc[causes["decision"] == "possible", "effect"])
    nothing_named = set(effects) <= possible
    unsure = set() if nothing_named else possible
    name = _named("+".join(groups.get(one, f"possibly {one}" if one in unsure else one) for one in effects))
    name += f", {_leg(str(verdict['leg']), **words)}" if verdict["leg"] else ""
    if verdict["no_answer"]:
        return wrap(f"no cause is named: {verdict['no_answer']}", int(0.8 * _WIDE)), []
    closed = _NOTHING.get(verdict["effects"]) or _share(verdict, " explained")
    # of a group alone that one of it acts, else of exactly these
    alone = causes.loc[causes["effect"] == verdict["effects"], "group_probability"].dropna()
    sure = _probability(alone.iloc[0] if len(alone) else verdict["probability"], "= ", " ")
    if nothing_named:
        name = f"no cause named, most probable {name}"
    first = f"{name} (p {sure}): {style.number(verdict['gap_rms_mm'])} mm gap, {closed}"
    place = ", ".join(f"{axis} {verdict[f'worst_{axis}_mm']:.0f}" for axis in "xyz").replace("-", "\N{MINUS SIGN}")
    facts = [f"noise {style.number(verdict['noise_rms_mm'])} mm", f"worst region {place} mm"]
    facts += [f"{verdict['dropped_points']} outliers left out"] if verdict["dropped_points"] else []
    grouped = causes.loc[causes["decision"] == "group", "effect"].tolist()
    others = [one for one in verdict["confounded_with"].split(", ") if one and one not in grouped]
    facts += [f"not ruled out: {_named(', '.join(others))}"] if others else []
    follow = wrap("; ".join(facts), _WIDE)
    follow += wrap(f"next: {verdict['next_runs']}", _WIDE) if verdict["next_runs"] else []
    # no line ends within an interval
    joined = re.sub(r"\([^)]*\)", lambda found: found[0].replace(" ", _JOINT), first)
    return [line.replace(_JOINT, " ") for line in wrap(joined, int(0.8 * _WIDE))], follow


def _write(axes: Axes, headline: tuple[list[str], list[str]]) -> None:
    """The headline, the verdict in bold."""
    axes.set_axis_off()
    looks: tuple[style.Look, ...] = ({"fontsize": 8.5, "fontweight": "bold"}, {"fontsize": 7.5})
    lines = [(line, look) for part, look in zip(headline, looks, strict=True) for line in part]
    for row, (line, look) in enumerate(lines):
        place: style.Look = {"transform": axes.transAxes, "ha": "left", "va": "top", "in_layout": False}
        axes.text(0.0, 1.0 - row / len(lines), line, **look, **place)


def _ordered(causes: pd.DataFrame) -> pd.DataFrame:
    """Effects from the most probable on, none and unexplained below them."""
    apart = causes["effect"].isin(_APART)
    return causes.assign(apart=apart).sort_values(["apart", "probability", "effect"], ascending=[True, False, True])


def _leg(legs: str, drives: Sequence[str], noun: str) -> str:
    """Legs of an effect in words; drives: names of the robot's drives; noun: the word for one of them."""
    words = {"each": f"each {noun}", "same": f"all {noun}s alike", "": ""}
    if legs in words:
        return words[legs]
    numbers = [int(leg) for leg in legs.split(" and ")]
    return ", ".join(drives[leg - 1] if leg <= len(drives) else f"{noun} {leg}" for leg in numbers)


def _causes(axes: Axes, causes: pd.DataFrame, verdict: pd.Series, words: _DriveNames) -> None:
    """Probability of every effect; those of the verdict in colour, with their legs."""
    rows = np.arange(len(causes)) + 0.5 * causes["apart"].to_numpy()
    chosen = causes["effect"].isin(verdict["effects"].split("+")).to_numpy()
    alike = (causes["decision"] == "group").to_numpy()
    value = causes["probability"].to_numpy()
    hatched: style.Look = {"facecolor": "white", "edgecolor": style.BLUE, "hatch": "/////", "linewidth": 0.6}
    axes.barh(rows, np.nan_to_num(value), height=0.72, color=np.where(chosen, style.BLUE, "#bbbbbb"))
    axes.barh(rows[alike], value[alike], height=0.72, **hatched)
    for row, named, cause in zip(rows, chosen, causes.to_dict("records"), strict=True):
        probability, legs = cause["probability"], _leg(cause["legs"], **words)
        inside = probability >= _INSIDE_FROM
        room = _BAR_LETTERS * (probability if inside else 1.5 - probability)
        text = _probability(probability)
        if probability >= _NAMED_FROM:
            several = cause["legs"].count(" and ") + 1
            places = (legs, f"{several} {words['noun']}s" if several > 1 else "")
            text = next((f"{text}, {place}" for place in places if place and len(f"{text}, {place}") <= room), text)
        if cause["decision"] == _NOT_TESTED:
            probability, text, inside = 0.0, _NOT_TESTED, False
        look: style.Look = {"ha": "right" if inside else "left", "va": "center", "fontsize": 7.0, "in_layout": False}
        colour = "white" if inside and named and cause["decision"] != "group" else "black"
        axes.text(probability + (-0.015 if inside else 0.015), row, text, color=colour, **look)
    axes.set_yticks(rows, [_named(name) for name in causes["effect"]])
    axes.set(xlim=(0.0, 1.0), ylim=(rows[-1] + 0.6, -0.6), xlabel="probability", ylabel="effect")
    axes.tick_params(axis="y", length=0.0)
    axes.set_title("(b) what causes it")
    axes.grid(True, axis="x")


def _shrink(axes: Axes, shrink: pd.DataFrame, verdict: pd.Series) -> None:
    """Gap of every trajectory before and after, and the noise, with the explained fraction as a number."""
    kind = next(name for name in _KINDS if (shrink["kind"] == name).any())
    rows = shrink[shrink["kind"] == kind]
    first, last = (rows[rows["step"] == step].set_index("trajectory") for step in (0, rows["step"].max()))
    names = _rows_of(first.index)
    place = np.arange(len(names))
    values = [part.reindex(names)["gap_rms_mm"].to_numpy() for part in (first, last)]
    axes.axvline(verdict["noise_rms_mm"], **_NOISE)
    axes.hlines(place, *values, color="#bbbbbb", linewidth=0.9)
    axes.plot(values[0], place, linestyle="none", **_BEFORE)
    if rows["step"].max():
        axes.plot(values[1], place, linestyle="none", **_AFTER)
        axes.secondary_yaxis("right").set_yticks(place, [_share(row) for _, row in last.reindex(names).iterrows()])
        above: style.Look = {
            "transform": axes.transAxes,
            "ha": "left",
            "va": "bottom",
            "fontsize": 7.0,
            "in_layout": False,
        }
        axes.text(1.05, 1.035, "explained (95 %)", **above)
    axes.set_yticks(place, ["all" if name == "*" else choose.plain(name) for name in names])
    most = 1.08 * np.nanmax([*np.concatenate(values), verdict["noise_rms_mm"]])
    axes.set(xlim=(0.0, most), ylim=(len(names) - 0.5, -0.5))
    axes.xaxis.set_major_locator(MaxNLocator(_FEW_TICKS))
    axes.set(xlabel=f"{_KINDS[kind]} gap, rms (mm)", ylabel="trajectory")
    axes.set_title("(c) remaining gap")
    axes.grid(True, axis="x")


def _rows_of(trajectories: Iterable[str]) -> list[str]:
    """Names of the rows of panel (c): all points, "*", then each trajectory where there are several."""
    names = sorted(set(trajectories), key=lambda name: (name != "*", choose.natural(name)))
    return names if len(names) > 2 else names[:1]


def _along(axes: Axes, points: pd.DataFrame, verdict: pd.Series) -> None:
    """Residual of every point in the order driven, before and after; runs shaded in turn, points left out crossed."""
    used, noise_mm = points["used"].to_numpy(dtype=bool), verdict["noise_rms_mm"]
    top = 1.15 * np.nanmax([*points.loc[used, ["before_mm", "after_mm"]].to_numpy().ravel(), noise_mm])
    middles, labels = [], []
    runs = list(points.groupby("run", sort=False))
    for number, (run, rows) in enumerate(runs):
        at, trajectory = rows.index.to_numpy(), choose.plain(rows["trajectory"].iloc[0])
        middles.append(at.mean())
        labels.append(f"{run}\n{trajectory}" if len(runs) <= _NAMED_RUNS else f"{run}")
        if number % 2:
            axes.axvspan(at[0] - 0.5, at[-1] + 0.5, facecolor="#f0f0f0", edgecolor="none", zorder=0)
        for column, look in (("before_mm", _BEFORE), ("after_mm", _AFTER)):
            axes.plot(at, rows[column].where(rows["used"]), color=look["color"], linewidth=0.8)
    out = points.index[~used]
    # an empty line that is not clipped counts as one at the page's corner, and the layout makes room for it
    if len(out):
        axes.plot(out, np.minimum(points["before_mm"][out], 0.96 * top), "x", color=style.BLACK, clip_on=False)
    axes.axhline(noise_mm, **_NOISE)
    step = -(-len(runs) // _NUMBERED_RUNS)
    axes.set_xticks(middles[::step], labels[::step])
    axes.set(xlim=(-0.5, len(points) - 0.5), ylim=(0.0, top), xlabel="run, in the order driven", ylabel="residual (mm)")
    axes.set_title("(d) residual along the runs")
    place: style.Look = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": 4, "borderaxespad": 0.1}
    axes.legend(handles=_legend(points["after_mm"].notna().any(), not used.all()), **place)


def _legend(corrected: bool, left_out: bool) -> list[Line2D]:
    """What marks and lines of the lower panels are."""
    handles = [Line2D([], [], linestyle="-", label="calibrated model", **_BEFORE)]
    if corrected:
        handles.append(Line2D([], [], linestyle="-", label="corrected model, held out", **_AFTER))
    handles.append(Line2D([], [], label="noise, rms", **_NOISE))
    if left_out:
        handles.append(Line2D([], [], color=style.BLACK, marker="x", linestyle="none", label="left out"))
    return handles


def _named(effects: str) -> str:
    """Names of effects for reading."""
    return effects.replace("_", " ").replace("+", " + ")


def _probability(value: float, equals: str = "", space: str = "") -> str:
    """A probability to two digits that claims no certainty."""
    return f">{space}0.99" if value > 0.995 else f"<{space}0.01" if value < 0.005 else f"{equals}{value:.2f}"


def _share(row: pd.Series, words: str = "") -> str:
    """Explained fraction with its interval in per cent; a dash where there is none, (?) where nothing bounds it."""
    shares = [row[f"share_closed{end}"] for end in ("", "_low", "_high")]
    if not np.isfinite(shares[0]):
        return "–"
    # an estimate below zero of what may be above it says as little as an interval of all shares
    below = shares[0] < 0.0 < shares[2]
    open_ended = below or min(shares[2], 1.0) - max(shares[1], 0.0) >= _UNDETERMINED
    if words and open_ended:
        return "explained fraction not determined"
    if below:
        return "?"
    value, low, high = (f"{100.0 * share:.0f}".replace("-", "\N{MINUS SIGN}") for share in shares)
    if not np.isfinite(shares).all():
        return f"{value} %{words}"
    interval = "?" if open_ended else f"{'95 %: ' if words else ''}{low} to {high}"
    return f"{value} %{words} ({interval})"


def _shades() -> ListedColormap:
    """Colours of the arrows: viridis without its light end, dark for large gaps."""
    return ListedColormap(colormaps[style.MEASURE](np.linspace(0.85, 0.0, 256)))


def _height_ratio(points: pd.DataFrame, view: str) -> float:
    """Height over width of a view."""
    low, high = _limits(points, _VIEWS[view])
    return float(max((high[1] - low[1]) / (high[0] - low[0]), 0.3))


def _draw_arrows(
    panels: Panels, points: pd.DataFrame, worst: FloatArray, z_down: bool = True
) -> tuple[Quiver, bool, float]:
    """Draw both views into axes by name.

    Returns the arrows, whether some are larger than the scale holds, and how much they are magnified.

    points: rows of gap_points that are used, with `before_mm`; worst (3,); z_down: the robot frame's z points down.
    """
    size = points["before_mm"].to_numpy()
    largest = max(float(np.percentile(size, _LARGEST_PERCENT)), 1e-9) if len(size) else 1.0
    scale = Normalize(0.0, largest)
    span = max(np.ptp(points[f"command_{axis}_mm"]) for axis in "xyz")
    factor = style.magnification(np.array([largest]), span, _ARROW_SHARE)
    shown = _thinned(points)
    for name, plane in _VIEWS.items():
        arrows = _view(panels[name], points, shown, plane, scale, factor, z_down)
        panels[name].plot(*worst[["xyz".index(axis) for axis in plane]], linestyle="none", zorder=6, **_RING)
    panels["top view"].tick_params(labelbottom=False)
    panels["side view"].set_xlabel("x (mm)")
    return arrows, bool((size > largest * (1.0 + 1e-9)).any()), factor


def _fit_views(figure: Figure, panels: Panels, points: pd.DataFrame) -> None:
    """Widen the views where the page is too low for them, so that both hold all points."""
    engine, needed = figure.get_layout_engine(), []
    style.arrange(figure)
    for name, plane in _VIEWS.items():
        (low, high), box = _limits(points, plane), panels[name].get_window_extent()
        needed.append((high[1] - low[1]) / (high[0] - low[0]) * box.width / box.height)
    widen = max(needed)
    if widen > 1.0:
        # other numbers at the axes take other room
        figure.set_layout_engine(engine)
        panels["side view"].set_xlim(0.5 * ((high + low)[0] + widen * (high - low)[0] * np.array([-1.0, 1.0])))


def _view(
    axes: Axes,
    points: pd.DataFrame,
    shown: pd.DataFrame,
    plane: tuple[str, str],
    scale: Normalize,
    factor: float,
    z_down: bool,
) -> Quiver:
    """One view: the paths as grey lines, the gap's part in the plane as arrows coloured by its size in space.

    Lines between poses in no order would show nothing and hide the arrows.
    """
    across, up = (f"command_{axis}_mm" for axis in plane)
    span = max(np.ptp(points[f"command_{axis}_mm"]) for axis in "xyz") if len(points) else 0.0
    for _, run in points.groupby("run", sort=False):
        place = run[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy(dtype=float)
        steps = np.linalg.norm(np.diff(place, axis=0), axis=1)
        # several reflectors are read at one stop
        steps = steps[steps > 0.0]
        if len(steps) and np.median(steps) < _PATH_SHARE * span:
            axes.plot(run[across], run[up], color="#cccccc", linewidth=0.5, zorder=1)
    columns = (across, up, *(f"before_{axis}_mm" for axis in plane), "before_mm")
    size: style.Look = {"angles": "xy", "scale_units": "xy", "scale": 1.0 / factor, "cmap": _shades(), "norm": scale}
    arrows = axes.quiver(*shown[list(columns)].to_numpy().T, **size, **_ARROW, zorder=3)
    low, high = _limits(points, plane)
    # the views share x, so that what is left of a panel's height widens y
    axes.update_datalim([low, high])
    axes.set(xlim=(low[0], high[0]), aspect="equal", adjustable="datalim")
    if plane[1] == "z":
        style.height_axis(axes, z_down)
    else:
        axes.set_ylabel(f"{plane[1]} (mm)")
    axes.grid(True)
    return arrows


def _limits(points: pd.DataFrame, plane: tuple[str, str]) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner (2,) of a view, with a margin for the arrows."""
    place = points[[f"command_{axis}_mm" for axis in plane]].to_numpy(dtype=float)
    span = max(np.ptp(points[f"command_{axis}_mm"]) for axis in "xyz") if len(points) else 1.0
    margin = (_MARGIN + _ARROW_SHARE) * max(span, 1.0)
    return (place.min(axis=0) - margin, place.max(axis=0) + margin) if len(place) else (np.zeros(2), np.ones(2))


def _thinned(points: pd.DataFrame) -> pd.DataFrame:
    """Every n-th point of each run, large gaps last so that they lie on top."""
    step = max(-(-len(points) // _MOST_ARROWS), 1)
    place = points.groupby("run", sort=False).cumcount()
    return points[place % step == 0].sort_values("before_mm", kind="stable")


def draw_budget(axes: Axes, rows: pd.DataFrame) -> None:
    """Parts of `gap_budget` one after the other: effects by share, then what does not repeat, runs and the unknown.

    A thin line in each part is its 95 % interval, counted from the part's beginning. Covariances of parts (hatched)
    complete them to 1; negative ones extend to the left of 0. Parts below 1 % are one part. Where parts are many times
    the whole, a note says so.
    """
    parts = rows[~rows["kind"].isin(["covariance", "sampling"])]
    large = parts["share"] > _LEAST_PART
    shown, small = parts[large], float(parts.loc[~large, "share"].sum())
    effects = shown[shown["kind"] == "effect"].sort_values("share", ascending=False)
    others = [part for kind in _KIND_COLOURS for part in shown[shown["kind"] == kind].to_dict("records")]
    covariance = float(rows.loc[rows["kind"] == "covariance", "share"].sum())
    if shown["share"].max() > _MOST_SHARE:
        text = "no shares: parts that cancel each other are many times as large as the gap"
        axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center")
        axes.set_axis_off()
        return
    limits = min(covariance, 0.0), max(parts["share"].sum() + max(covariance, 0.0), 1.0)
    # names that a part has no place for, from left to right, and its middle
    names: list[tuple[str, float]] = []
    if covariance < 0.0:
        names += _covariance(axes, covariance, 0.0)
    start = 0.0
    for number, part in enumerate([*effects.to_dict("records"), *others]):
        colour = _KIND_COLOURS.get(part["kind"], _EFFECT_COLOURS[number % len(_EFFECT_COLOURS)])
        axes.barh(0.0, part["share"], left=start, height=0.6, color=colour, edgecolor="white", linewidth=0.6)
        low, high = (start + max(part[name], 0.0) for name in ("share_low", "share_high"))
        # one below the other, where they overlap
        axes.plot([low, high], [-0.12 - 0.05 * (number % 4)] * 2, color="black", linewidth=0.7, solid_capstyle="butt")
        text = f"{part['part'].replace('_', ' ')} {100.0 * part['share']:.0f} %"
        middle = start + 0.5 * part["share"]
        if part["share"] > _width(text, limits):
            ink = "white" if colour == style.BLUE else "black"
            axes.text(middle, 0.1, text, ha="center", va="center", fontsize=7.0, color=ink, in_layout=False)
        elif part["share"] > _NAMED_PART:
            names.append((text, middle))
        start += part["share"]
    if small > 0.0:
        axes.barh(0.0, small, left=start, height=0.6, color=_SMALL_COLOUR, edgecolor="white", linewidth=0.6)
        names += [(f"small parts {100.0 * small:.0f} %", start + 0.5 * small)] if small > _NAMED_PART else []
        start += small
    if covariance > 0.0:
        names += _covariance(axes, covariance, start)
    _write_names(axes, names, limits)
    axes.set(xlim=limits, ylim=(-0.75, 0.75), yticks=[])
    axes.set(xlabel="share of the gap's mean square", ylabel="budget")
    for side in ("left", "right", "top"):
        axes.spines[side].set_visible(False)


def _width(text: str, limits: _Limits) -> float:
    """Width of a text over a bar between limits, in shares."""
    return _LETTER_SHARE * len(text) * (limits[1] - limits[0])


def _write_names(axes: Axes, names: Sequence[tuple[str, float]], limits: _Limits) -> None:
    """Write names above or below the middles of their parts, where no other one is, within the limits of the bar.

    Each is as far to the right as those before it need, then as far to the left as those after it need.
    """
    lines: dict[float, list[tuple[str, float]]] = {height: [] for height in _NAME_HEIGHTS}
    ends = dict.fromkeys(_NAME_HEIGHTS, limits[0])
    for text, middle in names:
        wanted = max(min(middle - 0.5 * _width(text, limits), limits[1] - _width(text, limits)), limits[0])
        height = min(ends, key=lambda one: max(ends[one] - wanted, 0.0))
        lines[height].append((text, max(wanted, ends[height])))
        ends[height] = lines[height][-1][1] + _width(text, limits)
    for height, line in lines.items():
        end = limits[1]
        for text, left in reversed(line):
            end = min(left, end - _width(text, limits))
            side = "bottom" if height > 0.0 else "top"
            axes.text(end, height, text, ha="left", va=side, fontsize=7.0, in_layout=False)


def _covariance(axes: Axes, share: float, start: float) -> list[tuple[str, float]]:
    """Draw the covariances of all parts, whose shares sum up to `share`, as one part from `start` on; its name, if any,
    and its middle.
    """
    if abs(share) <= _LEAST_PART:
        return []
    look: style.Look = {"facecolor": "white", "edgecolor": "#777777", "hatch": _HATCH, "linewidth": 0.6}
    axes.barh(0.0, share, left=start, height=0.6, **look)
    if abs(share) <= _NAMED_PART:
        return []
    return [(f"covariance {100.0 * share:.0f} %".replace("-", "\N{MINUS SIGN}"), start + 0.5 * share)]
