"""The budget of a gap as one stacked bar with the intervals of its parts."""

from rrru.figures import style

_COLOURS = {"scatter": "#aaaaaa", "runs": "#cccccc", "unexplained": "#d55e00", "calibration": "#eeeeee"}
# what completes the parts to the whole: products of two of them, and what the draw of the noise leaves
_RESTS = {"covariance": "/////", "sampling": "....."}
_EFFECTS = (style.BLUE, "#56b4e9", "#009e73", "#cc79a7", "#f0e442", "#0072b2")
# parts of a smaller share are not drawn, or not named; names stand inside of parts wider than this for each letter
_LEAST, _NAMED, _LETTER = 0.01, 0.03, 0.0125
# of names above and below the bar
_NAME_HEIGHTS = (0.34, -0.36)


def draw(axes, rows):
    """Parts of `gap_budget` one after the other: effects by share, then what does not repeat, runs and the unknown.

    A thin line in each part is its 95 % interval, counted from the part's beginning. Covariances of parts (hatched) and
    the sampling of the noise (dotted) complete them to 1; negative ones extend to the left of 0.
    """
    shown = rows[(rows["share"] > _LEAST) & ~rows["kind"].isin(["covariance", "sampling"])]
    effects = shown[shown["kind"] == "effect"].sort_values("share", ascending=False)
    others = [part for kind in _COLOURS for part in shown[shown["kind"] == kind].to_dict("records")]
    rests = rows[rows["kind"].isin([*_RESTS])].groupby("kind")["share"].sum()
    limits = min(rests[rests < 0.0].sum(), 0.0), max(shown["share"].sum() + rests[rests > 0.0].sum(), 1.0)
    # where names above and below the bar end so far
    taken = dict.fromkeys(_NAME_HEIGHTS, limits[0])
    least = _rests(axes, rests[rests < 0.0], 0.0, limits, taken)
    start = 0.0
    for number, part in enumerate([*effects.to_dict("records"), *others]):
        colour = _COLOURS.get(part["kind"], _EFFECTS[number % len(_EFFECTS)])
        axes.barh(0.0, part["share"], left=start, height=0.6, color=colour, edgecolor="white", linewidth=0.6)
        low, high = (start + max(part[name], 0.0) for name in ("share_low", "share_high"))
        # one below the other, where they overlap
        axes.plot([low, high], [-0.12 - 0.05 * (number % 4)] * 2, color="black", linewidth=0.7, solid_capstyle="butt")
        text = f"{part['part'].replace('_', ' ')} {100.0 * part['share']:.0f} %"
        middle = start + 0.5 * part["share"]
        if part["share"] > _width(text, limits):
            ink = "white" if colour == style.BLUE else "black"
            axes.text(middle, 0.1, text, ha="center", va="center", fontsize=7.0, color=ink, in_layout=False)
        elif part["share"] > _NAMED:
            _name(axes, text, middle, limits, taken)
        start += part["share"]
    most = _rests(axes, rests[rests > 0.0], start, limits, taken)
    axes.set(xlim=(min(least, 0.0), max(start, most, 1.0)), ylim=(-0.75, 0.75), yticks=[])
    axes.set(xlabel="share of the gap's mean square", ylabel="budget")
    for side in ("left", "right", "top"):
        axes.spines[side].set_visible(False)


def _width(text, limits):
    """Width of a text over a bar between limits, in shares."""
    return _LETTER * len(text) * (limits[1] - limits[0])


def _name(axes, text, middle, limits, taken):
    """Write the name of a part above or below its middle, where no other one is, within the limits of the bar."""
    width = _width(text, limits)
    wanted = max(min(middle - 0.5 * width, limits[1] - width), limits[0])
    height = min(taken, key=lambda one: max(taken[one] - wanted, 0.0))
    left = max(wanted, taken[height])
    taken[height] = left + width
    axes.text(left, height, text, ha="left", va="bottom" if height > 0.0 else "top", fontsize=7.0, in_layout=False)


def _rests(axes, shares, start, limits, taken):
    """Draw covariances and sampling of one sign, shares by kind, as one part each from `start` on; returns the end."""
    for kind in _RESTS:
        share = float(shares.get(kind, 0.0))
        if abs(share) <= _LEAST:
            continue
        look = {"facecolor": "white", "edgecolor": "#777777", "hatch": _RESTS[kind], "linewidth": 0.6}
        axes.barh(0.0, share, left=start, height=0.6, **look)
        if abs(share) > _NAMED:
            text = f"{kind} {100.0 * share:.0f} %".replace("-", "\N{MINUS SIGN}")
            _name(axes, text, start + 0.5 * share, limits, taken)
        start += share
    return start
