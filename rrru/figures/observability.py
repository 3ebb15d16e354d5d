"""Observability: which combinations of parameters each set of trajectories determines, and how well."""

from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import LogLocator

from rrru.figures import choose, style
from rrru.figures.choose import Options, Tables

# weights smaller than this are left unwritten
_WRITTEN_FROM = 0.15
# half width of a normal distribution's interval of 95 % over its standard deviation
_QUANTILE_95 = 1.959964
# letters in a line of a narrow figure
_NARROW = 44
# with more parameters there is no room for numbers, and names stand upright
_ROOM_FOR = 9
# with more parameters each calibration has the full width
_ROOM_FOR_TWO = 16
# height of a row whose number can be read, and size of the letters of many rows
_ROW_MM, _SMALL = 2.8, 6.0


@style.printed
def observability(tables: Tables, options: Options) -> Figure:
    """Observability by every set of trajectories: directions of parameter space from the best seen to the worst. Each
    has its weights (those below 0.15, or of more than nine parameters, are not written), the half width of the 95 %
    interval along it, and its singular value.
    """
    rows = choose.of_campaign(tables, "observability", options["campaign"], "observability")
    rows = rows.assign(half_mm=_QUANTILE_95 * rows["standard_error_mm"])
    names = list(dict.fromkeys(rows["calibration"]))
    count = rows["parameter"].nunique()
    height_mm = max(80.0, 40.0 + _ROW_MM * count) if count > _ROOM_FOR else 58.0
    wide = count > _ROOM_FOR_TWO
    widths = [2.6, 1.0] * (1 if wide else min(len(names), 2))
    figure, panels = style.panel_grid(len(names), height_mm, each=2, wide=wide, width_ratios=widths)
    limits = _error_limits(rows["half_mm"])
    for place, (name, (weights, errors)) in enumerate(zip(names, panels, strict=True)):
        part = rows[rows["calibration"] == name]
        image = _weights(weights, part)
        weights.set_title(f"({chr(97 + place)}) {choose.calibration_label(name)}")
        weights.set_ylabel("" if place % 2 and not wide else "direction, best seen first")
        _errors(errors, part, limits)
    bar = figure.colorbar(image, ax=figure.axes, location="top", fraction=0.03, aspect=50, shrink=0.6)
    label = "size of the weight in the unit direction (angles as arcs at the robot's own length)"
    bar.set_label(label if wide or len(names) > 1 else fill(label, _NARROW))
    return figure


def _weights(axes: Axes, part: pd.DataFrame) -> AxesImage:
    """Heat map of the weights' sizes, lightness alone, with the signed numbers written where they count."""
    parameters = list(dict.fromkeys(part["parameter"]))
    table = part.pivot(index="direction", columns="parameter", values="weight")[parameters].sort_index()
    image = axes.imshow(table.abs(), cmap=style.SEQUENTIAL, vmin=0.0, vmax=1.0, aspect="auto", interpolation="none")
    for (row, column), weight in np.ndenumerate(table.to_numpy()):
        if abs(weight) >= _WRITTEN_FROM and len(parameters) <= _ROOM_FOR:
            text = f"{weight:+.2f}".replace("0.", ".", 1).replace("-", "\N{MINUS SIGN}")
            color = "white" if abs(weight) > 0.6 else "black"
            axes.text(column, row, text, ha="center", va="center", fontsize=7.0, color=color, in_layout=False)
    crowded: style.Look = {"rotation": 90.0, "fontsize": _SMALL} if len(parameters) > _ROOM_FOR else {}
    small: style.Look = {"fontsize": _SMALL} if crowded else {}
    axes.set_xticks(range(len(parameters)), [choose.PARAMETER_LABELS.get(name, name) for name in parameters], **crowded)
    axes.set_yticks(range(len(table)), table.index, **small)
    axes.tick_params(length=0.0)
    axes.set_xlabel("error parameter")
    return image


def _errors(axes: Axes, part: pd.DataFrame, limits: tuple[float, float]) -> None:
    """Half width of the 95 % interval along each direction on a log axis, the singular value as a number next to it."""
    directions = part.drop_duplicates("direction").set_index("direction").sort_index()
    rows = np.arange(len(directions))
    seen = directions["half_mm"].notna().to_numpy()
    axes.hlines(rows[seen], limits[0], directions["half_mm"][seen], color=style.BLUE, linewidth=1.0)
    axes.plot(directions["half_mm"], rows, "o", color=style.BLUE)
    for row in rows[~seen]:
        axes.text(0.5, row, "not seen", transform=axes.get_yaxis_transform(), ha="center", va="center", fontsize=7.0)
    axes.set(xscale="log", xlim=limits, ylim=(len(directions) - 0.5, -0.5))
    many: style.Look = {"fontsize": _SMALL} if len(rows) > _ROOM_FOR else {}
    axes.set_yticks(rows, [_short(value) for value in directions["singular_value"]], **many)
    axes.yaxis.tick_right()
    axes.xaxis.set_major_locator(LogLocator(numticks=3))
    style.plain_log(axes.xaxis)
    axes.tick_params(axis="y", length=0.0)
    axes.set_xlabel("95 %: ± (mm)")
    axes.set_title("singular value (mm/mm)", loc="right", fontsize=7.0)
    axes.grid(True, axis="x")


def _error_limits(errors: pd.Series) -> tuple[float, float]:
    """Common limits of all panels' half widths, whole decades."""
    finite = errors[np.isfinite(errors) & (errors > 0.0)]
    if finite.empty:
        return 0.1, 1.0
    low, high = np.floor(np.log10(finite.min() * 0.8)), np.ceil(np.log10(finite.max() * 1.2))
    return 10.0**low, 10.0 ** max(high, low + 1.0)


def _short(value: float) -> str:
    """Two digits of a number, or all before the point."""
    return f"{value:.2g}" if 1e-3 <= value < 10.0 else f"{value:.0f}" if value >= 10.0 else f"{value:.0e}"
