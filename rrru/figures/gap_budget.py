"""The budget of a gap as one stacked bar with the intervals of its parts."""

import numpy as np

from rrru.figures import style

_COLOURS = {"scatter": "#aaaaaa", "runs": "#cccccc", "unexplained": "#d55e00", "calibration": "#eeeeee"}
# what completes the parts to the whole: products of two of them, and what the draw of the noise leaves
_RESTS = {"covariance": "/////", "sampling": "....."}
_EFFECTS = (style.BLUE, "#56b4e9", "#009e73", "#cc79a7", "#f0e442", "#0072b2")
# parts of a smaller share are not drawn, or not named; names stand inside of parts wider than this for each letter
_LEAST, _NAMED, _LETTER = 0.01, 0.03, 0.0125


def draw(axes, rows):
    """Parts of `gap_budget` one after the other: effects by share, then what does not repeat, runs and the unknown.

    A thin line in each part is its 95 % interval, counted from the part's beginning. Covariances of parts (hatched) and
    the sampling of the noise (dotted) complete them to 1; negative ones extend to the left of 0.
    """
    shown = rows[(rows["share"] > _LEAST) & ~rows["kind"].isin(["covariance", "sampling"])]
    effects = shown[shown["kind"] == "effect"].sort_values("share", ascending=False)
    others = [part for kind in _COLOURS for part in shown[shown["kind"] == kind].to_dict("records")]
    start, below = 0.0, False
    for number, part in enumerate([*effects.to_dict("records"), *others]):
        colour = _COLOURS.get(part["kind"], _EFFECTS[number % len(_EFFECTS)])
        axes.barh(0.0, part["share"], left=start, height=0.6, color=colour, edgecolor="white", linewidth=0.6)
        low, high = (start + max(part[name], 0.0) for name in ("share_low", "share_high"))
        # one below the other, where they overlap
        axes.plot([low, high], [-0.12 - 0.05 * (number % 4)] * 2, color="black", linewidth=0.7, solid_capstyle="butt")
        text = f"{part['part'].replace('_', ' ')} {100.0 * part['share']:.0f} %"
        middle = start + 0.5 * part["share"]
        if part["share"] > _LETTER * len(text):
            ink = "white" if colour == style.BLUE else "black"
            axes.text(middle, 0.1, text, ha="center", va="center", fontsize=7.0, color=ink, in_layout=False)
        elif part["share"] > _NAMED:
            place = {"ha": "center", "va": "top" if below else "bottom", "fontsize": 7.0, "in_layout": False}
            axes.text(middle, -0.36 if below else 0.34, text, **place)
            below = not below
        start += part["share"]
    least = _rests(axes, rows, start)
    axes.set(xlim=(min(least[0], 0.0), max(start, least[1], 1.0)), ylim=(-0.75, 0.75), yticks=[])
    axes.set(xlabel="share of the gap's mean square", ylabel="budget")
    for side in ("left", "right", "top"):
        axes.spines[side].set_visible(False)


def _rests(axes, rows, start):
    """Draw covariances and sampling as one part each from `start` on, negative ones to the left of 0; both ends."""
    ends = {1.0: start, -1.0: 0.0}
    for kind, hatch in _RESTS.items():
        share = float(rows.loc[rows["kind"] == kind, "share"].sum())
        if abs(share) <= _LEAST:
            continue
        sign = float(np.sign(share))
        look = {"facecolor": "white", "edgecolor": "#777777", "hatch": hatch, "linewidth": 0.6}
        axes.barh(0.0, share, left=ends[sign], height=0.6, **look)
        if abs(share) > _NAMED:
            place = {"ha": "center", "va": "bottom", "fontsize": 7.0, "in_layout": False}
            axes.text(
                ends[sign] + 0.5 * share, 0.34, f"{kind} {100.0 * share:.0f} %".replace("-", "\N{MINUS SIGN}"), **place
            )
        ends[sign] += share
    return ends[-1.0], ends[1.0]
