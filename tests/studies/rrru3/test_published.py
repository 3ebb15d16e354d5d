"""Papers B's and C's rows of `published`: the numbers typed in a second time, and this study's put in by hand."""

import numpy as np
import pandas as pd
import pytest

from rrru.errors import ConfigError
from rrru.studies.delta import paper_c
from rrru.studies.ptt3 import paper_b
from rrru.studies.rrru3.published_sisters import here_b, here_c, sister_rows
from tests.schemas import check


def test_every_row_fits_the_table_and_is_null_without_a_study():
    frame = check("published", pd.DataFrame(sister_rows()))
    assert len(frame) == len(paper_b.NUMBERS) + len(paper_c.NUMBERS) == 39 + 19
    assert frame["here"].isna().all() and set(frame["paper"]) == {"B", "C"}


def test_the_numbers_are_the_printed_ones():
    b, c = ({number.item: number.value for number in room.NUMBERS} for room in (paper_b, paper_c))
    assert [b[f"spread_{k}"] for k in range(1, 6)] == [3.8, 3.4, 3.4, 3.6, 3.5]
    assert (b["points"], b["training_points"], b["test_points"], b["training_steps"]) == (180, 160, 20, 20)
    assert (b["repeats"], b["screw_turns"], b["encoder_range_mm"], b["encoder_accuracy_um"]) == (7, 10, 300, 1)
    assert {b[f"benefit_{k}_{axis}"] for k in range(1, 6) for axis in "xy"} == {90.0}
    assert {b[f"benefit_{k}_z"] for k in range(1, 6)} == {80.0}
    assert (c["before_max"], c["before_mean"], c["after_max"], c["after_mean"]) == (1.442, 0.932, 0.374, 0.211)
    assert (c["poses"], c["least_poses"], c["calibration_height_mm"], c["checked_height_mm"]) == (20, 4, 100, 0)
    assert (c["target_dots_across"], c["target_dots_along"], c["dot_diameter_mm"], c["dot_pitch_mm"]) == (40, 55, 5, 10)
    assert np.degrees([c[f"beta{k}_rad"] for k in (1, 2, 3)]) == pytest.approx([-30.0, 90.0, 210.0])


def test_this_studys_numbers_stand_beside_their_items():
    benefits = pd.DataFrame({"experiment": [1, 1, 5], "axis": ["x", "z", "y"], "benefit_percent": [95.0, 84.0, 45.0]})
    networks = pd.DataFrame({"experiment": [1, 2, 3], "spread": [3.5, 3.4, 3.0], "steps": [10, 25, 22]})
    here = {
        "B": here_b({"repeats": 7.0}, benefits, networks),
        "C": here_c({"poses": 20.0}, [1.0, 2.0, 0.6], [0.1, 0.2, 0.6]),
    }
    frame = check("published", pd.DataFrame(sister_rows(here))).set_index(["paper", "item"])
    known = frame["here"].dropna()
    assert known["B"].to_dict() == {
        "repeats": 7.0,
        "benefit_1_x": 95.0,
        "benefit_1_z": 84.0,
        "benefit_5_y": 45.0,
        "spread_1": 3.5,
        "spread_2": 3.4,
        "spread_3": 3.0,
        "training_steps": 22.0,
    }
    c = known["C"]
    assert (c["before_max"], c["after_max"], c["poses"]) == (2.0, 0.6, 20.0)
    assert c["before_mean"] == c["before_about"] == pytest.approx(1.2) and c["after_mean"] == c[
        "after_about"
    ] == pytest.approx(0.3)
    assert frame.loc[("B", "benefit_5_y"), "ratio"] == 0.5
    np.testing.assert_allclose([frame.loc[("C", f"beta{k}_rad"), "ratio"] for k in (1, 2, 3)], 1.0)
    assert np.isnan(frame.loc[("B", "target_mse"), "ratio"])


def test_an_item_that_the_paper_does_not_print_is_refused():
    with pytest.raises(ConfigError, match=r"paper C prints no after_rms; known: legs, beta1_rad"):
        sister_rows({"C": {"after_rms": 0.2}})
