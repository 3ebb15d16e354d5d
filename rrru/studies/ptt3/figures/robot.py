"""Figures of paper B's robot: its singularities, its backlash and its repeatability."""

from matplotlib.lines import Line2D

from rrru.figures import style
from rrru.figures.choose import where
from rrru.figures.workspace import draw_measure

_LEVELS = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)
_SLICES = {"xz": ("x", "z", "y"), "xy": ("x", "y", "z")}
_LEGS = {1: style.BLUE, 2: style.ORANGE, 3: style.VERMILION}
_MARKS = {1: "o", 2: "s", 3: "^"}


@style.printed
def ptt_singularity(tables, options):
    """Distance of the 3-PTT from both kinds of singularity (paper B, 2.2), at y = 0 and at half the curve's height.
    On the line kappa, a factor of det J, vanishes. Hatched is out of reach.
    """
    grid, points = tables["ptt_singularity"], tables["ptt_points"]
    curve = points[points["experiment"] == points["experiment"].min()].sort_values("point")
    figure = style.new(style.DOUBLE_MM, 150.0)
    panels = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(0.55, 1.0))
    marks = iter("abcd")
    for row, (name, (across, up, normal)) in enumerate(_SLICES.items()):
        part = where(grid, slice=name)
        place = f"{part[f'{normal}_mm'].iloc[0]:g}".replace("-", "\N{MINUS SIGN}")
        fields = part.pivot(index=f"{up}_mm", columns=f"{across}_mm")
        for axes, measure in zip(panels[row], ("translational_measure", "constraint_measure"), strict=True):
            line = fields["kappa_mm2"] if measure == "translational_measure" else None
            places = [axis.to_numpy() for axis in (fields[measure].columns, fields[measure].index)]
            image = draw_measure(axes, places, fields[measure].to_numpy(dtype=float), line, _LEVELS)
            for colour, width in (("white", 2.0), ("black", 0.9)):
                axes.plot(curve[f"command_{across}_mm"], curve[f"command_{up}_mm"], color=colour, linewidth=width)
            axes.set(xlabel=f"{across} (mm)", aspect="equal")
            axes.set_title(f"({next(marks)}) {measure.replace('_', ' ')}, {normal} = {place} mm")
        panels[row, 0].set_ylabel(f"{up} (mm)")
    bar = {"location": "bottom", "aspect": 60, "fraction": 0.03, "spacing": "uniform"}
    figure.colorbar(image, ax=list(panels.ravel()), **bar).set_label(
        "singularity measure: 0 at a singularity, 1 at best"
    )
    handles = [
        Line2D([], [], color="black", linewidth=0.9, label="commanded curve (projected)"),
        Line2D([], [], color=style.VERMILION, linewidth=1.2, label="κ = 0: det J = 0"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=2)
    return figure


@style.printed
def ptt_backlash(tables, options):
    """Backlash of the screws (paper B, Figs. 7 and 8, Tables 4 to 6). (a) Encoder reading minus command while a
    screw is turned forwards, back and forwards again, least load. (b) Backlash by eq. (19) with two standard
    errors. (c) Scatter of the sliders per unit travel, the curve passed in both directions in turn, compared with the
    value from the tracker's noise alone.
    """
    figure = style.new(style.DOUBLE_MM, 70.0)
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.25, 1.0, 1.0))
    encoder, widths = tables["ptt_encoder"], tables["ptt_backlash"]
    for leg, colour in _LEGS.items():
        record = where(encoder, payload_kg=encoder["payload_kg"].min(), leg=leg).sort_values("sample")
        lag = record["encoder_mm"] - record["commanded_mm"]
        left.plot(record["commanded_mm"], lag, color=colour, linewidth=0.6, label=f"screw {leg}")
        part = where(widths, leg=leg).sort_values("payload_kg")
        middle.axhline(part["true_mm"].iloc[0], color=colour, linewidth=0.6, zorder=0)
        look = {"color": colour, "marker": _MARKS[leg], "markerfacecolor": "white", "linestyle": "none"}
        middle.errorbar(part["payload_kg"], part["backlash_mm"], 2.0 * part["standard_error_mm"], **look)
    left.set(xlabel="commanded slider position (mm)", ylabel="encoder - command (mm)")
    left.set_title("(a) forwards, back, forwards")
    middle.set(xlabel="payload (kg)", ylabel="backlash (mm)", ylim=(0.0, None))
    middle.set_title("(b) eq. (19); lines: true")
    _repeatability(right, tables["ptt_repeatability"])
    style.legend_above(figure, [left, right], columns=6)
    return figure


def _repeatability(axes, frame):
    """Scatter per travel of every slider, and the value from the tracker's noise alone."""
    for compensated, colour in ((False, "white"), (True, style.SKY)):
        part = where(frame, compensated=compensated).sort_values("leg")
        place = part["leg"] + (0.19 if compensated else -0.19)
        label = "backlash compensated" if compensated else "not compensated"
        axes.bar(place, part["per_travel_um_per_mm"], 0.36, color=colour, edgecolor="black", linewidth=0.6, label=label)
        noise = {"color": style.VERMILION, "marker": "_", "linestyle": "none", "markersize": 9}
        axes.plot(place, part["noise_um_per_mm"], label="tracker's noise", **noise)
    axes.set(xlabel="slider", ylabel="scatter per travel (µm/mm)", xticks=(1, 2, 3))
    axes.set_title("(c) repeatability")
