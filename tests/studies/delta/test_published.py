"""Paper C's numbers typed in a second time, and this study's out of small tables made by hand."""

import numpy as np
import pandas as pd
import pytest

from rrru.studies.delta.published import NUMBERS, published_rows
from tests.schemas import check

SECTION = {
    "target": {"rows": 40, "columns": 55, "diameter_mm": 5.0, "pitch_mm": 10.0},
    "camera": {"pixel_mm": 0.0099},
    "poses": {"counts": [5, 4], "z_mm": 100.0},
    "plane": {"z_mm": 0.0},
}


def test_the_numbers_are_the_printed_ones():
    c = {number.item: number.value for number in NUMBERS}
    assert len(NUMBERS) == len(c) == 19
    assert (c["before_max"], c["before_mean"], c["after_max"], c["after_mean"]) == (1.442, 0.932, 0.374, 0.211)
    assert (c["poses"], c["least_poses"], c["calibration_height_mm"], c["checked_height_mm"]) == (20, 4, 100, 0)
    assert (c["target_dots_across"], c["target_dots_along"], c["dot_diameter_mm"], c["dot_pitch_mm"]) == (40, 55, 5, 10)
    assert np.degrees([c[f"beta{k}_rad"] for k in (1, 2, 3)]) == pytest.approx([-30.0, 90.0, 210.0])


def test_numbers_and_their_ranges_are_those_of_before_and_the_papers_variant():
    sizes = [1.0, 2.0, 3.0, 0.1, 0.2, 0.6, 9.0, 9.0, 9.0]
    points = pd.DataFrame({"variant": np.repeat(["none", "paper", "shape"], 3), "error_mm": sizes})
    camera = pd.DataFrame({"parameter": ["focal_x_px", "focal_y_px"], "found": [1600.0, 1700.0]})
    columns = [f"plane_{kind}_{side}_mm" for kind in ("mean", "max") for side in ("median", "low", "high")]
    draws = pd.DataFrame(np.arange(18.0).reshape(3, 6), columns=columns).assign(variant=["none", "paper", "shape"])
    frame = check("published", published_rows(SECTION, points, camera, draws)).set_index("item")
    here, drawn = frame["here"], frame[["here_median", "here_low", "here_high"]]
    assert (here["before_mean"], here["before_max"], here["after_max"]) == (2.0, 3.0, 0.6)
    assert here["before_about"] == 2.0 and here["after_mean"] == here["after_about"] == pytest.approx(0.3)
    assert here["focal_length_mm"] == pytest.approx(1600.0 * 0.0099) and here["poses"] == 20.0
    np.testing.assert_allclose(frame.loc[[f"beta{k}_rad" for k in (1, 2, 3)], "ratio"], 1.0)
    assert drawn.loc["before_mean"].tolist() == [0.0, 1.0, 2.0] and drawn.loc["after_max"].tolist() == [9.0, 10.0, 11.0]
    assert drawn.loc["after_mean"].tolist() == drawn.loc["after_about"].tolist() == [6.0, 7.0, 8.0]
    assert drawn.loc["poses"].isna().all()
    # compared with what is printed, a number that is zero has no ratio
    assert np.isnan(frame.loc["checked_height_mm", "ratio"]) and frame.loc["after_max", "ratio"] == 0.6 / 0.374
