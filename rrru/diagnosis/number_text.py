"""Numbers, shares and probabilities in the words of an answer."""

import numpy as np

from rrru.diagnosis.aliases import Facts
from rrru.diagnosis.options import OPTIONS


def readable(name: str) -> str:
    """The name of an effect, or of several joined by +, as words."""
    return name.replace("_", " ").replace("+", " + ")


def rounded(value: float | None, digits: int = 2) -> str:
    """A number to some significant digits, without an exponent; "unknown" for None and what is not finite."""
    if value is None or not np.isfinite(value):
        return "unknown"
    if value == 0.0:
        return "0"
    places = digits - 1 - int(np.floor(np.log10(abs(value))))
    return f"{round(value, places):.{max(places, 0)}f}"


def with_interval(value: float, low: float, high: float, unit: str = "") -> str:
    """A number with its 95 % interval, all to two digits of the interval's half width.

    >>> with_interval(0.12014, 0.11902, 0.12126, "mm")
    '0.1201 mm (95 %: 0.1190 to 0.1213)'
    """
    places = 1 - int(np.floor(np.log10(0.5 * (high - low))))
    # a rounded number below zero that is zero has no sign
    size, least, most = (f"{round(one, places) + 0.0:.{max(places, 0)}f}" for one in (value, low, high))
    return f"{size}{' ' if unit else ''}{unit} (95 %: {least} to {most})"


def probability(value: float) -> str:
    """A probability to two digits that claims no certainty."""
    return "more than 0.99" if value > 0.995 else "less than 0.01" if value < 0.005 else f"{value:.2f}"


def percent(share: float) -> str:
    """A share in per cent, limited to 0 to 100: shares of confounded effects may be beyond."""
    return f"{100.0 * min(max(share, 0.0), 1.0):.0f} %"


def small_percent(share: float) -> str:
    """A share in per cent that is not rounded to nothing."""
    return "less than 1 %" if 0.0 < share < 0.005 else percent(share)


def share_with_interval(part: Facts, follow: str = "") -> str:
    """The share of a part of the budget, or of an effect, with its 95 % interval; no number where that says nothing."""
    if not is_determined(part):
        return f"an undetermined share{follow}"
    return f"{percent(part['share'])}{follow} (95 %: {percent(part['share_low'])} to {percent(part['share_high'])})"


def is_determined(part: Facts) -> bool:
    """Whether the 95 % interval of a share covers so little of 0 to 1 that the share says something."""
    low, high = (min(max(part[end], 0.0), 1.0) for end in ("share_low", "share_high"))
    return not high - low >= OPTIONS.max_share_interval


def capitalized(text: str) -> str:
    """A text with a capital first letter."""
    return text[:1].upper() + text[1:]
