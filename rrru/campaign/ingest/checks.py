"""Checks of a measured campaign's rows as runs: numbering, order, time, copies, number of points."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from rrru.campaign.driven_path import follows_path
from rrru.campaign.ingest.sheet import COMMAND, MEASURED, Sheet

_LEAST_POINTS = 3
# stale readings that are left out make at most this share of a file; more are no mishap of an instrument
_MOST_STALE = 0.1
# what a point is known by
_POINT = {"run", "trajectory", "point"}
# A file that prints coarser than this gives the same position twice by chance.
_COARSE_MM = 0.005


def number_runs(frame: pd.DataFrame, at_rest: bool = False) -> tuple[pd.DataFrame, list[str]]:
    """The frame with `run` and `point`, and what was done to get them; at_rest: the robot rests at each reading.

    Without a `run` a new one begins where the trajectory's name changes and where the point's number falls or, without
    a `point`, where the commanded path turns back on itself or starts again. Without a `point` they are counted within
    the run. Stops follow no path that could turn back.
    """
    frame, notes = frame.copy(), []
    several = "target" in frame and "point" in frame and frame.duplicated([*_POINT.intersection(frame)]).any()
    if several:
        frame = frame.drop(columns="point")
        notes.append("points numbered anew, a row each: several reflectors are read at one")
    numbered = "point" in frame
    if "run" not in frame:
        change = (frame["trajectory"] != frame["trajectory"].shift()).to_numpy()
        again = (
            (frame["point"].diff() < 0).to_numpy() if numbered else _turns_back(frame[[*COMMAND]].to_numpy(), change)
        )
        where = "the point's number falls" if numbered else "the commanded path turns back or starts again"
        where = f"the trajectory's name changes or {where}"
        if not numbered and at_rest:
            again, where = False, "the trajectory's name changes, as each point is a stop"
        elif not numbered and not follows_path(frame[[*COMMAND]].to_numpy(), frame["trajectory"].to_numpy()):
            again, where = False, "the trajectory's name changes, as the points follow no path"
        frame["run"] = (change | again).cumsum().astype(float)
        count = int(frame["run"].max())
        notes.append(f"no column run: a new run wherever {where}, {count} run{'s' * (count > 1)}")
    if not numbered:
        frame["point"] = frame.groupby("run").cumcount().astype(float) + 1.0
        if not several:
            notes.append("no column point: counted within the run")
    return frame, notes


def path_length(command: np.ndarray) -> np.ndarray:
    """Length in mm along commanded positions (n, 3), growing by at least a little where the robot stands still."""
    step = np.nan_to_num(np.linalg.norm(np.diff(command, axis=0), axis=1))
    least = 0.2 * np.median(step[step > 0.0]) if (step > 0.0).any() else 1.0
    return np.concatenate([[0.0], np.cumsum(np.maximum(step, least))])


def _turns_back(command: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Rows (n,) where positions (n, 3) turn back or start again within what `change` (n,) sets apart."""
    result = np.zeros(len(command), dtype=bool)
    last, begun = None, 0
    for i in range(1, len(command)):
        step = command[i] - command[i - 1]
        length = np.linalg.norm(step)
        if change[i]:
            last, begun = None, i
        elif i + 1 < len(command) and i > begun + 1 and np.array_equal(command[i : i + 2], command[begun : begun + 2]):
            result[i], last, begun = True, None, i
        elif length > 0.0:
            if last is not None and step @ last < -0.9 * length * np.linalg.norm(last):
                # a point commanded twice at the turn belongs to the way back
                begun = i - 1 if i > begun + 1 and np.array_equal(command[i - 1], command[i - 2]) else i
                result[begun] = True
            jump = last is not None and length > 2.0 * np.linalg.norm(last)
            last = None if jump else step
    return result


def resolution(position: np.ndarray) -> float:
    """Last digit of positions (n, 3) as the file has them: 0.001 for three decimals."""
    known = position[np.isfinite(position)]
    digits = (10.0**-d for d in range(7) if np.allclose(known, np.round(known, d), rtol=0.0, atol=1e-3 * 10.0**-d))
    return next(digits, 1e-7)


def check_runs(sheet: Sheet, repeated: pd.Series) -> None:
    """Note rows that do not make sense as runs; repeated: the `stale` readings."""
    _check_repeats(sheet)
    _check_order(sheet)
    _check_copies(sheet, repeated)
    _check_counts(sheet)
    if "time_s" in sheet.frame:
        _check_time(sheet)


def _first_alike(frame: pd.DataFrame, columns: Sequence[str]) -> pd.Series:
    """The first row (n,) with the same values as each row in some columns."""
    return frame.index.to_series().groupby([frame[name] for name in columns]).transform("first")


def _falls(frame: pd.DataFrame, where: pd.Series) -> Iterator[tuple[int, pd.Series, pd.Series]]:
    """The flagged rows (n,) of a frame: their number, the row itself and the one before."""
    for i in np.flatnonzero(where):
        yield frame.index[i], frame.iloc[i], frame.iloc[i - 1]


def _check_repeats(sheet: Sheet) -> None:
    """Note points that stand twice, by number and run."""
    known = sheet.frame.dropna(subset=["run", "point"])
    first = _first_alike(known, ("run", "point"))
    for row, run, point in known.loc[first != known.index, ["run", "point"]].itertuples():
        value = f"run {run:g}, point {point:g}, as in row {first[row]}"
        sheet.note("repeated point", ("run", "point"), value, "each point of a run once", row)


def _check_order(sheet: Sheet) -> None:
    """Note runs and points that go back, and runs over two trajectories: the rows stand in the order driven."""
    known = sheet.frame.dropna(subset=["run", "point"])
    for row, now, before in _falls(known, known["run"].diff() < 0):
        allowed = "runs numbered and listed in the order driven"
        sheet.note("order of runs", "run", f"run {now['run']:g} after run {before['run']:g}", allowed, row)
    for row, now, before in _falls(known, (known["point"].diff() < 0) & (known["run"].diff() == 0)):
        allowed = "points numbered and listed in the order driven; without the column they are counted"
        sheet.note("order of points", "point", f"point {now['point']:g} after point {before['point']:g}", allowed, row)
    for number, name in known[known["trajectory"] != ""].groupby("run")["trajectory"]:
        other = name[name != name.iloc[0]]
        if len(other):
            value = f"{other.iloc[0]} in run {number:g}, which began with {name.iloc[0]}"
            sheet.note("two trajectories", "trajectory", value, "one trajectory per run", other.index[0])


def stale(sheet: Sheet, digit_mm: float) -> pd.Series:
    """Rows that repeat an earlier reading in every digit: a series of the earlier row's number by theirs.

    At the same command only where the file's resolution excludes equality by chance; digit_mm: last digit of its
    positions.
    """
    known = sheet.frame.dropna(subset=[*COMMAND, *MEASURED])
    first, command = _first_alike(known, MEASURED), known[[*COMMAND]]
    elsewhere = (command.to_numpy() != command.loc[first].to_numpy()).any(axis=1)
    return first[(first != known.index) & (elsewhere | (digit_mm < _COARSE_MM))]


def _check_copies(sheet: Sheet, first: pd.Series) -> None:
    """Note `stale` rows, with the first of each, where there are many; a few are left out."""
    if len(first) <= _MOST_STALE * len(sheet.frame):
        return
    for row, *measured in sheet.frame.loc[first.index, [*MEASURED]].itertuples():
        value = f"({', '.join(f'{one:.10g}' for one in measured)}) mm, exactly as in row {first[row]}"
        sheet.note(
            "copied row", MEASURED, value, "each measurement once: an instrument does not repeat every digit", row
        )


def _check_counts(sheet: Sheet) -> None:
    """Note a campaign or a run with too few rows."""
    parameters = len(sheet.mechanism.parameters)
    needed = max(-(-parameters // 3), _LEAST_POINTS)
    if len(sheet.frame) < needed:
        allowed = f"at least {needed}: three numbers per point for {parameters} parameters"
        sheet.note("too few points", None, f"{len(sheet.frame)} rows", allowed)
    # a run that the file does not number may be short
    for number, size in sheet.frame.groupby("run").size().items() if "run" in sheet.found else ():
        if size < _LEAST_POINTS:
            allowed = f"at least {_LEAST_POINTS} points in a run"
            sheet.note("too few points", "run", f"run {number:g} with {size} points", allowed)


def _check_time(sheet: Sheet) -> None:
    """Note times that run backwards, within a run or from run to run."""
    known = sheet.frame.dropna(subset=["time_s", "run"])
    for row, now, before in _falls(known, known["time_s"].diff() < 0):
        other = f" (run {now['run']:g} after run {before['run']:g})" if now["run"] != before["run"] else ""
        value = f"{now['time_s']:.10g} s after {before['time_s']:.10g} s{other}"
        allowed = "times since the campaign's start that never run backwards, within a run and from run to run"
        sheet.note("time", "time_s", value, allowed, row)


def check_speed(sheet: Sheet) -> None:
    """Note runs whose points follow each other faster than their speed allows, in a file whose unit is right."""
    if not {"time_s", "speed_mm_s"} <= set(sheet.frame):
        return
    known = sheet.frame.dropna(subset=["time_s", "run", "speed_mm_s", *COMMAND])
    for number, run in known.groupby("run"):
        step, pause = np.linalg.norm(np.diff(run[[*COMMAND]], axis=0), axis=1), np.diff(run["time_s"])
        if not (pause > 0).any():
            continue
        driven, stated = np.median(step[pause > 0] / pause[pause > 0]), run["speed_mm_s"].max()
        if driven > 3.0 * stated:
            value = f"{stated:g} mm/s in run {number:g}, whose points follow each other at {driven:.4g} mm/s"
            allowed = "the speed in mm/s, and times in s, that fit the commanded positions"
            sheet.note("speed", "speed_mm_s", value, allowed, run.index[0])
