"""Figures of the diagnosis' performance where the answer was withheld from it."""

import numpy as np
from matplotlib.colors import PowerNorm
from matplotlib.patches import Rectangle
from matplotlib.ticker import MultipleLocator

from rrru.errors import ConfigError
from rrru.figures import style
from rrru.studies.blind_validation.summary import BIN_EDGES, causes_calibration_error, counted, wilson
from rrru.studies.blind_validation.verdicts import AS_ROBOTS_ARE, PLANTS, PREFIX, UNEXPLAINED, is_outside

NONE, OUTSIDE, SEVERAL = "none", "outside the library", "two or more"
_CHECKS = {
    "label": ("label withheld", style.LINES),
    "effect": ("effect withheld", style.SPIRAL),
    "noise": ("noise not as stated", {"color": style.SKY, "marker": "v", "linestyle": (0, (4, 2, 1, 2))}),
    "background": ("axis errors in all", {"color": style.GREY, "marker": "P", "linestyle": (0, (1, 2))}),
    "mujoco": ("driven by MuJoCo", style.LINES),
    "own": ("the same, own plant", style.SPIRAL),
    "many": ("many causes", {"color": style.BLACK, "marker": "x", "linestyle": (0, (6, 2))}),
    AS_ROBOTS_ARE: ("as robots are", {"color": style.VERMILION, "marker": "D", "linestyle": (0, (3, 1, 1, 1))}),
    "field": ("field campaigns", style.PUBLISHED),
}
# checks whose parts are shown, and looks of the parts' kinds
_PARTED = ("many", "noise", AS_ROBOTS_ARE)
_KINDS = {
    "effect": ("an effect", {"color": style.BLUE, "marker": "s"}),
    "background": ("axis errors", {"color": style.GREY, "marker": "P"}),
    "scatter": ("non-repeatability", {"color": style.ORANGE, "marker": "^"}),
    "runs": ("offsets per run", {"color": style.VERMILION, "marker": "D"}),
    "unexplained": ("unexplained", {"color": style.BLACK, "marker": "o"}),
}
# parts below this (mm) are drawn on the edge
_LEAST_MM = 0.003
_STRENGTH_EDGES = np.array([0.1, 0.3, 0.6, 1.0, 1.5, 3.0, 6.0, 12.0, 25.0, 50.0, 100.0])
_NO_GAP = 0.01
# panels per row and row height; heights of the counts per bin, of their sum, and of the upper edge
_PER_LINE, _LINE_MM = 3, 72.0
_COUNTS_AT, _ERROR_AT, _TOP = 1.08, 1.36, 1.52
# explained fractions below this are drawn on the edge
_LOWEST_CLOSED = -0.2
_EVEN = {"color": style.GREY, "linewidth": 0.8, "linestyle": (0, (4, 2)), "zorder": 1}
_FRAME = {"facecolor": "none", "edgecolor": style.ORANGE, "linewidth": 0.9}
_ORACLE = {"color": style.BLACK, "marker": "o", "markerfacecolor": "white", "linestyle": (0, (1, 1))}


@style.printed
def withheld_plants(tables, options):
    """Robots of files with the same causes, simulated by MuJoCo and by our own plant with the effect models of the
    diagnosis. Confusion tables; share of correct verdicts against the gap over the noise; explained fraction of the gap
    as predicted against its true value. Last the parts of the gaps, found against true, filled where the verdict names
    them.
    """
    return _check(tables, PLANTS, PLANTS)


@style.printed
def withheld(tables, options):
    """The diagnosis where the answer was withheld. Confusion tables: counts, shaded by their share of the row, correct
    answers framed. For the effect check, the row is the effect that was removed from the library. Unexplained counts
    alone or together with a name. Then the share of correct verdicts against the gap over the noise, and that of a test
    with the true effect model (1 % false alarms), with 95 % intervals. Next to it the explained fraction of the gap as
    predicted against its true value. Last the parts of gaps with many causes or with noise that is not as stated: found
    against true, filled where the verdict names them (non-repeatability and offsets per run: where their probability
    exceeds 0.5). The dotted lines mark errors of 25 %; missed and false parts lie on the edges.
    """
    return _check(tables, [name for name in _CHECKS if name not in PLANTS], _PARTED)


@style.printed
def withheld_causes(tables, options):
    """Reliability diagram of each check: how often causes act that have a stated probability, with 95 % intervals.
    Above it the number of statements in each bin, their sum and the expected calibration error. Each statement is about
    a single cause of a robot, named or not. Causes with a gap below half of the noise are left out.
    """
    stated = {name: counted(tables["withheld_causes"].query("check == @name")) for name in _CHECKS}
    stated = {name: causes for name, causes in stated.items() if len(causes)}
    if not stated:
        raise ConfigError("withheld: table withheld_causes has no statement")
    columns = min(len(stated), _PER_LINE)
    lines = -(-len(stated) // columns)
    figure = style.new(style.DOUBLE_MM, _LINE_MM * lines + 8.0)
    grid = figure.add_gridspec(lines, columns)
    for place, mark, (name, causes) in zip(grid, "abcdefghi", stated.items(), strict=False):
        axes = figure.add_subplot(place)
        _reliability(axes, causes, _CHECKS[name][1])
        axes.set_title(f"({mark}) {_CHECKS[name][0]}")
    return figure


def _check(tables, checks, parted):
    """The figure of the checks, with the parts of the gaps of the checks in `parted` below."""
    scores, confusion = tables["withheld_scores"], tables["withheld_confusion"]
    checks = [name for name in checks if (scores["check"] == name).any()]
    if not checks:
        raise ConfigError("withheld: table withheld_scores has no robot")
    parted = [name for name in parted if (tables["withheld_parts"]["check"] == name).any()]
    cells = _cells(confusion[confusion["check"].isin(checks[:2])])
    names = sorted({*cells["row"], *cells["column"]} - {NONE, UNEXPLAINED, OUTSIDE, SEVERAL})
    maps = [_map(cells[cells["check"] == name], names) for name in checks[:2]]
    heights = [4.1 * max(len(counts) for counts in maps) + 38.0, 58.0, *([58.0] if parted else [])]
    figure = style.new(style.DOUBLE_MM, sum(heights) + 8.0)
    parts = figure.add_gridspec(len(heights), 1, height_ratios=heights)
    marks = iter("abcdefgh")
    for place, name, counts in zip(parts[0].subgridspec(1, len(maps)), checks, maps, strict=False):
        axes = figure.add_subplot(place)
        _confusion(axes, counts, name == "effect")
        axes.set_title(f"({next(marks)}) robots, {_CHECKS[name][0]}")
    panels = [figure.add_subplot(part) for part in parts[1].subgridspec(1, 2)]
    for axes, draw in zip(panels, (_strength, _closed), strict=True):
        draw(axes, scores, checks)
        axes.set_title(f"({next(marks)}) {axes.get_title(loc='left')}")
        axes.yaxis.set_major_locator(MultipleLocator(0.2))
        axes.grid(True)
    style.legend_above(figure, panels, columns=4)
    if parted:
        below = [figure.add_subplot(part) for part in parts[2].subgridspec(1, len(parted))]
        for axes, name in zip(below, parted, strict=True):
            _parts(axes, tables["withheld_parts"].query("check == @name"))
            axes.set_title(f"({next(marks)}) parts, {_CHECKS[name][0]}")
        style.legend_above(figure, below, columns=6, side="lower")
    return figure


def _truth(truth, check):
    """The row of a truth: one effect (of the effect check: the one taken out), none, outside, or several."""
    if check == "effect":
        truth = truth.removeprefix(f"{PREFIX}:")
    return OUTSIDE if is_outside(truth) else SEVERAL if "+" in truth else truth


def _verdict(verdict):
    """The column of a verdict; a verdict with unexplained counts as that, whatever else it names."""
    names = verdict.split("+")
    return UNEXPLAINED if UNEXPLAINED in names else SEVERAL if len(names) > 1 else verdict


def _cells(confusion):
    """The confusion table with the row and the column of the figure that each entry counts in."""
    pairs = zip(confusion["truth"], confusion["check"], strict=True)
    return confusion.assign(row=[_truth(*pair) for pair in pairs], column=confusion["verdict"].map(_verdict))


def _map(cells, names):
    """Robots by row and column of one check, single effects first."""
    counts = cells.pivot_table("robots", "row", "column", "sum", fill_value=0)
    rows = [name for name in (*names, OUTSIDE, NONE, SEVERAL) if name in counts.index]
    return counts.reindex(index=rows, columns=[*names, UNEXPLAINED, NONE, SEVERAL], fill_value=0)


def _confusion(axes, counts, withheld_effect):
    """Confusion table as a heat map of each row's shares, with counts; the correct answers are framed."""
    table, rows, columns = counts.to_numpy(), list(counts.index), list(counts.columns)
    share = table / np.maximum(table.sum(axis=1, keepdims=True), 1)
    axes.imshow(share, cmap=style.SEQUENTIAL, norm=PowerNorm(0.6, 0.0, 1.0), aspect="auto", interpolation="none")
    for (row, column), count in np.ndenumerate(table):
        if count:
            color = "white" if share[row, column] > 0.45 else "black"
            axes.text(column, row, f"{count}", ha="center", va="center", fontsize=7.0, color=color, in_layout=False)
    axes.set_xticks(range(len(columns)), [name.replace("_", " ") for name in columns], rotation=90)
    axes.set_yticks(range(len(rows)), [name.replace("_", " ") for name in rows])
    axes.tick_params(length=0.0)
    axes.set(xlabel="verdict", ylabel="truth")
    axes.axvline(len(columns) - 3.5, color=style.GREY, linewidth=0.6)
    for row, name in enumerate(rows):
        right = UNEXPLAINED if withheld_effect or name == OUTSIDE else name
        if right != SEVERAL:
            corner = (columns.index(right) - 0.5, row - 0.5)
            axes.add_patch(Rectangle(corner, 1.0, 1.0, clip_on=False, zorder=3, **_FRAME))


def _reliability(axes, causes, look):
    """How often causes act against their stated probability, with the number of statements in each bin."""
    axes.plot([0.0, 1.0], [0.0, 1.0], **_EVEN)
    _shares(axes, causes.assign(acts=causes["acts"].astype(bool)), ("probability", "acts"), BIN_EDGES, None, look)
    number, _ = np.histogram(causes["probability"], BIN_EDGES)
    for middle, count in zip((BIN_EDGES[1:] + BIN_EDGES[:-1]) / 2.0, number, strict=True):
        axes.text(middle, _COUNTS_AT, f"{count}", rotation=90, ha="center", va="bottom", fontsize=7.0)
    error = causes_calibration_error(causes["probability"], causes["acts"])
    counts = f"{len(causes)} statements, error {error:.3f}"
    axes.text(0.5, _ERROR_AT, counts, ha="center", va="bottom", fontsize=7.0)
    axes.set(xlabel="stated probability", ylabel="share that acts", xlim=(-0.03, 1.03), ylim=(-0.05, _TOP))
    axes.xaxis.set_major_locator(MultipleLocator(0.2))
    axes.set_yticks(np.linspace(0.0, 1.0, 6))
    axes.grid(True)


def _strength(axes, scores, checks):
    """Shares of correct verdicts and of detectable effects against the gap over the noise."""
    # a cause that the calibration absorbs leaves no gap
    scores = scores[scores["strength"] > _NO_GAP]
    for name in checks:
        _shares(axes, scores[scores["check"] == name], ("strength", "right"), _STRENGTH_EDGES, *_CHECKS[name])
    if checks[0] != "field":
        # the true effect model of a field campaign is not known
        label = f"detected with the true effect model, {_CHECKS[checks[0]][0]}"
        _shares(
            axes, scores[scores["check"] == checks[0]], ("strength", "oracle_detects"), _STRENGTH_EDGES, label, _ORACLE
        )
    axes.set(xscale="log", xlabel="gap over noise, rms", ylabel="share of robots", ylim=(-0.03, 1.03))
    style.short_log(axes.xaxis)
    axes.set_title("correct verdicts, by strength of the gap")


def _closed(axes, scores, checks):
    """Explained fraction of the gap: predicted against true."""
    axes.plot([_LOWEST_CLOSED, 1.0], [_LOWEST_CLOSED, 1.0], **_EVEN)
    for name in checks:
        rows = scores[scores["check"] == name].dropna(subset=["share_closed", "share_closed_true"])
        label, look = _CHECKS[name]
        values = rows[["share_closed_true", "share_closed"]].clip(_LOWEST_CLOSED, 1.0).to_numpy()
        axes.plot(*values.T, label=label, **(look | {"linestyle": "none", "markersize": 2.4, "markeredgewidth": 0.5}))
    edges = (_LOWEST_CLOSED - 0.04, 1.04)
    axes.set(xlabel="true explained fraction", ylabel="predicted explained fraction", xlim=edges, ylim=edges)
    axes.xaxis.set_major_locator(MultipleLocator(0.2))
    axes.set_title("explained fraction of the gap")


def _parts(axes, parts):
    """Found against true sizes of parts, filled where the verdict names them."""
    parts = parts[(parts["kind"] != "outside") & (parts[["true_rms_mm", "found_rms_mm"]].max(axis=1) > _LEAST_MM)]
    for kind, (label, look) in _KINDS.items():
        for named, face in ((True, look["color"]), (False, "white")):
            rows = parts[(parts["kind"] == kind) & (parts["named"] == named)]
            place = rows[["true_rms_mm", "found_rms_mm"]].clip(_LEAST_MM).to_numpy()
            sizes = {"markersize": 3.0, "markeredgewidth": 0.6, "markerfacecolor": face}
            axes.plot(*place.T, label=label if named else None, linestyle="none", **look, **sizes)
    largest = 1.5 * parts[["true_rms_mm", "found_rms_mm"]].to_numpy().max(initial=_LEAST_MM)
    edges = np.array([0.8 * _LEAST_MM, largest])
    axes.plot(edges, edges, **_EVEN)
    for factor in (0.75, 1.25):
        axes.plot(edges, factor * edges, **(_EVEN | {"linestyle": (0, (1, 2))}))
    axes.set(xscale="log", yscale="log", xlim=edges, ylim=edges, xlabel="true part (mm)", ylabel="found part (mm)")
    for axis in (axes.xaxis, axes.yaxis):
        style.short_log(axis)
    axes.grid(True)


def _shares(axes, rows, columns, edges, label, look):
    """Share of hits in each bin at the bin's mean value, with its 95 % Wilson interval; columns: value and hit."""
    value, hit = columns
    bins = rows.groupby(np.clip(np.digitize(rows[value], edges) - 1, 0, len(edges) - 2))
    if not len(bins):
        return
    x, hits = bins[value].mean(), bins[hit].agg(["sum", "count"])
    low, high = np.transpose([wilson(*counted) for counted in hits.to_numpy()])
    axes.vlines(x, low, high, color=look["color"], linewidth=0.7)
    axes.plot(x, hits["sum"] / hits["count"], label=label, **(look | {"markersize": 3.6}))
