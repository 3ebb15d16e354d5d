"""Errors along a trajectory: common parts of the panels of paper A's figures 9 to 12."""

import numpy as np
from matplotlib.ticker import MaxNLocator

from rrru.figures import choose, style

# paper A, 3: the error that the task allows
TOLERANCE_MM = 2.0


def _curve(tables, options, key, look, name):
    """Label, look and rows of `errors` of the errors after a calibration."""
    errors, mode = choose.after(tables, options, options[key], name)
    return choose.after_label(options[key], mode), look, errors


def before_and_after(tables, options, name):
    """Curves (label, look, rows of `errors`) before and after the line calibration, for a figure of that name."""
    before = ("before calibration", style.BEFORE, choose.before(tables, options, name))
    return [before, _curve(tables, options, "calibration_lines", style.LINES, name)]


def both_calibrations(tables, options, name):
    """Curves (label, look, rows of `errors`) after the line calibration and after the spiral's."""
    looks = {"calibration_lines": style.LINES, "calibration_spiral": style.SPIRAL}
    return [_curve(tables, options, key, look, name) for key, look in looks.items()]


def draw_along(axes, curve, places, column="error_mm"):
    """Draw a curve along a path, its mean over the passes and their range; returns lowest and highest value."""
    label, look, errors = curve
    mean, low, high = choose.along(errors, places, (column,))
    axes.plot(mean.index, mean[column], label=label, **look)
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
