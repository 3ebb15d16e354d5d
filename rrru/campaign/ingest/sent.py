"""Where the robot was sent, of files that hold its drive values alone. Lengths in mm."""

import numpy as np


def sent_to(frame, mechanism, problems):
    """Positions (n, 3) of the nominal robot at a file's drive values, NaN where one is noted.

    frame: columns of the file under our names, in mm and rad. Raises IngestError where a row does not say which of
    several hands it is of.
    """
    drives = [*mechanism.parts.columns]
    _check_hands(frame, mechanism, problems)
    values = frame[drives].to_numpy(dtype=float)
    position = mechanism.forward(values, guess_mm=mechanism.guess(values, frame.get("target")))
    for i in np.flatnonzero(np.isnan(position).any(axis=1)):
        value = ", ".join(f"{one:.6g}" for one in frame[drives].iloc[i])
        allowed = "values at which the nominal robot closes near its home pose, or commanded positions beside them"
        problems.add("no pose", row=frame.index[i], column=", ".join(drives), value=value, allowed=allowed)
    return position


def _check_hands(frame, mechanism, problems):
    """Refuse rows that do not say which of several hands they are of."""
    carried = [target for hand in mechanism.legs.hands for target in hand]
    if carried and "target" not in frame:
        problems.add("missing column", column="target", value="no such column", allowed=", ".join(carried))
    if carried and "target" in frame:
        for i in np.flatnonzero(~frame["target"].isin(carried)):
            value, allowed = frame["target"].iloc[i], f"what a hand carries: {', '.join(carried)}"
            problems.add("reflectors", row=frame.index[i], column="target", value=value, allowed=allowed)
    problems.refuse()
