"""Errors of the drives over their own values."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rrru.figures import choose, style
from rrru.figures.choose import Options, Tables

# the table's units as they are drawn: of the drive's value and of its error, with factors
_VALUES = {"rad": ("degrees", 180.0 / np.pi), "mm": ("mm", 1.0)}
_ERRORS = {"rad": ("mrad", 1e3), "mm": ("µm", 1e3)}
_SHORT = {"degrees": "°", "mm": " mm"}
_WORST: style.Look = {"marker": "o", "markersize": 9.0, "markerfacecolor": "none", "markeredgewidth": 1.2}


@style.printed
def drive_functions(tables: Tables, options: Options) -> Figure:
    """Errors of the drives over their own values, as the named effects make them, over the range that was measured and
    minus their mean there: a constant is the drive's zero. Band: 95 % interval. Ring: where the error is largest.
    """
    if tables["gap_drive_functions"].empty:
        return style.note("no effect over a drive's value was found")
    rows = choose.of_campaign(tables, "gap_drive_functions", options["campaign"], "drive_functions")
    panels = list(rows.groupby(["effect", "drive"], sort=False))
    figure, axes = style.panel_grid(len(panels), 50.0, above_mm=4.0)
    for place, (one, (_, part)) in enumerate(zip(axes[:, 0], panels, strict=True)):
        _panel(one, part)
        first = part.iloc[0]
        one.set_title(f"({_mark(place)}) {choose.plain(first['effect'])}, {first['name']}")
    return figure


def _mark(number: int) -> str:
    """Mark of a panel: a to z, then with its number."""
    return chr(97 + number) if number < 26 else f"{number + 1}"


def _panel(axes: Axes, part: pd.DataFrame) -> None:
    """Error of one drive with its band, and the ring at its largest."""
    unit = part["unit"].iloc[0]
    (value_unit, value_factor), (error_unit, error_factor) = _VALUES[unit], _ERRORS[unit]
    value = value_factor * part["drive_value"]
    error, low, high = (error_factor * part[name] for name in ("error", "low_95", "high_95"))
    axes.axhline(0.0, color="#bbbbbb", linewidth=0.6)
    axes.fill_between(value, low, high, color=style.BLUE, alpha=0.25, linewidth=0.0, label="95 % interval")
    axes.plot(value, error, color=style.BLUE, linewidth=1.1, label="error")
    worst = part["worst"].to_numpy(dtype=bool)
    at, size = value[worst].iloc[0], error[worst].iloc[0]
    axes.plot([at], [size], linestyle="none", color=style.VERMILION, **_WORST, label="largest")
    text = f"{style.number(size)} {error_unit} at {style.number(at)}{_SHORT[value_unit]}"
    side = "right" if at > value.mean() else "left"
    beyond = 8.0 if size > 0.0 else -8.0
    look: style.Look = {"color": style.VERMILION, "fontsize": 7.0, "ha": side, "va": "bottom" if size > 0.0 else "top"}
    axes.annotate(text, (at, size), xytext=(0.0, beyond), textcoords="offset points", in_layout=False, **look)
    axes.margins(x=0.02, y=0.3)
    axes.set_xlabel(f"drive value, {part['name'].iloc[0]} ({value_unit})")
    axes.set_ylabel(f"error ({error_unit})")
    axes.grid(True)
