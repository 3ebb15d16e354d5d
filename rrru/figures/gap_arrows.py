"""The gap as arrows over the workspace: a top view, and a side view below it."""

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import ListedColormap, Normalize

from rrru.figures import style

# axes of each view
VIEWS = {"top view": ("x", "y"), "side view": ("x", "z")}
# more arrows than this hide each other
_MOST_ARROWS = 400
# the largest arrow over the width of the view, and the size that the scale holds; single larger ones may stand out
_ARROW_SHARE, _LARGEST_PERCENT = 0.08, 99.0
_MARGIN = 0.03
# points of a path are nearer to each other than this share of the workspace
_PATH_SHARE = 0.2
_ARROW = {"width": 0.0035, "headwidth": 3.5, "headlength": 4.0, "headaxislength": 3.5}
_RING = {"color": style.VERMILION, "marker": "o", "markersize": 9.0, "markerfacecolor": "none", "markeredgewidth": 1.4}


def shades():
    """Colours of the arrows: viridis without its light end, dark for large gaps."""
    return ListedColormap(colormaps[style.MEASURE](np.linspace(0.85, 0.0, 256)))


def height_ratio(points, view):
    """Height over width of a view."""
    low, high = _limits(points, VIEWS[view])
    return max((high[1] - low[1]) / (high[0] - low[0]), 0.3)


def draw(panels, points, worst, z_down=True):
    """Draw both views into axes by name.

    Returns the arrows, whether some are larger than the scale holds, and how much they are magnified.

    points: rows of gap_points that are used, with `before_mm`; worst (3,); z_down: the robot frame's z points down.
    """
    size = points["before_mm"].to_numpy()
    scale = Normalize(0.0, max(np.percentile(size, _LARGEST_PERCENT), 1e-9) if len(size) else 1.0)
    span = max(np.ptp(points[f"command_{axis}_mm"]) for axis in "xyz")
    factor = style.magnification(np.array([scale.vmax]), span, _ARROW_SHARE)
    shown = _thinned(points)
    for name, plane in VIEWS.items():
        arrows = _view(panels[name], points, shown, plane, scale, factor, z_down)
        panels[name].plot(*worst[["xyz".index(axis) for axis in plane]], linestyle="none", zorder=6, **_RING)
    panels["top view"].tick_params(labelbottom=False)
    panels["side view"].set_xlabel("x (mm)")
    return arrows, bool((size > scale.vmax * (1.0 + 1e-9)).any()), factor


def fit(figure, panels, points):
    """Widen the views where the page is too low for them, so that both hold all points."""
    engine, needed = figure.get_layout_engine(), []
    style.arrange(figure)
    for name, plane in VIEWS.items():
        (low, high), box = _limits(points, plane), panels[name].get_window_extent()
        needed.append((high[1] - low[1]) / (high[0] - low[0]) * box.width / box.height)
    widen = max(needed)
    if widen > 1.0:
        # other numbers at the axes take other room
        figure.set_layout_engine(engine)
        panels["side view"].set_xlim(0.5 * ((high + low)[0] + widen * (high - low)[0] * np.array([-1.0, 1.0])))


def _view(axes, points, shown, plane, scale, factor, z_down):
    """One view: the paths as grey lines, the gap's part in the plane as arrows coloured by its size in space.

    Lines between poses in no order would show nothing and hide the arrows.
    """
    across, up = (f"command_{axis}_mm" for axis in plane)
    span = max(np.ptp(points[f"command_{axis}_mm"]) for axis in "xyz") if len(points) else 0.0
    for _, run in points.groupby("run", sort=False):
        place = run[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy(dtype=float)
        steps = np.linalg.norm(np.diff(place, axis=0), axis=1)
        if len(steps) and np.median(steps) < _PATH_SHARE * span:
            axes.plot(run[across], run[up], color="#cccccc", linewidth=0.5, zorder=1)
    columns = (across, up, *(f"before_{axis}_mm" for axis in plane), "before_mm")
    size = {"angles": "xy", "scale_units": "xy", "scale": 1.0 / factor, "cmap": shades(), "norm": scale}
    arrows = axes.quiver(*shown[list(columns)].to_numpy().T, **size, **_ARROW, zorder=3)
    low, high = _limits(points, plane)
    # the views share x, so that what is left of a panel's height widens y
    axes.update_datalim([low, high])
    axes.set(xlim=(low[0], high[0]), aspect="equal", adjustable="datalim")
    if plane[1] == "z":
        style.height_axis(axes, z_down)
    else:
        axes.set_ylabel(f"{plane[1]} (mm)")
    axes.grid(True)
    return arrows


def _limits(points, plane):
    """Lower and upper corner (2,) of a view, with a margin for the arrows."""
    place = points[[f"command_{axis}_mm" for axis in plane]].to_numpy(dtype=float)
    span = max(np.ptp(points[f"command_{axis}_mm"]) for axis in "xyz") if len(points) else 1.0
    margin = (_MARGIN + _ARROW_SHARE) * max(span, 1.0)
    return (place.min(axis=0) - margin, place.max(axis=0) + margin) if len(place) else (np.zeros(2), np.ones(2))


def _thinned(points):
    """Every n-th point of each run, large gaps last so that they lie on top."""
    step = max(-(-len(points) // _MOST_ARROWS), 1)
    place = points.groupby("run", sort=False).cumcount()
    return points[place % step == 0].sort_values("before_mm", kind="stable")
