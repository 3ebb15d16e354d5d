"""Commanded positions computed from drive values, for files that hold these alone. Lengths in mm."""

import numpy as np

from rrru.campaign.ingest.sheet import COMMAND, position_text
from rrru.campaign.measurements import vector_columns

# with more rows without a pose something is wrong with all of them
_MOST_LOST = 0.1
# the same end effector's position within rounding
_SAME_MM = 1e-6


def with_sent(frame, mechanism, problems):
    """The frame with the nominal robot's positions at its drive values as commanded ones, and notes on them.

    frame: columns of the file under our names, in mm and rad. A few rows at whose values the nominal robot has no pose
    are left out; more are noted in problems. Raises IngestError where a row does not name the end effector that was
    measured, for a robot with several.
    """
    drives = [*mechanism.parts.columns]
    check_end_effectors(frame, mechanism, problems)
    problems.refuse()
    values = frame[drives].to_numpy(dtype=float)
    position = mechanism.forward(values, guess_mm=mechanism.guess(values, frame.get("target")))
    notes = [f"no commanded positions: computed from {drives[0]} to {drives[-1]} ({mechanism.name}, nominal)"]
    frame = frame.assign(**vector_columns("command", position))
    # blank drive values are a problem of their own
    lost = np.isnan(position).any(axis=1) & np.isfinite(values).all(axis=1)
    if lost.mean() > _MOST_LOST:
        for i in np.flatnonzero(lost):
            value = ", ".join(f"{one:.6g}" for one in values[i])
            allowed = "values at which the nominal robot closes near its home pose, or commanded positions besides them"
            problems.add("no pose", row=frame.index[i], column=", ".join(drives), value=value, allowed=allowed)
    elif lost.any():
        listed = ", ".join(f"row {row}" for row in frame.index[lost][:10]) + (", ..." if lost.sum() > 10 else "")
        why = "the nominal robot has no pose near its home pose at their drive values"
        notes.append(f"left out, since {why}: {lost.sum()} of {len(frame)} rows, {listed}")
        frame = frame[~lost]
    return frame, notes


def check_end_effectors(frame, mechanism, problems):
    """Refuse rows that do not name a target on one of the end effectors, for a robot with several.

    A pose belongs to the end effector nearest to the commanded position, so that this has to be the named one's.
    """
    carried = [target for targets in mechanism.legs.hands for target in targets]
    if not carried:
        return
    if "target" not in frame:
        problems.add("missing column", column="target", value="no such column", allowed=", ".join(carried))
    if "target" in frame:
        for i in np.flatnonzero(~frame["target"].isin(carried)):
            value, allowed = frame["target"].iloc[i], f"a target on an end effector: {', '.join(carried)}"
            problems.add("reflectors", row=frame.index[i], column="target", value=value, allowed=allowed)
    drives = [*mechanism.parts.columns]
    if not set(drives) <= set(frame):
        allowed = "a column for each drive: commanded positions do not determine those of several end effectors"
        problems.add("missing column", column=", ".join(drives), value="no such columns", allowed=allowed)
    problems.refuse()
    if set(COMMAND) <= set(frame):
        values, command = frame[drives].to_numpy(dtype=float), frame[[*COMMAND]].to_numpy(dtype=float)
        stated, nearest = mechanism.guess(values, frame["target"]), mechanism.forward(values, guess_mm=command)
        for i in np.flatnonzero(np.linalg.norm(stated - nearest, axis=1) > _SAME_MM):
            target = frame["target"].iloc[i]
            value = f"{position_text(command[i])}, nearest to another end effector than that of {target}"
            allowed = f"its tool's position, {position_text(stated[i])}; or no commanded columns, these are computed"
            problems.add("end effector", row=frame.index[i], column=", ".join(COMMAND), value=value, allowed=allowed)
    problems.refuse()
