"""Numbers of papers B and C beside this study's."""

import numpy as np

from rrru.errors import ConfigError
from rrru.robots.delta import Delta
from rrru.studies.delta import paper_c
from rrru.studies.ptt3 import paper_b

NUMBERS = {"B": paper_b.NUMBERS, "C": paper_c.NUMBERS}


def row(paper, number, here, spread, note=""):
    """Row of `published` for a printed number; here, spread: item to this study's number and to its (low, high), null
    for what is absent.
    """
    value = here.get(number.item, np.nan)
    low, high = spread.get(number.item, (np.nan, np.nan))
    return {
        "paper": paper,
        "item": number.item,
        "source": number.source,
        "unit": number.unit,
        "published": number.value,
        "here": value,
        "ratio": value / number.value if number.value else np.nan,
        "here_low": low,
        "here_high": high,
        "note": "; ".join(text for text in (number.note, note) if text),
    }


def sister_rows(here=None, spread=None):
    """Rows of `published` of papers B and C, null for what is absent.

    here: paper to {item: this study's number}; spread: paper to {item: (low, high)} over other draws. Raises
    ConfigError for an item that the paper does not have.
    """
    here, spread = here or {}, spread or {}
    rows = []
    for paper, numbers in NUMBERS.items():
        own = here.get(paper, {})
        unknown = sorted(set(own) - {number.item for number in numbers})
        if unknown:
            raise ConfigError(
                f"paper {paper} prints no {', '.join(unknown)}; known: {', '.join(number.item for number in numbers)}"
            )
        rows += [row(paper, number, own, spread.get(paper, {})) for number in numbers]
    return rows


def here_b(design, benefits, networks):
    """Numbers of this study for paper B, by item.

    design: {item: number} of what is configured, such as training_points. benefits: frame with the columns experiment
    (1 to 5), axis (x, y, z) and benefit_percent, eq. (21). networks: frame with the columns experiment, spread and
    steps; their median number of steps counts.
    """
    result = dict(design)
    for row in benefits.itertuples():
        result[f"benefit_{row.experiment}_{row.axis}"] = row.benefit_percent
    for row in networks.itertuples():
        result[f"spread_{row.experiment}"] = row.spread
    return result | {"training_steps": float(networks["steps"].median())}


def here_c(design, before_mm, after_mm):
    """Numbers of this study for paper C, by item.

    design: {item: number} of what is configured, such as poses. before_mm, after_mm: distances (n,) of measured from
    commanded points on the plane z = 0, before and after the zero calibration.
    """
    before_mm, after_mm = np.asarray(before_mm), np.asarray(after_mm)
    return {
        **design,
        **{f"beta{leg}_rad": angle for leg, angle in enumerate(Delta().azimuth_rad, start=1)},
        "legs": float(len(Delta().azimuth_rad)),
        "before_max": before_mm.max(),
        "before_mean": before_mm.mean(),
        "after_max": after_mm.max(),
        "after_mean": after_mm.mean(),
        "before_about": before_mm.mean(),
        "after_about": after_mm.mean(),
    }
