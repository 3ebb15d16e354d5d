"""Commanded positions computed from drive values, for files that hold these alone. Lengths in mm."""

import numpy as np


def sent_to(frame, mechanism, problems):
    """Positions (n, 3) of the nominal robot at a file's drive values, NaN where one is noted.

    frame: columns of the file under our names, in mm and rad. Raises IngestError where a row does not name the end
    effector that was measured, for a robot with several.
    """
    drives = [*mechanism.parts.columns]
    _check_end_effectors(frame, mechanism, problems)
    values = frame[drives].to_numpy(dtype=float)
    position = mechanism.forward(values, guess_mm=mechanism.guess(values, frame.get("target")))
    # blank drive values are a problem of their own
    for i in np.flatnonzero(np.isnan(position).any(axis=1) & np.isfinite(values).all(axis=1)):
        value = ", ".join(f"{one:.6g}" for one in frame[drives].iloc[i])
        allowed = "values at which the nominal robot closes near its home pose, or commanded positions besides them"
        problems.add("no pose", row=frame.index[i], column=", ".join(drives), value=value, allowed=allowed)
    return position


def _check_end_effectors(frame, mechanism, problems):
    """Refuse rows that do not name a target on one of the end effectors, for a robot with several."""
    carried = [target for targets in mechanism.legs.hands for target in targets]
    if carried and "target" not in frame:
        problems.add("missing column", column="target", value="no such column", allowed=", ".join(carried))
    if carried and "target" in frame:
        for i in np.flatnonzero(~frame["target"].isin(carried)):
            value, allowed = frame["target"].iloc[i], f"a target on an end effector: {', '.join(carried)}"
            problems.add("reflectors", row=frame.index[i], column="target", value=value, allowed=allowed)
    problems.refuse()
