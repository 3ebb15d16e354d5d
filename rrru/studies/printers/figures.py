"""Figure of linear-delta printers: saved against fitted answers, residuals, and uncertainty of the arms."""

import numpy as np

from rrru.errors import ConfigError
from rrru.figures import style

_OPEN = {"markerfacecolor": "white"}
_VERDICTS = {
    "reproduced": {"color": style.BLUE, "marker": "o"},
    "does not belong": {"color": style.VERMILION, "marker": "D"} | _OPEN,
    "not calibrated": {"color": style.ORANGE, "marker": "s"} | _OPEN,
}
_HEIGHT = {"color": style.BLUE, "marker": "o"}
_DISTANCE = {"color": style.ORANGE, "marker": "^"}
# share of a decade
_MARGIN = 0.1
_ROW_MM, _AROUND_MM, _HIGHEST_MM = 4.4, 34.0, 238.0


@style.printed
def printers(tables, options):
    """Linear-delta printers calibrated from their owners' measurements. (a) Largest difference between the numbers
    that their firmware saved and ours; diamonds: readings and saved answer do not belong together. (b) Rms
    residuals of probed heights and caliper distances for our answer and the saved one. (c) Standard error of an
    arm's length with distances, and of the arms' common length from heights alone.
    """
    frame = tables["printers"]
    frame = frame[frame["verdict"].isin(_VERDICTS)].reset_index(drop=True)
    if frame.empty:
        raise ConfigError("printers: table printers has no printer that could be fitted")
    figure = style.new(style.DOUBLE_MM, min(_ROW_MM * len(frame) + _AROUND_MM, _HIGHEST_MM))
    panels = figure.subplots(1, 3, sharey=True)
    for axes, draw in zip(panels, (_differences, _residuals, _arms), strict=True):
        draw(axes, frame, np.arange(len(frame)))
        axes.set_xscale("log")
        axes.set_xlim(*_decades(axes.dataLim.minposx, axes.dataLim.x1))
        style.plain_log(axes.xaxis)
        axes.grid(True)
    panels[0].set_yticks(range(len(frame)), frame["printer"])
    panels[0].set(ylim=(len(frame) - 0.5, -0.5), ylabel="printer")
    style.legend_above(figure, panels, columns=4)
    return figure


def _decades(low, high):
    """Limits of a log axis at whole decades with a margin, so that few data have two labelled ticks too."""
    return 10.0 ** np.floor(np.log10(low) - _MARGIN), 10.0 ** np.ceil(np.log10(high) + _MARGIN)


def _differences(axes, frame, rows):
    """Largest difference between saved and fitted numbers, by verdict."""
    for verdict, look in _VERDICTS.items():
        chosen = (frame["verdict"] == verdict).to_numpy()
        _marks(axes, frame["largest_difference"][chosen], rows[chosen], f"answer {verdict}", look)
    axes.set(xlabel="largest difference (mm) or (deg)")
    axes.set_title("(a) saved minus fitted answer")


def _residuals(axes, frame, rows):
    """Rms residuals of heights and distances, ours filled, the saved answer's open."""
    for kind, look in (("height", _HEIGHT), ("distance", _DISTANCE)):
        _marks(axes, frame[f"{kind}_rms_saved_mm"], rows, f"{kind}s, saved", look | _OPEN | {"markersize": 4.5})
        _marks(axes, frame[f"{kind}_rms_fitted_mm"], rows, f"{kind}s, ours", look)
    axes.set(xlabel="rms residual (mm)")
    axes.set_title("(b) residuals")


def _arms(axes, frame, rows):
    """Standard error of an arm with distances, and of the common length from its heights alone, or from 100."""
    columns = (
        ("arm_standard_error_mm", "an arm, with distances", style.ORANGE, "s"),
        ("common_arm_standard_error_mm", "all arms, heights alone", style.BLUE, "s"),
        ("dense_common_arm_standard_error_mm", "all arms, 100 heights", style.BLUE, "v"),
    )
    for column, label, colour, marker in columns:
        _marks(axes, frame[column], rows, label, _OPEN | {"color": colour, "marker": marker})
    axes.set(xlabel="standard error (mm)")
    axes.set_title("(c) uncertainty of the arms")


def _marks(axes, values, rows, label, look):
    """Marks without a line."""
    axes.plot(values, rows, linestyle="none", label=label, **look)
