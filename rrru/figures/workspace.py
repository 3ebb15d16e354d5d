"""Where in the workspace the trajectories lie, and how far from both kinds of singularity."""

import numpy as np
from matplotlib.colors import BoundaryNorm
from matplotlib.lines import Line2D

from rrru.errors import ConfigError
from rrru.figures import choose, style

# axes of a slice, and the one across it
_SLICES = {"xz": ("x", "z", "y"), "xy": ("x", "y", "z")}
# finer towards a singularity, which is what matters
_LEVELS = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 1.0)
_NEAR = {"color": style.VERMILION, "linestyle": "none", "marker": "o", "markersize": 2.6, "markerfacecolor": "white"}
_MEASURES = {"translational_measure": "translational measure", "constraint_measure": "constraint measure"}


@style.printed
def workspace(tables, options):
    """Distance from both kinds of singularity over the reachable workspace, and the commanded paths projected on
    it. Hatched is out of reach; on the line the constraint determinant changes its sign.
    """
    campaign = options["campaign"]
    grid_rows = choose.of_campaign(tables, "workspace", campaign, "workspace")
    slices = [name for name in _SLICES if (grid_rows["slice"] == name).any()]
    if not slices:
        raise ConfigError(f"workspace: campaign {campaign!r} has none of the slices {', '.join(_SLICES)}")
    points = _points(tables, campaign)
    shapes = {name: _grid(grid_rows[grid_rows["slice"] == name], name) for name in slices}
    ratios = [np.ptp(shape[1]) / np.ptp(shape[0]) for shape in shapes.values()]
    figure = style.new(style.DOUBLE_MM, 32.0 + 75.0 * sum(ratios) + 14.0 * len(slices))
    panels = figure.subplots(len(slices), 2, squeeze=False, sharey="row", sharex="row", height_ratios=ratios)
    marks = iter("abcdef")
    for row, (name, shape) in zip(panels, shapes.items(), strict=True):
        for axes, measure in zip(row, _MEASURES, strict=True):
            image = _panel(axes, shape, measure)
            _trajectories(axes, points, name)
            axes.set_title(f"({next(marks)}) {_MEASURES[measure]}, {shape[3]}")
        _axis_labels(row, name, options["z_down"])
    bar = figure.colorbar(
        image, ax=list(panels.ravel()), location="bottom", aspect=60, fraction=0.03, spacing="uniform"
    )
    bar.set_label("singularity measure: 0 at a singularity, 1 at best")
    figure.legend(handles=_legend(points), loc="outside upper center", ncols=3, columnspacing=1.4)
    return figure


def _grid(rows, name):
    """Horizontal and vertical coordinates of a slice, its fields (vertical, horizontal) by name, and where it lies as
    text.
    """
    across, up, normal = _SLICES[name]
    # what the robot cannot reach is shown as a margin only
    for axis in (across, up):
        place = rows[f"{axis}_mm"]
        reached = place[rows["reachable"].astype(bool)]
        margin = 0.04 * np.ptp(reached) if len(reached) else np.inf
        rows = rows[place.between(reached.min() - margin, reached.max() + margin)] if len(reached) else rows
    fields = {}
    for field in ("translational_measure", "constraint_measure", "constraint_determinant"):
        masked = rows[field].where(rows["reachable"].astype(bool))
        table = rows.assign(value=masked).pivot(index=f"{up}_mm", columns=f"{across}_mm", values="value")
        fields[field] = table.to_numpy(dtype=float)
    place = rows[f"{normal}_mm"].iloc[0]
    return table.columns.to_numpy(), table.index.to_numpy(), fields, f"{normal} = {place:g} mm"


def _points(tables, campaign):
    """Commanded points of the campaign with their singularity status."""
    singular = choose.of_campaign(tables, "singularity", campaign, "workspace")[["run", "point", "status"]]
    paths = tables["measurements"][["run", "trajectory", "point", *(f"command_{axis}_mm" for axis in "xyz")]]
    return paths.merge(singular, on=["run", "point"], how="left", validate="one_to_one")


def _panel(axes, shape, measure):
    """One measure over a slice, hatched where the robot cannot reach, with the zero line of the constraint
    determinant.
    """
    across, up, fields, _ = shape
    half = [np.diff(values).mean() / 2.0 for values in (across, up)]
    extent = (across[0] - half[0], across[-1] + half[0], up[0] - half[1], up[-1] + half[1])
    axes.patch.set(facecolor="white", edgecolor="#cccccc", hatch="////", linewidth=0.0)
    image = axes.imshow(
        np.ma.masked_invalid(fields[measure]),
        extent=extent,
        origin="lower",
        cmap=style.MEASURE,
        norm=BoundaryNorm(_LEVELS, 256),
        interpolation="none",
        aspect="equal",
    )
    determinant = np.ma.masked_invalid(fields["constraint_determinant"])
    if determinant.count() and determinant.min() < 0.0 < determinant.max():
        for color, width in (("white", 2.2), (style.VERMILION, 1.2)):
            axes.contour(across, up, determinant, levels=[0.0], colors=[color], linewidths=width)
    return image


def _trajectories(axes, points, name):
    """Every trajectory's first pass as a line, the points near a singularity marked."""
    across, up, _ = _SLICES[name]
    columns = [f"command_{across}_mm", f"command_{up}_mm"]
    for _, part in points.groupby("trajectory", sort=False):
        first = part[part["run"] == part["run"].iloc[0]].sort_values("point")
        axes.plot(first[columns[0]], first[columns[1]], color="white", linewidth=1.8, zorder=3)
        axes.plot(first[columns[0]], first[columns[1]], color="black", linewidth=0.8, zorder=4)
    near = points[points["status"] == "near_singularity"]
    axes.plot(near[columns[0]], near[columns[1]], **_NEAR, zorder=5)


def _axis_labels(row, name, z_down):
    """Labels of a row of panels."""
    across, up, _ = _SLICES[name]
    for axes in row:
        axes.set_xlabel(f"{across} (mm)")
    if up == "z":
        style.height_axis(row[0], z_down)
    else:
        row[0].set_ylabel(f"{up} (mm)")


def _legend(points):
    """What the lines and marks are."""
    handles = [
        Line2D([], [], color="black", linewidth=0.8, label="commanded paths (projected)"),
        Line2D([], [], color=style.VERMILION, linewidth=1.2, label="constraint determinant = 0"),
    ]
    if (points["status"] == "near_singularity").any():
        handles.append(Line2D([], [], label="commanded point near a singularity", **_NEAR))
    return handles
