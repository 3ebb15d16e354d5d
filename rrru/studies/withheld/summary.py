"""The scores of the check on withheld effects in figures, beside what the diagnosis is meant to reach."""

import numpy as np
import pandas as pd

_Z = 1.959963984540054
_BINS = 10
_NEAR = 0.05
_IMITATED = 0.8


def wilson(hits, count):
    """95 % interval of a share from hits out of a count (E. B. Wilson, JASA 22, 1927); NaN for none."""
    if not count:
        return np.nan, np.nan
    share, spread = hits / count, _Z**2 / count
    centre = (share + 0.5 * spread) / (1.0 + spread)
    half = _Z * np.sqrt(share * (1.0 - share) / count + 0.25 * spread / count) / (1.0 + spread)
    return float(centre - half) if hits else 0.0, float(centre + half) if hits < count else 1.0


def calibration_error(probability, right):
    """Expected calibration error of stated probabilities (n,) for what turned out right (n,): bins of equal counts,
    sorted by probability.
    """
    if not len(right):
        return np.nan
    order = np.argsort(np.asarray(probability, dtype=float), kind="stable")
    stated, found = np.asarray(probability, dtype=float)[order], np.asarray(right, dtype=float)[order]
    bins = np.array_split(np.arange(len(order)), min(_BINS, len(order)))
    return float(sum(len(b) * abs(stated[b].mean() - found[b].mean()) for b in bins) / len(order))


def summary(scores, limits):
    """Frame `withheld_summary` from `withheld_scores` and `withheld_limits`."""
    scores = scores.merge(limits[["check", "robot", "weakest", "imitated_share"]], "left", ["check", "robot"])
    parts = {"label": _label, "effect": _effect, "field": _field}
    present = [check for check in parts if (scores["check"] == check).any()]
    return pd.DataFrame(
        [row | {"check": check} for check in present for row in parts[check](scores[scores["check"] == check])]
    )


def _label(scores):
    """Rows of the robots whose effects are hidden."""
    kind = scores["truth"].map(_truth_kind)
    one, two, none, outside = (scores[kind == name] for name in ("one", "two", "none", "outside"))
    strong = one[one["strength"] >= 1.5]
    weak = one[one["strength"].between(0.3, 1.0)]
    both = two[two["weakest"] >= 1.0]
    legs = strong[strong["truth_leg"] > 0]
    known = strong[strong["right"]].dropna(subset=["share_closed", "share_closed_true"])
    near = (known["share_closed"] - known["share_closed_true"]).abs() <= _NEAR
    rows = [
        _share("one effect, gap >= 1.5 x noise", "named exactly", strong["right"], 0.98),
        _share("nothing acts", "false alarms", ~none["right"].astype(bool), 0.01),
        _share(
            "outside the library, gap >= 2 x noise", "unexplained", outside["right"][outside["strength"] >= 2.0], 0.95
        ),
        _share("two effects", "both named exactly", two["right"], 0.85),
        _share("two effects, each >= 1 x noise", "both named exactly", both["right"]),
        _share("two effects", "at least one named, nothing wrong", _some_named(two)),
        _share("one leg at fault, gap >= 1.5 x noise", "leg named", legs["leg_right"], 0.95),
        _share(
            "one effect, gap 0.3 to 1 x noise, oracle detects it",
            "named exactly",
            weak["right"][weak["oracle_detects"]],
            0.9,
        ),
        _share("one effect, gap 0.3 to 1 x noise", "oracle detects it", weak["oracle_detects"]),
        _share("one effect, gap 0.3 to 1 x noise", "named exactly", weak["right"]),
        _plain(
            "all",
            "expected calibration error",
            len(scores),
            calibration_error(scores["probability"], scores["right"]),
            0.05,
        ),
        _share("one effect named, gap >= 1.5 x noise", "share closed predicted within 0.05", near, 0.9),
    ]
    for effect in sorted(one["truth"].unique()):
        rows.append(
            _share(f"{effect} alone, gap >= 1.5 x noise", "named exactly", strong["right"][strong["truth"] == effect])
        )
        rows.append(_share(f"{effect} alone", "named exactly", one["right"][one["truth"] == effect]))
    return rows


def _effect(scores):
    """Rows of the robots whose effect was taken out of the library."""
    alone = scores["imitated_share"] < _IMITATED
    rows = [
        _share("all", "unexplained", scores["right"], 0.95),
        _share(f"others imitate less than {_IMITATED:g} of the gap", "unexplained", scores["right"][alone]),
        _share(f"others imitate {_IMITATED:g} of the gap or more", "unexplained", scores["right"][~alone]),
    ]
    return rows + [_share(effect, "unexplained", part["right"]) for effect, part in scores.groupby("truth")]


def _field(scores):
    """Rows of the recorded campaigns."""
    legs = scores[scores["truth_leg"] > 0]
    rows = [_share("all", "named exactly", scores["right"]), _share("one leg at fault", "leg named", legs["leg_right"])]
    kind = scores["truth"].map(_truth_kind)
    rows += [
        _share(f"truth: {name}", "named exactly", scores["right"][kind == name])
        for name in ("none", "one", "two", "outside")
    ]
    return rows


def _truth_kind(truth):
    """none, one, two or outside."""
    if truth.startswith(("outside", "unexplained")):
        return "outside"
    return "none" if truth == "none" else ("one", "two")[min(truth.count("+"), 1)]


def _some_named(scores):
    """Whether a verdict names one of the true effects and no other (n,)."""
    pairs = zip(scores["truth"], scores["verdict"], strict=True)
    return np.array([bool(set(v.split("+")) <= set(t.split("+"))) for t, v in pairs], dtype=bool)


def _share(group, figure, hits, asked=np.nan):
    """A row that is a share of robots."""
    hits = np.asarray(hits, dtype=float)
    low, high = wilson(hits.sum(), len(hits))
    return _plain(group, figure, len(hits), hits.mean() if len(hits) else np.nan, asked) | {"low": low, "high": high}


def _plain(group, figure, robots, value, asked=np.nan):
    """A row that is a number of its own."""
    return {
        "group": group,
        "figure": figure,
        "robots": robots,
        "value": value,
        "low": np.nan,
        "high": np.nan,
        "asked": asked,
    }
