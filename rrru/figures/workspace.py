"""Where in the workspace the trajectories lie, and how far from both kinds of singularity."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D

from rrru.arrays import FloatArray
from rrru.errors import ConfigError
from rrru.figures import choose, style
from rrru.figures.choose import Options, Tables

# axes of a slice, and the one across it
_SLICES = {"xz": ("x", "z", "y"), "xy": ("x", "y", "z")}
# finer towards a singularity, which is what matters
_LEVELS = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 1.0)
_NEAR: style.Look = {
    "color": style.VERMILION,
    "linestyle": "none",
    "marker": "o",
    "markersize": 2.6,
    "markerfacecolor": "white",
}
_PATH: style.Look = {"color": "black", "linewidth": 0.8}
_MEASURES = {"translational_measure": "translational measure", "constraint_measure": "constraint measure"}

_AT_POSES = {"translational_measure": "position Jacobian", "constraint_measure": "constraint measure"}
_VIEWS = ("side view", "top view")
_DOT: style.Look = {"s": 11.0, "edgecolors": "#444444", "linewidths": 0.25}
_NEAR_POSE: style.Look = {**_NEAR, "markersize": 6.0, "markerfacecolor": "none"}
_OF_LOOPS = "smallest singular value of the legs' unit wrenches, 0 at a singularity"
_BAR_PLACE: style.Look = {"location": "bottom", "aspect": 60, "fraction": 0.03, "spacing": "uniform"}
_BAR = "smallest / largest singular value of the position Jacobian, 0 at a singularity"
# a constraint measure above this is 1 up to rounding; heights of a view over its width
_NO_LOOP, _LOWEST, _HIGHEST = 1.0 - 1e-6, 0.35, 1.1

_FIELDS = (*_MEASURES, "constraint_determinant")


@style.printed
def workspace(tables: Tables, options: Options) -> Figure:
    """Distance from singularities, and the commanded points, projected. A robot that cannot orient its tool has it over
    the reachable workspace: hatched is out of reach; on the line the constraint determinant changes its sign. A robot
    that orients it has it at the commanded poses, since its reach depends on the orientation: the smallest over the
    largest singular value of the position Jacobian, angles times the characteristic length, and the constraint measure
    where legs close loops.
    """
    campaign = options["campaign"]
    facts = choose.of_campaign(tables, "campaigns", campaign, "workspace").iloc[0]
    grid_rows = choose.where(tables["workspace"], campaign=campaign)
    points = _points(tables, campaign)
    if grid_rows.empty:
        return _at_poses(points, bool(facts["z_down"]))
    slices = [name for name in _SLICES if (grid_rows["slice"] == name).any()]
    if not slices:
        raise ConfigError(f"workspace: campaign {campaign!r} has none of the slices {', '.join(_SLICES)}")
    grids = [_slice(grid_rows[grid_rows["slice"] == name], name) for name in slices]
    ratios = [np.ptp(grid.up_mm) / np.ptp(grid.across_mm) for grid in grids]
    figure = style.new(style.DOUBLE_MM, 32.0 + 75.0 * sum(ratios) + 14.0 * len(slices))
    panels = figure.subplots(len(slices), 2, squeeze=False, sharey="row", sharex="row", height_ratios=ratios)
    marks = iter("abcdef")
    for row, grid in zip(panels, grids, strict=True):
        for axes, (measure, meaning) in zip(row, _MEASURES.items(), strict=True):
            places = grid.across_mm, grid.up_mm
            image = draw_measure(axes, places, grid.fields[measure], grid.fields["constraint_determinant"])
            _trajectories(axes, points, grid)
            axes.set_title(f"({next(marks)}) {meaning}, {grid.place}")
            axes.set_xlabel(f"{grid.across} (mm)")
        if grid.up == "z":
            style.height_axis(row[0], bool(facts["z_down"]))
        else:
            row[0].set_ylabel(f"{grid.up} (mm)")
    bar = figure.colorbar(image, ax=list(panels.ravel()), **_BAR_PLACE)
    bar.set_label("singularity measure: 0 at a singularity, 1 at best")
    figure.legend(handles=_legend(points), loc="outside upper center", ncols=3, columnspacing=1.4)
    return figure


def _at_poses(points: pd.DataFrame, z_down: bool) -> Figure:
    """The commanded points from the side and from above, coloured by each measure at their own pose."""
    # an open chain has no constraint to lose: its constraint measure is 1 everywhere
    closed = bool((points["constraint_measure"] < _NO_LOOP).any())
    measures = dict(list(_AT_POSES.items())[: 1 + closed])
    spans = {axis: max(np.ptp(points[f"command_{axis}_mm"]), 1.0) for axis in "xyz"}
    ratios = [min(max(spans[up] / spans[across], _LOWEST), _HIGHEST) for across, up, _ in _SLICES.values()]
    figure = style.new(style.DOUBLE_MM, 34.0 + (75.0 * max(ratios) + 14.0) * len(measures))
    panels = figure.subplots(len(measures), 2, squeeze=False)
    marks = iter("abcd")
    for row, (measure, meaning) in zip(panels, measures.items(), strict=True):
        for axes, (across, up, _), view in zip(row, _SLICES.values(), _VIEWS, strict=True):
            image = axes.scatter(
                *(points[f"command_{axis}_mm"] for axis in (across, up)),
                c=points[measure],
                **_DOT,
                cmap=style.MEASURE,
                norm=BoundaryNorm(_LEVELS, 256),
            )
            near = points[points["status"] == "near_singularity"]
            axes.plot(near[f"command_{across}_mm"], near[f"command_{up}_mm"], **_NEAR_POSE)
            axes.set_title(f"({next(marks)}) {meaning}, {view}")
            axes.set(xlabel=f"{across} (mm)", ylabel=f"{up} (mm)", aspect="equal")
            axes.margins(0.06)
        style.height_axis(row[0], z_down)
    bar = figure.colorbar(image, ax=list(panels.ravel()), **_BAR_PLACE)
    bar.set_label(f"(a, b) {_BAR}\n(c, d) {_OF_LOOPS}" if closed else _BAR)
    if (points["status"] == "near_singularity").any():
        handle = Line2D([], [], label="commanded pose near a singularity", **_NEAR_POSE)
        figure.legend(handles=[handle], loc="outside upper center")
    return figure


@dataclass(frozen=True)
class _Slice:
    """Names and coordinates of a slice's two axes, its fields (vertical, horizontal) by name, its place as text."""

    across: str
    up: str
    across_mm: FloatArray
    up_mm: FloatArray
    fields: dict[str, FloatArray]
    place: str


def _slice(rows: pd.DataFrame, name: str) -> _Slice:
    """A slice from its rows of `workspace`; what the robot cannot reach is shown as a margin only."""
    across, up, normal = _SLICES[name]
    reachable = rows["reachable"].astype(bool)
    for axis in (across, up):
        position = rows[f"{axis}_mm"]
        reached = position[reachable.loc[rows.index]]
        step = np.diff(np.unique(position)).min(initial=np.inf)
        margin = max(0.04 * np.ptp(reached), 1.5 * step) if len(reached) else np.inf
        rows = rows[position.between(reached.min() - margin, reached.max() + margin)] if len(reached) else rows
    axes = {"index": f"{up}_mm", "columns": f"{across}_mm"}
    rows = rows.assign(**{field: rows[field].where(reachable) for field in _FIELDS})
    tables = {field: rows.pivot(**axes, values=field) for field in _FIELDS}
    fields = {field: table.to_numpy(dtype=float) for field, table in tables.items()}
    grid, place = tables["constraint_determinant"], f"{normal} = {rows[f'{normal}_mm'].iloc[0]:g} mm"
    return _Slice(across, up, grid.columns.to_numpy(), grid.index.to_numpy(), fields, place)


def _points(tables: Tables, campaign: str) -> pd.DataFrame:
    """Commanded points of the campaign with their singularity status and measures."""
    columns = ["run", "point", "status", *_MEASURES]
    singular = choose.of_campaign(tables, "singularity", campaign, "workspace")[columns]
    paths = tables["measurements"][["run", "trajectory", "point", *(f"command_{axis}_mm" for axis in "xyz")]]
    return paths.merge(singular, on=["run", "point"], how="left", validate="one_to_one")


def draw_measure(
    axes: Axes,
    places_mm: tuple[FloatArray, FloatArray],
    measure: FloatArray,
    line: FloatArray | None = None,
    levels: Sequence[float] = _LEVELS,
) -> AxesImage:
    """One measure over a slice (vertical, horizontal) as an image, hatched out of reach; returns the image.

    places_mm: horizontal and vertical coordinates; line: field whose zero line is drawn where it changes its sign.
    """
    across, up = places_mm
    half = [np.diff(values).mean() / 2.0 for values in places_mm]
    axes.patch.set(facecolor="white", edgecolor="#cccccc", hatch="////", linewidth=0.0)
    image = axes.imshow(
        np.ma.masked_invalid(measure),
        extent=(across[0] - half[0], across[-1] + half[0], up[0] - half[1], up[-1] + half[1]),
        origin="lower",
        cmap=style.MEASURE,
        norm=BoundaryNorm(levels, 256),
        interpolation="none",
        aspect="equal",
    )
    values = np.ma.masked_invalid([] if line is None else line)
    if values.count() and values.min() < 0.0 < values.max():
        for color, width in (("white", 2.2), (style.VERMILION, 1.2)):
            axes.contour(across, up, values, levels=[0.0], colors=[color], linewidths=width)
    return image


def _trajectories(axes: Axes, points: pd.DataFrame, grid: _Slice) -> None:
    """Every trajectory's first pass as a line, the points near a singularity marked."""
    across, up = f"command_{grid.across}_mm", f"command_{grid.up}_mm"
    for _, part in points.groupby("trajectory", sort=False):
        first = part[part["run"] == part["run"].iloc[0]].sort_values("point")
        for look in ({"color": "white", "linewidth": 1.8, "zorder": 3}, {**_PATH, "zorder": 4}):
            axes.plot(first[across], first[up], **look)
    near = points[points["status"] == "near_singularity"]
    axes.plot(near[across], near[up], **_NEAR, zorder=5)


def _legend(points: pd.DataFrame) -> list[Line2D]:
    """What the lines and marks are."""
    handles = [
        Line2D([], [], **_PATH, label="commanded paths (projected)"),
        Line2D([], [], color=style.VERMILION, linewidth=1.2, label="constraint determinant = 0"),
    ]
    if (points["status"] == "near_singularity").any():
        handles.append(Line2D([], [], label="commanded point near a singularity", **_NEAR))
    return handles
