"""The row of a series whose file cannot be used: the others of its set are studied all the same."""

import pandas as pd

from rrru.errors import RrruError
from rrru.studies.real.series import Series

REFUSED = "refused"


def refused(series: Series, error: RrruError) -> dict[str, pd.DataFrame]:
    """Frames by name, without the campaign: the row of `real_verdicts`, whose notes say why; numbers are left out."""
    row = dict.fromkeys(("where", "confusable_with", "next_runs"), "") | {"points": 0, "dropped_points": 0}
    own = {"effects": REFUSED, "notes": f"left out: {error}", **named(series)}
    return {"real_verdicts": pd.DataFrame([row | own])}


def named(series: Series) -> dict[str, str]:
    """What every row of `real_verdicts` says of the series itself."""
    robot = series.section.get("robot", series.dataset)
    return {"dataset": series.dataset, "robot": robot, "source": series.file.name}
