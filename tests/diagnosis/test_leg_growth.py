"""Rods of a parallel robot that grow while a campaign lasts, against a simulation by NumPy alone."""

import pytest

import rrru
from tests.diagnosis import rotary_hexa


def _diagnosed(tmp_path, **causes):
    robot = rrru.load_robot(str(rotary_hexa.robot_file(tmp_path)), platform="plate")
    campaign = rrru.read_campaign(
        rotary_hexa.file_of(**causes),
        robot,
        noise_mm=rotary_hexa.NOISE_MM,
        targets=rotary_hexa.TARGETS,
        motion="stop_and_go",
    )
    return rrru.diagnose(campaign)


@pytest.mark.parametrize("growth_mm", [(0.0, 0.0, 0.2, 0.0, 0.0, 0.0), (0.0, 0.15, 0.0, 0.0, 0.25, 0.0)])
def test_rods_that_grow_are_named(tmp_path, growth_mm):
    """They were "base drift", with more than 0.99, and something unexplained."""
    found = _diagnosed(tmp_path, growth_mm=growth_mm, seed=3)
    grown = [k for k, mm in enumerate(growth_mm, 1) if mm]
    (cause,) = found.verdict["effects"]
    assert cause["name"] == "link_growth" and cause["legs"] == " and ".join(map(str, grown))
    assert cause["share_low"] > 0.9
    numbers = found.parameters.query("effect == 'link_growth'").set_index("parameter")
    for k in grown:
        low, high = numbers.loc[f"rod_strain{k}", ["low_95", "high_95"]]
        assert low < growth_mm[k - 1] / rotary_hexa.ROD_MM < high
    low, high = numbers.loc["time_constant", ["low_95", "high_95"]]
    assert low < rotary_hexa.TIME_CONSTANT_S < high


def test_rods_that_all_grow_are_no_drift(tmp_path):
    """Base and platform stay as they are; that all of the robot grows is confounded with it at these stops."""
    found = _diagnosed(tmp_path, growth_mm=(0.15,) * 6)
    probability = found.causes.set_index("effect")["probability"]
    assert probability["base_drift"] < 0.05
    assert probability[["thermal_growth", "link_growth"]].sum() > 0.95 and probability["link_growth"] > 0.05


def test_a_base_that_drifts_is_still_named(tmp_path):
    found = _diagnosed(tmp_path, drift_mm_s=(1e-4, -5e-5, 3e-5))
    assert [cause["name"] for cause in found.verdict["effects"]] == ["base_drift"]


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_named_where_nothing_acts(tmp_path, seed):
    assert _diagnosed(tmp_path, seed=seed).verdict["effects"] == []
