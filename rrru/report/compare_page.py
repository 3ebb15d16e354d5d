"""One page on which of two calibrations to trust: `rrru compare A B`.

A and B are folders of results, campaigns of `results`, or `folder:campaign`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import pandas as pd

from rrru.diagnosis.number_text import readable, rounded
from rrru.diagnosis.verdict_text import causes_in_words, sure_in_words
from rrru.errors import ConfigError
from rrru.report import cells, compare, page
from rrru.report.compare import Difference, GapDifference, Side, gap_difference
from rrru.report.compare_unseen import Unseen, same_points, unseen
from rrru.store.atomic_write import write_text

_RESULTS = "results"
# folder and campaign
_Place: TypeAlias = tuple[str, str]
# less likely by chance than this counts as a difference
_LEVEL = 0.01


@dataclass(frozen=True)
class Chapter:
    """Part of the page on one pair of campaigns: key, title, sentences, which points were used, tables."""

    key: str
    title: str
    sentences: list[str]
    points: str
    grids: list[cells.Grid]


def pairs(first: str, second: str) -> list[tuple[_Place, _Place]]:
    """Pairs ((folder, campaign), (folder, campaign)) of two arguments; raises ConfigError where they give none."""
    places = [_place(text) for text in (first, second)]
    if places[0] == places[1]:
        raise ConfigError(f"compare: A and B are both {first}; give two folders, or two campaigns of {_RESULTS}")
    (one, campaign), (other, other_campaign) = places
    if chosen := campaign or other_campaign:
        return [((one, campaign or chosen), (other, other_campaign or chosen))]
    common = [name for name in compare.calibrated(one) if name in compare.calibrated(other)]
    if not common:
        lists = " and ".join(
            f"{folder} has {', '.join(compare.calibrated(folder)) or 'none'}" for folder in (one, other)
        )
        raise ConfigError(f"compare: no calibrated campaign that both folders have: {lists}")
    return [((one, name), (other, name)) for name in common]


def write(first: str, second: str, path: str | Path) -> None:
    """Write the page of two arguments as a whole or not at all."""
    chapters = [_chapter(*pair) for pair in pairs(first, second)]
    write_text(page.render("compare.html", chapters=chapters, first=first, second=second), path)


def _place(text: str) -> tuple[str, str | None]:
    """Folder and campaign of an argument, None for all campaigns of a folder."""
    folder, colon, campaign = text.rpartition(":")
    if colon:
        return folder, campaign
    if Path(text).is_dir():
        return text.rstrip("/"), None
    known = compare.calibrated(_RESULTS)
    if text not in known:
        listed = ", ".join(known) or "none"
        raise ConfigError(f"compare: {text!r} is no folder, and no calibrated campaign of {_RESULTS}; it has {listed}")
    return _RESULTS, text


def _chapter(first: _Place, second: _Place) -> Chapter:
    """The Chapter on two campaigns."""
    names = [campaign for _, campaign in (first, second)]
    if names[0] == names[1]:
        names = [f"{campaign} in {folder}" for folder, campaign in (first, second)]
    one, other = (compare.read(*place, name) for place, name in zip((first, second), names, strict=True))
    compare.check(one, other)
    calibration = compare.widest(one, other)
    found, gap = compare.difference(one, other, calibration), gap_difference(one, other)
    judged, shared = unseen(one, other, calibration), same_points(one, other)
    sentences = [_numbers(found, shared), *_gap(one, other, gap), *_better((one, other), judged)]
    key = "-".join(dict.fromkeys(campaign for _, campaign in (first, second)))
    shown = [("Fitted parameters", found.rows), ("Budget of the gap, with 95 % intervals", gap.rows)]
    if judged:
        rows = pd.concat([place.rows for place in judged], ignore_index=True)
        shown.append(("Errors at points that neither has seen", rows))
    grids = [
        cells.grid(frame, f"{key}-{number}", title, heads=_heads(frame, names))
        for number, (title, frame) in enumerate(shown, start=1)
    ]
    return Chapter(key, f"{names[0]} compared with {names[1]}", sentences, _points(judged, calibration, shared), grids)


def _numbers(found: Difference, shared: int) -> str:
    """Whether the fitted parameters differ."""
    known = found.rows.dropna()
    if known.empty:
        return "The fitted parameters cannot be compared: none has a 95 % interval on both sides."
    width = known["difference_high"] - known["difference_low"]
    largest = known.loc[(known["difference"].abs() / width).idxmax()]
    square = f"chi-square {cells.short(found.chi_square)} with {found.freedom} degrees of freedom"
    measure = f"{square}, by chance with probability {_chance(found.chance)}"
    ends = [cells.short(largest[f"difference_{end}"]) for end in ("low", "high")]
    size = f"{cells.short(largest['difference'])} {largest['unit']} (95 %: {ends[0]} to {ends[1]})"
    most = f"most {largest['parameter']}, by {size}"
    said = "differ by more than their errors" if found.chance < _LEVEL else "do not differ beyond their errors"
    common = f" Both share {shared} measured points, so that the true chi-square is no smaller." if shared else ""
    return f"The fitted parameters {said} ({measure}; {most}).{common}"


def _gap(one: Side, other: Side, gap: GapDifference) -> Iterator[str]:
    """Residual error of each side, and whether it differs."""
    for side in (one, other):
        facts = side.verdict
        names = [words for words, _ in causes_in_words(facts)] + ["unexplained"] * facts["unexplained"]
        gap_mm = rounded(facts["gap_rms_mm"])
        if why := facts.get("no_answer"):
            yield f"{side.name} has a residual error of {gap_mm} mm after calibration, and no cause is named: {why}."
            continue
        causes = " + ".join(names) or "nothing to add"
        sure = sure_in_words(facts)
        yield f"{side.name} has a residual error of {gap_mm} mm after calibration: {causes} ({sure})."
    differs = list(gap.rows.loc[gap.rows["differs"], "part"])
    said = "differ" if gap.chance < _LEVEL else "do not differ beyond chance"
    parts = f" Parts that differ: {', '.join(map(readable, differs))}." if differs else ""
    yield f"As a whole the two {said} (by chance with probability {_chance(gap.chance)}).{parts}"


def _better(sides: tuple[Side, Side], judged: Sequence[Unseen]) -> Iterator[str]:
    """Which side predicts better, campaign by campaign, and which one to trust."""
    winners: list[Side | None] = []
    for place in judged:
        sizes = f"{rounded(place.rms_mm[0])} mm against {rounded(place.rms_mm[1])} mm"
        where = f"On {place.points} points of {place.campaign} that neither has seen"
        better = sides[0] if place.gain_mm2 > 0.0 else sides[1]
        clear = place.chance < _LEVEL
        winners.append(better if clear else None)
        said = f"{better.name} is better" if clear else "they do not differ beyond chance"
        yield f"{where} {said}: {sizes} (by chance with probability {_chance(place.chance)})."
    yield f"Which to trust: {_trusted(sides, winners)}"


def _trusted(sides: tuple[Side, Side], winners: Sequence[Side | None]) -> str:
    """The advice that follows from who is better on whose points."""
    distinct = {side.name for side in winners if side}
    if not winners:
        return "cannot be said, there are no points that neither has seen."
    if not distinct:
        return "either; these points do not separate them."
    if len(distinct) == 1:
        return f"{distinct.pop()}."
    if winners == list(sides):
        return "each on its own measurements: the robot or its frame has changed in between, or these are two robots."
    return "neither: each is worse on its own measurements than the other."


def _points(judged: Sequence[Unseen], calibration: str, shared: int) -> str:
    """Which points the comparison was made on."""
    listed = " and ".join(f"{place.points} of {place.campaign}" for place in judged) or "none"
    same = " Points that both have measured are left out of both fits." if shared else ""
    return (
        f"The points: {listed}, of the set {calibration!r}. Each is predicted by the other campaign's calibration, "
        "which has not used it, and by its own campaign's, fitted again without its trajectory, run or stretch."
        f"{same} Chance is counted over the runs. Intervals hold if the model lacks nothing: where effects are "
        "named, fitted parameters may differ for these."
    )


def _heads(frame: pd.DataFrame, names: Sequence[str]) -> dict[str, str]:
    """Words of the columns of both sides: their names for a and b."""
    name_of = {"a": names[0], "b": names[1]}
    sides = [name for name in frame if name.partition("_")[0] in name_of]
    return {name: f"{name_of[name[0]]} {cells.words(name[2:])}".strip() for name in sides}


def _chance(value: float) -> str:
    """A probability by chance."""
    return "less than 0.001" if value < 0.001 else f"{value:.3f}" if value < 0.1 else f"{value:.2f}"
