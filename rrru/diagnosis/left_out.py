"""How many points of a campaign the diagnosis leaves out, and why."""

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows

# reasons in the order in which they count: a point has the first that fits
REASONS = (
    "not measured",
    "stale reading",
    "outlier in the file",
    "held out for a test",
    "not solved",
    "out of reach",
    "near a singularity",
    "outlier to the diagnosis",
)
_STATUS = {
    "stale": "stale reading",
    "outlier": "outlier in the file",
    rows.HELD_OUT: "held out for a test",
    "unsolved": "not solved",
}


def left_out(case, use_near_singularity):
    """Rows of `gap_left_out` without the campaign: the points that a Case does not use, counted by reason."""
    reasons = _reasons(case, use_near_singularity)
    counts = pd.Series(reasons[~case.used], dtype=object).value_counts()
    found = [reason for reason in REASONS if reason in counts]
    return pd.DataFrame({"reason": found, "points": [int(counts[reason]) for reason in found]})


def left_out_note(table, used, whole):
    """A sentence on a table of `left_out`."""
    counts = ", ".join(f"{points} {reason}" for reason, points in table.itertuples(index=False))
    return f"{used} of {whole} points used; left out: {counts}"


def _reasons(case, use_near_singularity):
    """Why each point (N,) of a Case may be left out."""
    frame, (actuators, command) = case.measurements, case.driven
    status = frame["status"].to_numpy(dtype=object)
    reached = np.isfinite(case.motion.position_mm).all(axis=1)
    reached &= np.isfinite(case.mechanism.forward(actuators, guess_mm=command)).all(axis=1)
    near = (status == "near_singularity") & (not use_near_singularity)
    cases = [
        ("not measured", ~np.isfinite(rows.measured(frame)).all(axis=1)),
        *((reason, status == name) for name, reason in _STATUS.items()),
        ("out of reach", ~reached),
        ("near a singularity", near),
    ]
    conditions = [rows_of for _, rows_of in cases]
    return np.select(conditions, [reason for reason, _ in cases], default=REASONS[-1]).astype(object)
