"""Figure of all methods on all robots: residual errors inside and outside their region, and with fewer points."""

from rrru.errors import ConfigError
from rrru.figures import style
from rrru.figures.choose import where


def _look(colour, marker, filled=True, dashes="-"):
    """Style of a line."""
    return {"color": colour, "marker": marker, "linestyle": dashes, "markerfacecolor": colour if filled else "white"}


_ROBOTS = {"rrru3": "3-RRRU", "ptt3": "3-PTT", "delta": "Delta"}
# top to bottom, with the look of their learning curves
_METHODS = {
    "zero_offsets_images": ("zero offsets, images", None),
    "zero_offsets": ("zero offsets", _look(style.BLACK, "o", dashes=(0, (1, 1)))),
    "genetic": ("genetic algorithm", _look(style.VERMILION, "D", filled=False)),
    "least_squares": ("least squares", _look(style.BLUE, "s")),
    "least_squares_full": ("least squares, all lengths", _look(style.BLUE, "s", filled=False, dashes=(0, (5, 1)))),
    "rbf_map": ("RBF map", _look(style.ORANGE, "^")),
    "rbf_after_parameters": ("RBF after least squares", _look(style.SKY, "v", dashes=(0, (4, 2, 1, 2)))),
    "jacobian_step": ("Jacobian step, each target", None),
}
_BEFORE = {key: style.BEFORE[key] for key in ("color", "linestyle")}
_INSIDE = {"color": style.BLUE, "marker": "s"}
_OUTSIDE = {"color": style.ORANGE, "marker": "^", "markerfacecolor": "white"}


@style.printed
def methods(tables, options):
    """Every applicable method on every robot, with true errors of the driven robot. (a) to (c) Mean error after
    correction, with a bar to the largest, at targets inside the region of the training points and around it. (d) to
    (f) Mean error with fewer training points.
    """
    frame, curves = tables["methods"], tables["method_points"]
    robots = [name for name in _ROBOTS if (frame["robot"] == name).any()]
    if not robots:
        raise ConfigError("methods: table methods has no robot that is known; allowed: " + ", ".join(_ROBOTS))
    shown = [name for name in _METHODS if (frame["method"] == name).any()]
    figure = style.new(style.DOUBLE_MM, 150.0)
    panels = figure.subplots(2, len(robots), squeeze=False, height_ratios=(1.15, 1.0))
    for column, (robot, marks) in enumerate(zip(robots, ("ad", "be", "cf"), strict=False)):
        results, before = where(frame, robot=robot), where(frame, robot=robot, test="inside")["before_mean_mm"].iloc[0]
        _residual_errors(panels[0, column], results, shown, before)
        panels[0, column].set_title(f"({marks[0]}) {_ROBOTS[robot]}: residual error")
        panels[0, column].tick_params(labelleft=column == 0)
        _learning(panels[1, column], where(curves, robot=robot, test="inside"), before)
        panels[1, column].set_title(f"({marks[1]}) {_ROBOTS[robot]}: fewer points")
    panels[0, 0].set_ylabel("method")
    panels[1, 0].set_ylabel("mean error inside (mm)")
    style.legend_above(figure, list(panels[0]), columns=3)
    style.legend_above(figure, panels[1], columns=3, side="lower")
    return figure


def _residual_errors(axes, results, shown, before):
    """Mean errors on both tests with bars to the largest ones, and the mean before."""
    rows = {name: place for place, name in enumerate(shown)}
    for test, look, shift in (("inside", _INSIDE, -0.14), ("outside", _OUTSIDE, 0.14)):
        part = where(results, test=test)
        place = part["method"].map(rows) + shift
        axes.hlines(place, part["after_mean_mm"], part["after_max_mm"], color=look["color"], linewidth=0.8)
        label = f"{test} the region, bar to the largest"
        axes.plot(part["after_mean_mm"], place, linestyle="none", label=label, **look)
    axes.axvline(before, label="before, mean inside", **_BEFORE)
    axes.set(xscale="log", ylim=(len(shown) - 0.5, -0.5), xlabel="error (mm)")
    axes.set_yticks(range(len(shown)), [_METHODS[name][0] for name in shown])
    style.short_log(axes.xaxis)
    axes.grid(True, axis="x")


def _learning(axes, curves, before):
    """Mean error inside against the number of training points."""
    for name, (label, look) in _METHODS.items():
        part = where(curves, method=name).sort_values("points")
        if look and len(part):
            axes.plot(part["points"], part["after_mean_mm"], label=label, **look)
    axes.axhline(before, **_BEFORE)
    counts = sorted(where(curves, method="least_squares")["points"].unique())
    axes.set(xscale="log", yscale="log", xlabel="points")
    axes.set_xticks(counts, [f"{count:g}" for count in counts])
    axes.set_xticks([], minor=True)
    style.short_log(axes.yaxis)
    axes.grid(True)
