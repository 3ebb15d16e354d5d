"""The row of a series with an unusable file; the other series of its set are still studied."""

import pandas as pd

from rrru.errors import RrruError
from rrru.studies.real.series import Series

REFUSED = "refused"


def refused(series: Series, error: RrruError) -> dict[str, pd.DataFrame]:
    """Frames by name, without the campaign: the row of `real_verdicts` with the reason in its notes, no numbers."""
    row = dict.fromkeys(("where", "confounded_with", "next_runs"), "") | {"points": 0, "dropped_points": 0}
    reason = {"effects": REFUSED, "notes": f"left out: {error}", **named(series)}
    return {"real_verdicts": pd.DataFrame([row | reason])}


def named(series: Series) -> dict[str, str]:
    """Columns of `real_verdicts` on the series itself."""
    robot = series.section.get("robot", series.dataset)
    return {"dataset": series.dataset, "robot": robot, "source": series.file.name}
