"""Robots as round bars and discs, seen from one side and a little above."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from rrru.arrays import FloatArray
from rrru.figures import style
from rrru.figures.choose import Options, Tables

_AZIMUTH, _ELEVATION = np.radians(-60.0), np.radians(18.0)
_CORNERS = 24


@style.printed
def solids(tables: Tables, _options: Options) -> Figure:
    """The robots that MuJoCo simulates, in their home poses; lengths in mm."""
    rows = tables["solids"]
    names = list(rows["model"].unique())
    figure = style.new(style.DOUBLE_MM, 62.0)
    for axes, name in zip(figure.subplots(1, len(names), squeeze=False)[0], names, strict=True):
        _draw(axes, rows[rows["model"] == name])
        axes.set_title(name)
    return figure


def _draw(axes: Axes, rows: pd.DataFrame) -> None:
    """The solids of one robot, the farthest first, and a bar of 200 mm."""
    right = np.array([-np.sin(_AZIMUTH), np.cos(_AZIMUTH), 0.0])
    near = np.array([np.cos(_ELEVATION) * np.cos(_AZIMUTH), np.cos(_ELEVATION) * np.sin(_AZIMUTH), np.sin(_ELEVATION)])
    view = np.stack([right, np.cross(near, right), near])
    ends = np.stack([rows[[f"{axis}{k}_mm" for axis in "xyz"]].to_numpy(dtype=float) for k in (1, 2)], axis=1)
    for number in np.argsort((ends @ near).mean(axis=1)):
        outline = _outline(ends[number], float(rows["radius_mm"].iloc[number]), view)
        axes.add_patch(Polygon(outline, facecolor=rows["colour"].iloc[number], edgecolor="black", linewidth=0.3))
    axes.autoscale_view()
    axes.set_aspect("equal")
    low, floor = axes.get_xlim()[0], axes.get_ylim()[0]
    axes.plot([low, low + 200.0], [floor, floor], color="black", linewidth=1.2)
    axes.annotate("200 mm", (low + 100.0, floor), (0.0, -9.0), textcoords="offset points", ha="center", fontsize=7.0)
    axes.set_axis_off()


def _outline(ends: FloatArray, radius: float, view: FloatArray) -> FloatArray:
    """Outline (k, 2) of a round bar between ends (2, 3) as seen: the hull of both its circles."""
    from scipy.spatial import ConvexHull

    along = ends[1] - ends[0]
    _, _, frame = np.linalg.svd(along[None])
    angle = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)[:, None]
    circle = radius * (np.cos(angle) * frame[1] + np.sin(angle) * frame[2])
    seen = np.concatenate([end + circle for end in ends]) @ view[:2].T
    outline: FloatArray = seen[ConvexHull(seen).vertices]
    return outline
