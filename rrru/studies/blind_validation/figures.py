"""How good the diagnosis is where the answer was withheld from it."""

import numpy as np
from matplotlib.colors import PowerNorm
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator, MultipleLocator

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
    "scatter": ("scatter", {"color": style.ORANGE, "marker": "^"}),
    "runs": ("offsets of runs", {"color": style.VERMILION, "marker": "D"}),
    "unexplained": ("unexplained", {"color": style.BLACK, "marker": "o"}),
}
# parts below this (mm) are drawn on the edge
_LEAST_MM = 0.003
_STRENGTH_EDGES = np.array([0.1, 0.3, 0.6, 1.0, 1.5, 3.0, 6.0, 12.0, 25.0, 50.0, 100.0])
_NO_GAP = 0.01
# panels of reliability in a row, and its height; above the shares numbers of statements in bins, their sum, the edge
_PER_LINE, _LINE_MM = 3, 72.0
_COUNTS_AT, _ERROR_AT, _TOP = 1.08, 1.36, 1.52
# shares closed below this are drawn on the edge
_LOWEST_CLOSED = -0.2
_EVEN = {"color": style.GREY, "linewidth": 0.8, "linestyle": (0, (4, 2)), "zorder": 1}
_FRAME = {"facecolor": "none", "edgecolor": style.ORANGE, "linewidth": 0.9}
_ORACLE = {"color": style.BLACK, "marker": "o", "markerfacecolor": "white", "linestyle": (0, (1, 1))}


@style.printed
def withheld_plants(tables, options):
    """Robots of files with the same causes, driven by MuJoCo and by our own plant, whose laws are those of the
    diagnosis; as the figure of the other checks: confusion tables, then the share of right verdicts against the gap
    over the noise, and the share of the gap closed as predicted and in truth. Last the parts of the gaps, found against
    true, filled where the verdict names them.
    """
    return _check(tables, PLANTS, PLANTS)


@style.printed
def withheld(tables, options):
    """The diagnosis where the answer was withheld. Confusion tables: counts, shaded by their share of the row,
    right answers framed; of the effect check, the row is the effect that was taken out of the library. Unexplained
    counts alone or together with a name. Then the share of right verdicts against the gap over the noise, and of a test
    that knows the true law (1 % false alarms), with 95 % intervals, and the share of the gap closed as predicted and in
    truth. Last the parts of gaps that many causes make, or noises that are not as stated: found against true, filled
    where the verdict names them (scatter and runs: where they are more probable than not), 25 % off between the dotted
    lines, missed parts and parts that are not there on the edges.
    """
    return _check(tables, [name for name in _CHECKS if name not in PLANTS], _PARTED)


@style.printed
def withheld_causes(tables, options):
    """How often causes act that have a stated probability: a reliability diagram of each check, with 95 % intervals.
    Above it the number of statements in each bin, their sum and the expected calibration error. A statement is one on a
    single cause of a robot, named or not; those on causes that make less than half of the noise are left out.
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
    """The figure of some checks, and below it parts of the gaps of some."""
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
    """The column of a verdict; what says unexplained counts as that, whatever it names besides."""
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
    """Confusion table as a heat map of each row's shares, counts written; the right answers are framed."""
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
    """How often causes act against the stated probability that they do, with the number of statements in each bin."""
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
    """How often the diagnosis is right, and whether the effect could be seen at all, against the gap over the noise."""
    # what a calibration takes up leaves no gap
    scores = scores[scores["strength"] > _NO_GAP]
    for name in checks:
        _shares(axes, scores[scores["check"] == name], ("strength", "right"), _STRENGTH_EDGES, *_CHECKS[name])
    if checks[0] != "field":
        # of a field campaign nobody knows the law
        rows, label = scores[scores["check"] == checks[0]], f"detected by the true law, {_CHECKS[checks[0]][0]}"
        _shares(axes, rows, ("strength", "oracle_detects"), _STRENGTH_EDGES, label, _ORACLE)
    axes.set(xscale="log", xlabel="gap over noise, rms", ylabel="share of robots", ylim=(-0.03, 1.03))
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    style.plain_log(axes.xaxis)
    axes.set_title("right, by strength of the gap")


def _closed(axes, scores, checks):
    """Share of the gap closed: as the diagnosis predicts it, against the truth."""
    axes.plot([_LOWEST_CLOSED, 1.0], [_LOWEST_CLOSED, 1.0], **_EVEN)
    for name in checks:
        rows = scores[scores["check"] == name].dropna(subset=["share_closed", "share_closed_true"])
        label, look = _CHECKS[name]
        values = rows[["share_closed_true", "share_closed"]].clip(_LOWEST_CLOSED, 1.0).to_numpy()
        axes.plot(*values.T, label=label, **(look | {"linestyle": "none", "markersize": 2.4, "markeredgewidth": 0.5}))
    edges = (_LOWEST_CLOSED - 0.04, 1.04)
    axes.set(xlabel="true share closed", ylabel="predicted share closed", xlim=edges, ylim=edges)
    axes.xaxis.set_major_locator(MultipleLocator(0.2))
    axes.set_title("share of the gap closed")


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
        axis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        style.plain_log(axis)
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
