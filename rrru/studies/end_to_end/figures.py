"""Figure of the residuals of a robot's given, calibrated and corrected file on a held-out campaign."""

from matplotlib.figure import Figure

from rrru.figures import style
from rrru.figures.choose import Options, Tables, where

_MODELS: dict[str, tuple[str, style.Look]] = {
    "given": ("your file", {"color": style.BLACK, "marker": "o", "markerfacecolor": "white"}),
    "calibrated": ("calibrated", {"color": style.ORANGE, "marker": "^", "markerfacecolor": "white"}),
    "corrected": ("corrected", {"color": style.BLUE, "marker": "s"}),
}
_NOISE: style.Look = {"color": style.GREY, "linestyle": (0, (4, 2)), "linewidth": 0.9}


@style.printed
def circle(tables: Tables, options: Options) -> Figure:
    """Measured minus modelled position on a held-out campaign: the robot's file as given, its parameters calibrated,
    and the corrected file of the diagnosis. (a) Point by point. (b) All points, compared with the instrument's noise.
    """
    whole, points = tables["circle"], tables["circle_points"]
    figure = style.new(style.DOUBLE_MM, 68.0)
    along, sums = figure.subplots(1, 2, width_ratios=(2.0, 1.0))
    noise = whole["noise_rms_mm"].iloc[0]
    for place, (model, (label, look)) in enumerate(_MODELS.items()):
        error, rms = where(points, model=model)["error_mm"], where(whole, model=model)["rms_mm"].iloc[0]
        along.plot(range(1, len(error) + 1), error, linestyle="none", label=label, **look)
        sums.bar(place, rms, width=0.6, color=look["color"] if model != "given" else style.GREY)
        sums.annotate(style.number(rms), (place, rms), (0, 2), textcoords="offset points", ha="center", fontsize=7.0)
    for axes in (along, sums):
        axes.axhline(noise, label="noise, rms", **_NOISE)
        axes.grid(True, axis="y")
    along.set(xlabel="point", ylabel="error (mm)", title="(a) point by point", yscale="log")
    style.plain_log(along.yaxis)
    sums.set(xlabel="model", ylabel="error, rms (mm)", title="(b) all points")
    sums.margins(y=0.12)
    sums.set_xticks(range(len(_MODELS)), [label for label, _ in _MODELS.values()])
    style.legend_above(figure, [along], columns=4)
    return figure
