"""Paper B's numbers typed in a second time, and this study's out of small tables made by hand."""

import numpy as np
import pandas as pd
import pytest

from rrru.studies.ptt3.published import NUMBERS, published_rows
from tests.schemas import check

SECTION = {
    "experiments": {f"ptt_{k}": {"payload_kg": 2.0 * max(k - 2, 0)} for k in range(1, 6)},
    "curve": {"radius_mm": 50.0, "z_mm": [-300.0, -240.0], "points": 12},
    "network": {"train": 10},
    "positions_mm": [[0.0, 0.0, -250.0]] * 3,
    "repeats": 7,
    "bench": {"turns": 10, "range_mm": 300.0, "resolution_mm": 0.001},
}


def test_the_numbers_are_the_printed_ones():
    b = {number.item: number.value for number in NUMBERS}
    assert len(NUMBERS) == len(b) == 39
    assert [b[f"spread_{k}"] for k in range(1, 6)] == [3.8, 3.4, 3.4, 3.6, 3.5]
    assert (b["points"], b["training_points"], b["test_points"], b["training_steps"]) == (180, 160, 20, 20)
    assert (b["repeats"], b["screw_turns"], b["encoder_range_mm"], b["encoder_accuracy_um"]) == (7, 10, 300, 1)
    assert {b[f"benefit_{k}_{axis}"] for k in range(1, 6) for axis in "xy"} == {90.0}
    assert {b[f"benefit_{k}_z"] for k in range(1, 6)} == {80.0}


def _benefit():
    """Table `ptt_benefit`: the Jacobian's route on test points has 90 and the experiment's number."""
    ways = (("rbf_jacobian", "test", 90.0), ("rbf_jacobian", "train", 0.0), ("parameters", "test", 50.0))
    return pd.DataFrame(
        [
            {"experiment": f"ptt_{k}", "method": method, "set": which, "axis": axis, "benefit_percent": value + k}
            for k in range(1, 6)
            for axis in ("x", "y", "z", "z_absolute")
            for method, which, value in ways
        ]
    )


def _spread():
    """Tables `ptt_spread` and `ptt_training`: from 8 neurons on within a tenth of the least RMS error."""
    keys = [
        {"experiment": f"ptt_{k}", "spread_from": "candidate", "learns": "correction", "spread_mm": mm}
        for k in range(1, 6)
        for mm in (20.0, 40.0)
    ]
    neurons = np.arange(0, 31)
    error = np.where(neurons < 8, 10.0 - neurons, np.where(neurons < 15, 1.05, 1.0))
    training = pd.concat([pd.DataFrame(key | {"neurons": neurons, "validation_mse_mm2": error**2}) for key in keys])
    return pd.DataFrame(keys).assign(chosen=lambda frame: frame["spread_mm"] == 40.0), training


def _repeatability(worst):
    """Table `ptt_repeatability` of three sliders, the first with a value of its own after compensation."""
    values = {True: [worst, 0.1, 0.1], False: [0.2, 0.2, 0.2]}
    return pd.DataFrame(
        [
            {"leg": leg, "compensated": compensated, "per_travel_um_per_mm": value}
            for compensated, column in values.items()
            for leg, value in enumerate(column, start=1)
        ]
    )


def test_numbers_are_those_of_the_jacobians_route_on_test_points():
    frame = check("published", published_rows(SECTION, _benefit(), *_spread(), _repeatability(0.1)))
    here = frame.set_index("item")["here"]
    assert [here[f"benefit_{k}_{axis}"] for k in (1, 5) for axis in "xyz"] == [91.0] * 3 + [95.0] * 3
    assert here["spread_3"] == pytest.approx(40.0 / 50.0)
    assert here["training_steps"] == 8.0 and here["order_repeatability"] == 1.0
    assert (here["training_points"], here["test_points"], here["loads"], here["experiments"]) == (10, 2, 3, 5)
    assert (here["encoder_accuracy_um"], here["solved_positions"]) == (1.0, 3.0)
    assert set(frame.loc[frame["here"].isna(), "item"]) == {
        *("leg_angle_deg", "singular_cases", "learning_rate_min", "learning_rate_max", "target_mse")
    }
    worse = published_rows(SECTION, _benefit(), *_spread(), _repeatability(0.3)).set_index("item")["here"]
    assert worse["order_repeatability"] == 0.0
