"""Progress of the search for the twin."""

from rrru.figures import style
from rrru.studies.rrru3.paper import TOLERANCE

_BEST, _HIGHEST, _COLUMNS = 3, 1.5, 3
# items of printed numbers in words
_WORDS = {
    "group1_before": "group 1 before calibration",
    "group1_after": "group 1 after calibration",
    "lines_before": "lines before calibration",
    "lines_after": "lines after calibration",
    "lines_objective": "line calibration:\nmean error",
    "lines_2_7_under_spiral": "lines 2 to 7, spiral's calibration",
    "spiral_under_lines": "spiral, lines' calibration",
    "spiral_under_lines_x": "spiral's x, lines' calibration",
    "spiral_under_lines_z_abs": "spiral's z, lines' calibration",
    "spiral_under_spiral": "spiral, own calibration",
    "spiral_under_spiral_component": "spiral's x, y, z, own calibration",
}
_ENDS = {"min": "smallest error", "max": "largest error"}


@style.printed
def twin_search(tables, _options):
    """Objective of the search for the twin against the evaluations, a curve for every restart. The objective is minus
    the log probability of what the paper prints. Dots: where a restart ended; the three best are blue.
    """
    progress, restarts = tables["twin_progress"], tables["twin_restarts"]
    figure = style.new(style.DOUBLE_MM, 80.0)
    axes = figure.subplots()
    nearest = restarts.nsmallest(_BEST, "objective_nat")["restart"].tolist()
    # candidates that cannot be driven have a large objective
    drawn = progress[progress["objective_nat"] < _HIGHEST * restarts["objective_nat"].min()]
    for restart, curve in drawn.groupby("restart"):
        among = restart in nearest
        look = {"color": style.BLUE if among else style.GREY, "zorder": 3 if among else 2}
        label = "three best restarts" if among else "other restarts"
        axes.step(curve["evaluations"], curve["objective_nat"], where="post", linewidth=0.8, label=label, **look)
        axes.plot(curve["evaluations"].iloc[-1], curve["objective_nat"].iloc[-1], ".", **look)
    reason = {"agreed": "three restarts agree within 1 %", "restarts": "all restarts ended", "time": "time was over"}
    axes.set_title(f"search ended: {reason[restarts['ended'].iloc[0]]}")
    axes.set(xlabel="evaluations of a restart", ylabel="objective (nat)", xlim=(0.0, None))
    axes.grid(True)
    style.legend_above(figure, [axes], columns=3)
    return figure


@style.printed
def twin_tradeoff(tables, _options):
    """Printed numbers that the twin misses against the number that suffers most where they weigh more in the search:
    medians over draws as shares of what is printed, a point for every weight. Grey: within 15 % of what is printed.
    """
    table = tables["twin_tradeoff"]
    items = table.loc[table["partner"], "item"].unique()
    if not len(items):
        return style.note("the twin misses no printed number")
    columns = min(_COLUMNS, len(items))
    rows = -(-len(items) // columns)
    figure = style.new(style.DOUBLE_MM, 12.0 + 58.0 * rows)
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, item in zip(grid, items, strict=False):
        _tradeoff(axes, table[table["item"] == item])
    for axes in grid[len(items) :]:
        axes.set_axis_off()
    return figure


def _tradeoff(axes, rows):
    """The curve of one missed number and its partner."""
    item, partner = rows["item"].iloc[0], rows.loc[rows["partner"], "other"].iloc[0]
    own, other = (rows[rows["other"] == name].sort_values("weight") for name in (item, partner))
    axes.plot(own["ratio"], other["ratio"], "o-", color=style.BLUE, markersize=3.5, linewidth=0.8)
    # searches that found nothing better end at the same place
    places = own.assign(other=other["ratio"].to_numpy()).groupby(["ratio", "other"])["weight"]
    right = 0.5 * (own["ratio"].min() + own["ratio"].max())
    for place, weights in places:
        text = "weight " + ", ".join(f"{weight:g}" for weight in weights)
        side = {"xytext": (-5, 4), "ha": "right"} if place[0] > right else {"xytext": (5, -8), "ha": "left"}
        axes.annotate(text, place, textcoords="offset points", fontsize=7.0, **side)
    box = {"facecolor": "#eeeeee", "edgecolor": "none", "zorder": 0}
    axes.axvspan(1.0 - TOLERANCE, 1.0 + TOLERANCE, **box)
    axes.axhspan(1.0 - TOLERANCE, 1.0 + TOLERANCE, **box)
    axes.set(xlabel=_in_words(item), ylabel=_in_words(partner))
    axes.margins(0.3, 0.2)
    axes.grid(True)


def _in_words(item):
    """Label of an axis with an item over what is printed of it."""
    stem, _, end = item.rpartition("_")
    text = _WORDS[item] if item in _WORDS else f"{_WORDS[stem]}:\n{_ENDS[end]}"
    return f"{text} / printed"
