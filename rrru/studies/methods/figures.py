"""All methods on all robots: what each leaves of the error inside and outside the region it learned on, and what fewer
points cost.
"""

from matplotlib.ticker import LogLocator

from rrru.errors import ConfigError
from rrru.figures import style

_ROBOTS = {"rrru3": "3-RRRU", "ptt3": "3-PTT", "delta": "Delta"}
# top to bottom, with the look of their learning curves
_METHODS = {
    "zero_offsets_images": ("zero offsets, images", None),
    "zero_offsets": ("zero offsets", {"color": style.BLACK, "marker": "o", "linestyle": (0, (1, 1))}),
    "genetic": ("genetic algorithm", {"color": style.VERMILION, "marker": "D", "markerfacecolor": "white"}),
    "least_squares": ("least squares", {"color": style.BLUE, "marker": "s"}),
    "least_squares_full": (
        "least squares, all lengths",
        {"color": style.BLUE, "marker": "s", "markerfacecolor": "white", "linestyle": (0, (5, 1))},
    ),
    "rbf_map": ("RBF map", {"color": style.ORANGE, "marker": "^"}),
    "rbf_after_parameters": (
        "RBF after least squares",
        {"color": style.SKY, "marker": "v", "linestyle": (0, (4, 2, 1, 2))},
    ),
    "jacobian_step": ("Jacobian step, each target", None),
}
_INSIDE = {"color": style.BLUE, "marker": "s"}
_OUTSIDE = {"color": style.ORANGE, "marker": "^", "markerfacecolor": "white"}


@style.printed
def methods(tables, options):
    """Every method on every robot where it makes sense, judged on true errors of the driven robot. (a) to (c) Mean
    error after it, with a bar to the largest, at targets inside the region that it learned on and around it. (d) to
    (f) What fewer points cost.
    """
    frame, curves = tables["methods"], tables["method_points"]
    robots = [name for name in _ROBOTS if (frame["robot"] == name).any()]
    if not robots:
        raise ConfigError("methods: table methods has no robot that is known; allowed: " + ", ".join(_ROBOTS))
    shown = [name for name in _METHODS if (frame["method"] == name).any()]
    figure = style.new(style.DOUBLE_MM, 150.0)
    panels = figure.subplots(2, len(robots), squeeze=False, height_ratios=(1.15, 1.0))
    for column, (robot, marks) in enumerate(zip(robots, ("ad", "be", "cf"), strict=False)):
        own = frame[frame["robot"] == robot]
        _left(panels[0, column], own, shown)
        panels[0, column].set_title(f"({marks[0]}) {_ROBOTS[robot]}: what is left")
        panels[0, column].tick_params(labelleft=column == 0)
        _learning(
            panels[1, column],
            curves[(curves["robot"] == robot) & (curves["test"] == "inside")],
            own["before_mean_mm"].iloc[0],
        )
        panels[1, column].set_title(f"({marks[1]}) {_ROBOTS[robot]}: fewer points")
    panels[0, 0].set_ylabel("method")
    panels[1, 0].set_ylabel("mean error inside (mm)")
    style.legend_above(figure, list(panels[0]), columns=3)
    _legend_below(figure, panels[1])
    return figure


def _left(axes, own, shown):
    """Mean errors on both tests with bars to the largest ones, and the mean before."""
    rows = {name: place for place, name in enumerate(shown)}
    for test, look, shift in (("inside", _INSIDE, -0.14), ("outside", _OUTSIDE, 0.14)):
        part = own[own["test"] == test]
        place = part["method"].map(rows) + shift
        axes.hlines(place, part["after_mean_mm"], part["after_max_mm"], color=look["color"], linewidth=0.8)
        axes.plot(
            part["after_mean_mm"], place, linestyle="none", label=f"{test} the region, bar to the largest", **look
        )
    before = own.loc[own["test"] == "inside", "before_mean_mm"].iloc[0]
    axes.axvline(before, label="before, mean inside", **{key: style.BEFORE[key] for key in ("color", "linestyle")})
    axes.set(xscale="log", ylim=(len(shown) - 0.5, -0.5), xlabel="error (mm)")
    axes.set_yticks(range(len(shown)), [_METHODS[name][0] for name in shown])
    _ticks(axes.xaxis)
    axes.grid(True, axis="x")


def _learning(axes, curves, before):
    """Mean error inside against the number of points learned from."""
    for name, (label, look) in _METHODS.items():
        part = curves[curves["method"] == name].sort_values("points")
        if look and len(part):
            axes.plot(part["points"], part["after_mean_mm"], label=label, **look)
    axes.axhline(before, **{key: style.BEFORE[key] for key in ("color", "linestyle")})
    counts = sorted(curves.loc[curves["method"] == "least_squares", "points"].unique())
    axes.set(xscale="log", yscale="log", xlabel="points")
    axes.set_xticks(counts, [f"{count:g}" for count in counts])
    axes.set_xticks([], minor=True)
    _ticks(axes.yaxis)
    axes.grid(True)


def _ticks(axis):
    """Labels at 1 and 3 of every decade, so that a short axis has some too."""
    axis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    style.plain_log(axis)


def _legend_below(figure, panels):
    """The learning curves' legend under all panels."""
    entries = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=3, columnspacing=1.4)
