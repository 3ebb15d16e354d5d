"""Errors along a trajectory: common parts of the panels of paper A's figures 9 to 12."""

import numpy as np
from matplotlib.ticker import MaxNLocator

from rrru.figures import choose, style

# paper A, 3: the error that the task allows
TOLERANCE_MM = 2.0
_BAND_ALPHA, _BAND_LABEL = 0.15, "90 % of other draws"
# kinds of `redraw_errors` by the option that names the calibration
_BANDS = {"calibration_lines": "line", "calibration_spiral": "spiral"}


def _curve(tables, options, key, look, name):
    """Label, look and rows of `errors` of the errors after a calibration."""
    errors, mode = choose.after(tables, options, options[key], name)
    if mode == "closed_loop":
        errors = _with_band(errors, tables, _BANDS[key])
    return choose.after_label(options[key], mode), look, errors


def _with_band(errors, tables, kind):
    """Rows of `errors` with the range over other draws of a kind of `redraw_errors`, where there is one."""
    bands = tables["redraw_errors"]
    bands = bands[bands["calibration"] == kind].drop(columns="calibration")
    return errors if bands.empty else errors.merge(bands, on=["run", "trajectory", "point"], how="left")


def before_and_after(tables, options, name):
    """Curves (label, look, rows of `errors`) before and after the line calibration, for a figure of that name."""
    before = ("before calibration", style.BEFORE, _with_band(choose.before(tables, options, name), tables, "none"))
    return [before, _curve(tables, options, "calibration_lines", style.LINES, name)]


def both_calibrations(tables, options, name):
    """Curves (label, look, rows of `errors`) after the line calibration and after the spiral's."""
    looks = {"calibration_lines": style.LINES, "calibration_spiral": style.SPIRAL}
    return [_curve(tables, options, key, look, name) for key, look in looks.items()]


def draw_along(axes, curve, places, column="error_mm"):
    """Draw a curve along a path, its mean over the passes and their range; returns lowest and highest value.

    Behind a curve with a range over other draws this range is a lighter band.
    """
    label, look, errors = curve
    mean, low, high = choose.along(errors, places, (column,))
    axes.plot(mean.index, mean[column], label=label, **look)
    if f"{column}_low" in errors:
        _, bottom, top = choose.along(errors, places, (f"{column}_low", f"{column}_high"))
        band = {"color": look["color"], "alpha": _BAND_ALPHA, "linewidth": 0.0, "zorder": 0.5}
        axes.fill_between(mean.index, bottom[f"{column}_low"], top[f"{column}_high"], label=_BAND_LABEL, **band)
    if choose.passes(places) > 1:
        band = {"color": look["color"], "alpha": 0.18, "linewidth": 0.0}
        axes.fill_between(mean.index, low[column], high[column], label="range over the passes", **band)
    return low[column].min(), high[column].max()


def shade_near_singular(axes, places):
    """Shade the stations near a constraint singularity, where the platform can rotate."""
    near = np.unique(places.loc[places["status"] == "near_singularity", "station"])
    label = "near a singularity"
    for stretch in np.split(near, np.flatnonzero(np.diff(near) > 1) + 1) if near.size else []:
        axes.axvspan(stretch[0] - 0.5, stretch[-1] + 0.5, facecolor="#eeeeee", edgecolor="none", zorder=0, label=label)
        label = None


def tolerance(axes, signs=(1.0,)):
    """Mark the error that the task allows."""
    label = f"tolerance, {TOLERANCE_MM:g} mm"
    for sign in signs:
        axes.axhline(sign * TOLERANCE_MM, label=label, **style.TOLERANCE)
        label = None


def pass_note(places):
    """Number of passes where there is more than one: curves are then means."""
    count = choose.passes(places)
    return f", {count} passes" if count > 1 else ""


def finish(axes, places):
    """Whole points on the axis, half a point free at both ends, a grid."""
    axes.set_xlim(0.5, places["station"].max() + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    axes.grid(True)
