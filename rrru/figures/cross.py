"""Every calibration applied to every trajectory."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import LogLocator

from rrru.arrays import FloatArray
from rrru.figures import choose, style
from rrru.figures.choose import Options, Tables

_GROUPS = ("all_lines",)
_NOT_SHOWN = ("all",)
# more columns than this do not fit side by side
_SIDE_BY_SIDE = 9


@style.printed
def cross(tables: Tables, options: Options) -> Figure:
    """Every calibration applied to every trajectory: (a) mean and (b) largest position error. The first row is
    before any calibration.
    """
    summary = choose.of_campaign(tables, "error_summary", options["campaign"], "cross")
    mode = choose.mode_of(summary, options)
    before = summary[summary["mode"] == "before"].assign(calibration="before")
    after = summary[(summary["mode"] == mode) & (summary["method"] == options["method"])]
    rows = ["before", *dict.fromkeys(after["calibration"])]
    named = [name for name in summary["trajectory"].unique() if name not in _NOT_SHOWN]
    # the only trajectory of a list of a tracker's has that name
    present = named or list(summary["trajectory"].unique())
    single = sorted((name for name in present if name not in _GROUPS), key=choose.natural)
    columns = [*single, *(name for name in _GROUPS if name in present)]
    shown = pd.concat([before, after]).drop_duplicates(["calibration", "trajectory"], keep="last")
    sizes = (shown.pivot(index="calibration", columns="trajectory", values=size) for size in ("mean_mm", "max_mm"))
    both = [table.reindex(rows)[columns].to_numpy(dtype=float) for table in sizes]
    side_by_side = len(columns) <= _SIDE_BY_SIDE
    height = 8.0 * len(rows) + 22.0
    figure = style.new(style.DOUBLE_MM, height + 22.0 if side_by_side else 2.0 * height + 14.0)
    panels = figure.subplots(*((1, 2) if side_by_side else (2, 1)), sharey=side_by_side)
    scale = _scale(np.concatenate(both))
    meaning = "residual of the calibrated model" if mode == "model" else "error when driven again"
    for mark, word, axes, matrix in zip("ab", ("mean", "largest"), panels, both, strict=True):
        image = _panel(axes, matrix, scale, rows, columns)
        axes.set_title(f"({mark}) {word} {meaning} (mm)")
        axes.set_xlabel("applied to")
    for axes in panels[: 1 if side_by_side else 2]:
        axes.set_ylabel("calibrated on")
    bar = figure.colorbar(image, ax=list(panels), location="bottom", aspect=60, fraction=0.05)
    bar.set_label("position error (mm)")
    bar.ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    style.plain_log(bar.ax.xaxis)
    return figure


def _scale(values: FloatArray) -> LogNorm:
    """One log colour scale for all panels."""
    values = values[np.isfinite(values) & (values > 0.0)]
    return LogNorm(values.min(), max(values.max(), values.min() * 1.1)) if values.size else LogNorm(0.1, 1.0)


def _panel(axes: Axes, matrix: FloatArray, scale: LogNorm, rows: Sequence[str], columns: Sequence[str]) -> AxesImage:
    """Heat map with every number written; lightness alone orders the colours."""
    image = axes.imshow(
        np.ma.masked_invalid(matrix), cmap=style.SEQUENTIAL, norm=scale, aspect="auto", interpolation="none"
    )
    for (row, column), value in np.ndenumerate(matrix):
        dark = np.isfinite(value) and scale(value, clip=True) > 0.6
        look: style.Look = {"ha": "center", "va": "center", "fontsize": 7.0, "in_layout": False}
        axes.text(column, row, style.number(value), color="white" if dark else "black", **look)
    axes.set_xticks(range(len(columns)), [choose.plain(name) for name in columns], rotation=90)
    axes.set_yticks(range(len(rows)), [name.replace("_", " ") for name in rows])
    axes.tick_params(length=0.0)
    axes.axhline(0.5, color="white", linewidth=2.0)
    groups = sum(name in _GROUPS for name in columns)
    if groups:
        axes.axvline(len(columns) - groups - 0.5, color="white", linewidth=2.0)
    return image
