"""Points that a diagnosis leaves out are counted under the reason that they were given."""

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.diagnosis.result_tables import left_out, left_out_note
from tests.diagnosis.campaigns import measure, problem_of
from tests.schemas import check


def test_every_point_that_is_not_used_counts_once_under_its_reason():
    frame = measure()
    frame.loc[[3, 4], "status"] = "outlier"
    frame.loc[7, "status"] = "stale"
    frame.loc[9, "status"] = "unsolved"
    # also not measured: the first reason counts
    frame.loc[[9, 50, 51, 52], "measured_y_mm"] = np.nan
    frame = rows.hold_out(frame, np.arange(len(frame)) % 40 == 20)
    frame.loc[60:64, "status"] = "near_singularity"
    problem = problem_of(frame)
    dropped = np.zeros(len(problem), dtype=bool)
    dropped[[0, 5]] = True
    problem = problem.without(dropped)
    held = int((frame["status"] == rows.HELD_OUT).sum())
    expected = {"not measured": 4, "stale reading": 1, "outlier in the file": 2}
    expected |= {"held out for a test": held, "outlier to the diagnosis": 2}
    found = check("gap_left_out", left_out(problem, True).assign(campaign="made up"))
    assert found.set_index("reason")["points"].to_dict() == expected
    assert found["points"].sum() == len(frame) - problem.count
    said = left_out_note(left_out(problem, True), problem.count, len(frame))
    assert said.startswith(f"{problem.count} of {len(frame)} points used; left out: 4 not measured, 1 stale reading, ")


def test_points_near_singularities_are_left_out_where_that_was_asked_for():
    frame = measure()
    frame.loc[60:64, "status"] = "near_singularity"
    problem = problem_of(frame)
    some = problem.without(np.isin(problem.at, np.arange(60, 65)))
    assert left_out(some, False).to_dict("records") == [{"reason": "near a singularity", "points": 5}]
    assert left_out(problem, True).empty and isinstance(left_out(problem, True), pd.DataFrame)
