"""All groups, each in a separate process; then the table, the figure and the page: `make bench`.

The figure is docs/benchmarks.png, the page docs/benchmarks.md.
"""

import platform
import subprocess
import sys
from os import cpu_count
from pathlib import Path

import numpy as np

from benchmarks import harness
from benchmarks.harness import OURS, RESULTS
from rrru.figures import style
from rrru.store import tables

GROUPS = ("objective", "genetic", "least_squares", "solver", "kinematics", "sysid", "diagnosis", "workflow")
# run only by name: they take an hour or more, and have separate tables
LONG_GROUPS = ("coverage", "noise_found")
_DOCS = RESULTS.parent / "docs"
_BEGIN, _END = "<!-- measured -->\n", "<!-- end of what was measured -->\n"
_ROW_MM, _TITLE_ROWS, _AROUND_MM = 4.3, 1.5, 16.0
# growth and overheads are in the table only
_NOT_DRAWN = ("diagnosis", "solver", "workflow")
_UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


def main(groups):
    """Run groups, by default all except the long ones, and write the page with the last results of the others."""
    known = (*GROUPS, *LONG_GROUPS)
    if unknown := set(groups) - set(known):
        sys.exit(f"no group {unknown.pop()!r}; allowed: {', '.join(known)}")
    for group in groups or GROUPS:
        print(f"{group} ..", flush=True)
        subprocess.run([sys.executable, "-m", f"benchmarks.{group}"], cwd=RESULTS.parent, check=True)
    if groups and not set(groups) & set(GROUPS):
        return
    parts = [path for path in map(harness.part, GROUPS) if path.exists()]
    whole = harness.RESULTS / harness.TABLE.path
    tables.gather(parts, whole)
    write_page(tables.read(whole))


def write_page(frame):
    """Draw the figure of the whole table, and write the table into the page."""
    style.save(ratios({"benchmarks": frame}, {}), {"png": _DOCS / "benchmarks.png"}, "")
    page = _DOCS / "benchmarks.md"
    before, _, after = page.read_text().partition(_BEGIN)
    page.write_text(before + _BEGIN + f"\nOn {machine()}:\n\n{table(frame)}\n" + _END + after.partition(_END)[2])


def machine():
    """The kind of machine."""
    # other systems than Linux do not have this file
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{cpu_count()} cores of {names[0] if names else platform.machine()}, Python {platform.python_version()}"


def table(frame):
    """The table as Markdown."""
    head = "| task | size | who | time | ratio | quartiles | notes |"
    rows = [head, "| --- | --- | --- | --- | --- | --- | --- |"]
    for row in frame.itertuples():
        spread = "" if np.isnan(row.ratio) or row.low == row.high else f"{_short(row.low)} to {_short(row.high)}"
        notes = [f"{row.evaluations:,.0f} evaluations"] if row.evaluations > 0 else []
        notes += [f"{row.memory_mib:.0f} MiB"] if row.memory_mib > 0 else []
        notes += [row.note] if row.note else []
        cells = row.what, f"{row.size:,}", row.peer, _time(row.seconds), _short(row.ratio), spread, "; ".join(notes)
        rows.append("| " + " | ".join(cells) + " |")
    return "\n".join(rows)


def _short(number):
    """A number with three digits, empty for NaN."""
    if np.isnan(number):
        return ""
    return f"{number:,.0f}" if number >= 1000.0 else f"{number:.3g}"


def _time(seconds):
    """Seconds in a readable unit."""
    if np.isnan(seconds):
        return ""
    size, unit = next((pair for pair in _UNITS if seconds >= pair[0]), _UNITS[-1])
    return f"{_short(seconds / size)} {unit}"


@style.printed
def ratios(tables, _options):
    """Seconds of others over this package's, median and quartiles of pairs timed in turns, on a log axis.

    Right of 1 the others take longer.
    """
    frame = tables["benchmarks"]
    drawn = frame[frame["ratio"].notna() & (frame["peer"] != OURS) & ~frame["group"].isin(_NOT_DRAWN)]
    tasks = list(dict.fromkeys(drawn["what"]))
    heights = [(drawn["what"] == task).sum() + _TITLE_ROWS for task in tasks]
    figure = style.new(style.DOUBLE_MM, _ROW_MM * sum(heights) + _AROUND_MM)
    panels = figure.subplots(len(tasks), 1, sharex=True, height_ratios=heights, squeeze=False)[:, 0]
    for axes, task in zip(panels, tasks, strict=True):
        _panel(axes, drawn[drawn["what"] == task], task)
    panels[-1].set_xlabel("seconds of others / seconds of rrru (log; right of 1 rrru is faster)")
    return figure


def _panel(axes, rows, task):
    """One task."""
    place, middle = np.arange(len(rows)), rows["ratio"].to_numpy()
    spread = np.abs([middle - rows["low"], rows["high"] - middle])
    axes.axvline(1.0, **style.TOLERANCE)
    for faster, color in ((True, style.BLUE), (False, style.ORANGE)):
        chosen = (middle >= 1.0) == faster
        bars = {"fmt": "o" if faster else "s", "color": color, "ecolor": style.BLACK, "capsize": 2.0}
        axes.errorbar(middle[chosen], place[chosen], xerr=spread[:, chosen], elinewidth=0.7, **bars)
    for row, at in zip(middle, place, strict=True):
        axes.annotate(
            _short(row),
            (1.0, at),
            xycoords=("axes fraction", "data"),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=7.0,
        )
    axes.set_xscale("log")
    style.plain_log(axes.xaxis)
    axes.set_yticks(place, rows["peer"])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_title(task)
    axes.grid(axis="x")


if __name__ == "__main__":
    main(sys.argv[1:])
