"""A file without names of trajectories is one trajectory, unless a column may hold them under another name."""

import pandas as pd
import pytest

from rrru.campaign.ingest.campaign_file import ingest
from rrru.campaign.ingest.spec import IngestSpec
from rrru.errors import IngestError
from rrru.robots.rrru3 import Rrru3
from tests.places import DATA

FRAME = pd.read_csv(DATA / "field_12.csv").drop(columns="trajectory")


def _read(frame, folder):
    frame.to_csv(folder / "mine.csv", index=False)
    return ingest(IngestSpec(str(folder / "mine.csv")), Rrru3())


def test_without_names_all_points_are_one_trajectory(tmp_path):
    found = _read(FRAME, tmp_path)
    assert set(found.measurements["trajectory"]) == {"all"} and len(found.measurements) == len(FRAME)
    assert "no column trajectory: all points count as one, all" in found.notes


@pytest.mark.parametrize("heading", ["path", "Trajectoryy", "trajektory", "Group"])
def test_names_under_another_heading_are_not_overlooked(heading, tmp_path):
    with pytest.raises(IngestError, match=f"column {heading}: got an undeclared column|column trajectory: got no such"):
        _read(FRAME.assign(**{heading: "line_1"}), tmp_path)
