"""Print style of every figure: sizes in mm, colours, labels, and saving with bytes that depend on the data only.

Colours are Okabe and Ito's, which every kind of colour vision can distinguish; those that meet in one panel also differ
in grey and in marker.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from textwrap import fill
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from matplotlib import style
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backend_bases import FigureCanvasBase
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from rrru.figures.choose import Options, Tables
from rrru.figures.files import KINDS
from rrru.store.atomic_write import whole

# a figure function: the tables that it draws by name, and the options of all figures
Drawing: TypeAlias = Callable[[Tables, Options], Figure]
# axes as `Figure.subplots` arranges them
AxesArray: TypeAlias = npt.NDArray[Any]
# keywords of an artist
Look: TypeAlias = dict[str, Any]

SINGLE_MM, DOUBLE_MM = 85.0, 175.0
_MM_PER_INCH = 25.4
_DPI = 200
# characters in a line of a legend that stands in a panel's place
_NARROW = 24

# Okabe and Ito, "Color universal design", 2008
BLACK, ORANGE, SKY, BLUE, VERMILION, GREY = "#000000", "#E69F00", "#56B4E9", "#0072B2", "#D55E00", "#999999"

BEFORE: Look = {"color": BLACK, "marker": "o", "markerfacecolor": "white", "linestyle": (0, (1, 1))}
LINES: Look = {"color": BLUE, "marker": "s", "markerfacecolor": BLUE, "linestyle": "-"}
SPIRAL: Look = {"color": ORANGE, "marker": "^", "markerfacecolor": "white", "linestyle": (0, (5, 1))}
COMMANDED: Look = {"color": GREY, "marker": "+", "markersize": 3.5, "linestyle": "-", "linewidth": 0.6}
PUBLISHED: Look = {"color": VERMILION, "marker": "D", "markerfacecolor": "white", "linestyle": "-"}
TOLERANCE: Look = {"color": VERMILION, "linestyle": (0, (4, 2, 1, 2)), "linewidth": 0.8}
# light end for small numbers; lightness alone orders it, so that it reads in grey
SEQUENTIAL = "Blues"
MEASURE = "viridis"

_STYLE = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "mathtext.fontset": "dejavusans",
    **dict.fromkeys(("font.size", "axes.labelsize", "axes.titlesize"), 8.0),
    **dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize", "legend.title_fontsize"), 7.0),
    **dict.fromkeys(("axes.linewidth", "xtick.major.width", "ytick.major.width"), 0.6),
    "axes.titlelocation": "left",
    "axes.titlepad": 4.0,
    "axes.titley": 1.0,
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "lines.linewidth": 0.9,
    "lines.markersize": 3.0,
    "lines.markeredgewidth": 0.7,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.linewidth": 0.4,
    "grid.color": "#dddddd",
    "hatch.linewidth": 0.5,
    "pdf.fonttype": 42,
    # names inside of a file: by what it draws, not by chance
    "svg.hashsalt": "rrru",
}


@contextmanager
def print_style() -> Iterator[None]:
    """Matplotlib's own defaults with the print style on top, whatever the user's settings are."""
    with style.context(["default", _STYLE], after_reset=True):
        yield


def printed(draw: Drawing) -> Drawing:
    """A figure function that draws in print style."""

    @wraps(draw)
    def styled(tables: Tables, options: Options) -> Figure:
        with print_style():
            return draw(tables, options)

    return styled


def new(width_mm: float, height_mm: float) -> Figure:
    """An empty figure that keeps its size and arranges its panels by itself."""
    engine = ConstrainedLayoutEngine(w_pad=0.03, h_pad=0.03, wspace=0.03, hspace=0.04)
    # letters have widths that depend on the resolution: arranged at another one, labels would leave the page
    return Figure(figsize=(width_mm / _MM_PER_INCH, height_mm / _MM_PER_INCH), dpi=_DPI, layout=engine)


def note(text: str) -> Figure:
    """A figure that says in a line why there is nothing to draw."""
    figure = new(DOUBLE_MM, 20.0)
    figure.text(0.5, 0.5, text, ha="center", va="center")
    return figure


def legend_above(figure: Figure, axes: Iterable[Axes], columns: int = 5, side: str = "upper") -> None:
    """One legend above all panels, where it covers no data, in as few rows of `columns` as it takes; side: or lower."""
    entries = _entries(axes)
    rows = max(-(-len(entries) // columns), 1)
    place: Look = {"loc": f"outside {side} center", "ncols": max(-(-len(entries) // rows), 1), "columnspacing": 1.4}
    figure.legend(entries.values(), entries.keys(), **place)


def panel_grid(
    count: int, row_mm: float, above_mm: float = 14.0, each: int = 1, wide: bool = False, **options: Any
) -> tuple[Figure, AxesArray]:
    """A figure with `each` axes side by side per panel, two panels a row: the figure and the axes (count, each) in use.

    row_mm, above_mm: heights of a row of panels and of what stands above them; one panel makes a narrow figure. wide:
    whether each panel has a row of its own, of full width.
    """
    columns = 1 if wide else min(count, 2)
    rows = -(-count // columns)
    figure = new(DOUBLE_MM if wide or columns > 1 else SINGLE_MM, above_mm + row_mm * rows)
    panels = figure.subplots(rows, each * columns, squeeze=False, **options).reshape(-1, each)
    for axes in panels[count:].ravel():
        axes.set_axis_off()
    return figure, panels[:count]


def legend_inside(place: Axes, axes: Iterable[Axes]) -> None:
    """One legend for the given axes in a place that is left empty for it."""
    entries = _entries(axes)
    labels = [fill(label, _NARROW) for label in entries]
    legend = place.legend(entries.values(), labels, loc="upper left", borderaxespad=0.0, handlelength=2.0)
    legend.set_in_layout(False)


def _entries(axes: Iterable[Axes]) -> dict[str, Artist]:
    """Legend entries of axes: label to handle, each label once."""
    entries: dict[str, Artist] = {}
    for one in axes:
        for handle, label in zip(*one.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    return entries


def magnification(deviation_mm: npt.ArrayLike, span_mm: float, share: float = 0.16) -> float:
    """Round factor (1, 2, 5, 10, ...) that makes the largest deviation about `share` of the span; 1 without any."""
    sizes = np.abs(np.asarray(deviation_mm, dtype=float))
    largest = sizes[np.isfinite(sizes)].max(initial=0.0)
    if largest <= 0.0 or not span_mm > 0.0:
        return 1.0
    wanted = max(share * span_mm / largest, 1.0)
    decade = 10.0 ** np.floor(np.log10(wanted))
    return float(decade * max(step for step in (1.0, 2.0, 5.0) if step * decade <= wanted * (1.0 + 1e-12)))


def number(value: float) -> str:
    """An error to two decimals, more where it is small, fewer where it is large; a dash where there is none."""
    if not np.isfinite(value):
        return "–"
    size = abs(value)
    digits = 3 if size < 0.1 else 2 if size < 10.0 else 1 if size < 100.0 else 0
    return f"{value:.{digits}f}".replace("-", "\N{MINUS SIGN}")


def plain_log(axis: Axis) -> None:
    """Ticks of a log axis as plain numbers at the decades: the digits of powers would be too small to read."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def short_log(axis: Axis) -> None:
    """Ticks of a short log axis at 1 and 3 of every decade, as plain numbers."""
    axis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    plain_log(axis)


def _canvas(kind: str) -> type[FigureCanvasBase]:
    """What draws a figure's file of a kind; imported where such a file is written."""
    if kind == "pdf":
        from rrru.figures.pdf_canvas import FigureCanvasPdf

        return FigureCanvasPdf
    if kind == "png":
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        return FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    return FigureCanvasSVG


def save(figure: Figure, paths: Mapping[str, str], caption: str = "") -> None:
    """Write the files of a figure; they carry its caption but no date, and none is replaced before all are whole.

    paths: by kind, of `KINDS`. The same tables give the same bytes under the same versions of Matplotlib and its font
    library.
    """
    with whole(*paths.values()) as partial, print_style():
        arrange(figure)
        for kind, path in zip(paths, partial, strict=True):
            # straight to the canvas: savefig would draw everything a second time to arrange it
            figure.set_dpi(_DPI)
            undated, described = KINDS[kind]
            write = getattr(_canvas(kind)(figure), f"print_{kind}")
            write(path, metadata={undated: None, described: caption})


def arrange(figure: Figure) -> None:
    """Give the panels their places once, so that all files of a figure, and every later one, have them there."""
    if engine := figure.get_layout_engine():
        # of a line of text alone it would warn that there is nothing to arrange
        if figure.axes:
            engine.execute(figure)
        figure.set_layout_engine(None)
        # its solver's last digits differ from the first figure of a process to the next
        for axes in figure.axes:
            arranged = axes.get_in_layout()
            for which in ("original", "active"):
                place = axes.get_position(original=which == "original").bounds
                axes.set_position(np.round(place, 9), which=which)
            # a position that is set takes the panel out of every later arrangement
            axes.set_in_layout(arranged)


def height_axis(axes: Axes, z_down: bool) -> None:
    """Label the vertical axis as the robot frame's z and turn it round where z points down."""
    axes.set_ylabel("z (mm), down" if z_down else "z (mm)")
    if z_down:
        axes.invert_yaxis()
