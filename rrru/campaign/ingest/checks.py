"""Whether the rows of a measured campaign make sense as runs: numbering, order, time, copies, number of points."""

import numpy as np

from rrru.campaign.ingest.columns import COMMAND, MEASURED

_LEAST_POINTS = 3
# A file that prints coarser than this gives the same position twice by chance.
_COARSE_MM = 0.005


def number_runs(frame):
    """The frame with `run` and `point`, and what was done to get them.

    Without a `run` a new one begins where the trajectory's name changes and where the point's number falls or, without
    a `point`, where the commanded path turns back on itself or starts again. Without a `point` they are counted within
    the run.
    """
    notes = []
    frame = frame.copy()
    if "run" not in frame:
        change = (frame["trajectory"] != frame["trajectory"].shift()).to_numpy()
        change = change | (
            (frame["point"].diff() < 0).to_numpy() if "point" in frame else _turns(frame[[*COMMAND]].to_numpy(), change)
        )
        frame["run"] = change.cumsum().astype(float)
        where = "the point's number falls" if "point" in frame else "the commanded path turns back or starts again"
        notes.append(
            f"no column run: a new run wherever the trajectory's name changes or {where}, {int(frame['run'].max())} runs"
        )
    if "point" not in frame:
        frame["point"] = frame.groupby("run").cumcount().astype(float) + 1.0
        notes.append("no column point: counted within the run")
    return frame, notes


def path_length(command):
    """Length in mm along commanded positions (n, 3), growing by at least a little where the robot stands still."""
    step = np.nan_to_num(np.linalg.norm(np.diff(command, axis=0), axis=1))
    least = 0.2 * np.median(step[step > 0.0]) if (step > 0.0).any() else 1.0
    return np.concatenate([[0.0], np.cumsum(np.maximum(step, least))])


def _turns(command, change):
    """Rows (n,) where the path of commanded positions (n, 3) turns back or starts again within what `change` (n,) sets
    apart.
    """
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


def check_runs(frame, found, parameter_count, resolution_mm, problems):
    """Note rows that do not make sense as runs.

    frame: index row number, columns under our names, NaN where a cell has been noted already; found: {our name: the
    file's name}; parameter_count: numbers that a calibration fits; resolution_mm: last digit of the file's positions.
    """
    names = {ours: found.get(ours, ours) for ours in frame}
    _check_repeats(frame, names, problems)
    _check_order(frame, names, problems)
    _check_copies(frame, names, resolution_mm, problems)
    _check_counts(frame, names, parameter_count, problems)
    if "time_s" in frame:
        _check_time(frame, names, problems)


def resolution(position):
    """Last digit of positions (n, 3) as the file has them: 0.001 for three decimals."""
    known = position[np.isfinite(position)]
    return next(
        (10.0**-d for d in range(7) if np.allclose(known, np.round(known, d), rtol=0.0, atol=1e-3 * 10.0**-d)), 1e-7
    )


def _check_repeats(frame, names, problems):
    """Note points that stand twice, by number and run."""
    known = frame.dropna(subset=["run", "point"])
    first = {}
    for row, run, point in zip(known.index, known["run"], known["point"], strict=True):
        if (run, point) in first:
            value = f"run {run:g}, point {point:g}, as in row {first[run, point]}"
            problems.add(
                "repeated point",
                row=row,
                column=f"{names['run']}, {names['point']}",
                value=value,
                allowed="each point of a run once",
            )
        first.setdefault((run, point), row)


def _check_order(frame, names, problems):
    """Note runs and points that go back, and runs over two trajectories: the rows stand in the order driven."""
    known = frame.dropna(subset=["run", "point"])
    run, point, row = known["run"].to_numpy(), known["point"].to_numpy(), known.index.to_numpy()
    for i in np.flatnonzero(np.diff(run) < 0) + 1:
        value = f"run {run[i]:g} after run {run[i - 1]:g}"
        problems.add(
            "order of runs",
            row=row[i],
            column=names["run"],
            value=value,
            allowed="runs numbered and listed in the order driven",
        )
    for i in np.flatnonzero((np.diff(point) < 0) & (np.diff(run) == 0)) + 1:
        value = f"point {point[i]:g} after point {point[i - 1]:g}"
        allowed = "points numbered and listed in the order driven; without the column they are counted"
        problems.add("order of points", row=row[i], column=names["point"], value=value, allowed=allowed)
    for number, name in known[known["trajectory"] != ""].groupby("run")["trajectory"]:
        other = name[name != name.iloc[0]]
        if len(other):
            value = f"{other.iloc[0]} in run {number:g}, which began with {name.iloc[0]}"
            problems.add(
                "two trajectories",
                row=other.index[0],
                column=names["trajectory"],
                value=value,
                allowed="one trajectory per run",
            )


def _check_copies(frame, names, resolution_mm, problems):
    """Note rows that repeat a measured position to the last digit; at the same command only where the file is fine
    enough to tell.
    """
    known = frame.dropna(subset=[*COMMAND, *MEASURED])
    first = {}
    for row, measured, command in zip(
        known.index, known[[*MEASURED]].to_numpy(), known[[*COMMAND]].to_numpy(), strict=True
    ):
        key = tuple(measured)
        before = first.setdefault(key, (row, command))
        if before[0] != row and (resolution_mm < _COARSE_MM or not np.array_equal(before[1], command)):
            problems.add(
                "copied row",
                row=row,
                column=", ".join(names[name] for name in MEASURED),
                value=f"({', '.join(f'{value:.10g}' for value in key)}) mm, exactly as in row {before[0]}",
                allowed="each measurement once: an instrument does not repeat every digit",
            )


def _check_counts(frame, names, parameter_count, problems):
    """Note a campaign or a run with too few rows."""
    needed = -(-parameter_count // 3)
    if len(frame) < max(needed, _LEAST_POINTS):
        allowed = f"at least {max(needed, _LEAST_POINTS)}: three numbers per point for {parameter_count} parameters"
        problems.add("too few points", value=f"{len(frame)} rows", allowed=allowed)
    for number, size in frame.groupby("run").size().items():
        if size < _LEAST_POINTS:
            allowed = f"at least {_LEAST_POINTS} points in a run"
            problems.add(
                "too few points", column=names["run"], value=f"run {number:g} with {size} points", allowed=allowed
            )


def _check_time(frame, names, problems):
    """Note times that run backwards, within a run or from run to run."""
    known = frame.dropna(subset=["time_s", "run"])
    time, run, row = known["time_s"].to_numpy(), known["run"].to_numpy(), known.index.to_numpy()
    for i in np.flatnonzero(np.diff(time) < 0) + 1:
        value = f"{time[i]:.10g} s after {time[i - 1]:.10g} s" + (
            f" (run {run[i]:g} after run {run[i - 1]:g})" if run[i] != run[i - 1] else ""
        )
        allowed = "times since the campaign's start that never run backwards, within a run and from run to run"
        problems.add("time", row=row[i], column=names["time_s"], value=value, allowed=allowed)


def check_speed(frame, found, problems):
    """Note runs whose points follow each other faster than the run's speed allows; for files whose unit is known to be
    right.
    """
    if not {"time_s", "speed_mm_s"} <= set(frame):
        return
    known = frame.dropna(subset=["time_s", "run", "speed_mm_s", *COMMAND])
    for number, run in known.groupby("run"):
        step, pause = np.linalg.norm(np.diff(run[[*COMMAND]], axis=0), axis=1), np.diff(run["time_s"])
        if not (pause > 0).any():
            continue
        driven, stated = np.median(step[pause > 0] / pause[pause > 0]), run["speed_mm_s"].max()
        if driven > 3.0 * stated:
            value = f"{stated:g} mm/s in run {number:g}, whose points follow each other at {driven:.4g} mm/s"
            allowed = "the speed in mm/s, and times in s, that fit the commanded positions"
            problems.add("speed", row=run.index[0], column=found["speed_mm_s"], value=value, allowed=allowed)
