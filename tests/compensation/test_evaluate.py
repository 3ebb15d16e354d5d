"""Compensation and its statistics: a modelled robot is compensated perfectly; ISO 9283 by hand."""

import numpy as np
import pandas as pd
import pytest

from rrru.calibration.campaign_fit import CalibrationSettings, deviation_vector, fit_sets, tables
from rrru.campaign import measurements as rows
from rrru.campaign.noise import repeat_noise
from rrru.campaign.plan import make_plan
from rrru.campaign.trajectories import Spiral, line_groups
from rrru.compensation import evaluate
from rrru.errors import ConfigError, FitError, UnreachableError
from rrru.simulation.virtual_robot import VirtualRobot

_ERRORS = {"dtheta1": 0.002, "dtheta2": -0.001, "dL1": 0.4, "dL3": -0.2, "dR": -1.2, "dr": 0.9}
_SETTINGS = CalibrationSettings({"lines": ["line_*"], "spiral": ["spiral"], "absent": ["circle"]})


@pytest.fixture(scope="module")
def campaign():
    curves = (
        *line_groups((-600.0, 0.0, 650.0), (-100.0, 0.0, 650.0), (0.0, 60.0, -60.0), 20),
        Spiral("spiral", (-200.0, 0.0), (50.0, 200.0), (600.0, 750.0), 3.0, 40),
    )
    plan = make_plan(curves, [{"reverse": False, "payload_kg": 0.0}] * 3, 80.0, 40.0, 60.0)
    robot = VirtualRobot(deviations=_ERRORS)
    return robot, plan, robot.run(plan, 0.01, np.random.default_rng(0))[0]


def test_calibrated_commands_land_on_target(campaign):
    robot, plan, measurements = campaign
    fits = fit_sets(measurements, robot.mechanism, _SETTINGS, noise_mm=0.01)
    assert {name for name, _ in fits} == {"lines", "spiral"}
    before = evaluate.before(measurements)["error_mm"]
    frame = tables("c", fits, robot.mechanism.identifiable(_ERRORS))["parameters"]
    frame = frame[frame["calibration"] == "lines"]

    def drive(controller):
        return robot.run(plan, 0.0, np.random.default_rng(1), controller)[0]

    errors = evaluate.under_calibrations(measurements, robot.mechanism, frame, drive)
    sizes = errors.groupby(["calibration", "method", "mode"], sort=False)["error_mm"]
    assert [key[1:] for key, _ in sizes] == [
        ("none", "before"),
        *((method, mode) for method in ("least_squares", "least_mean_distance") for mode in ("model", "closed_loop")),
    ]
    model, after = (sizes.get_group(("lines", "least_squares", mode)) for mode in ("model", "closed_loop"))
    only_model = evaluate.under_calibrations(measurements, robot.mechanism, frame)
    pd.testing.assert_frame_equal(only_model, errors[errors["mode"] != "closed_loop"].reset_index(drop=True))
    assert before.min() > 1.0 and after.max() < 0.05 and model.max() < 0.06
    truth = frame.set_index(["calibration", "method", "parameter"])["true_value"]["lines", "least_squares", "da"]
    assert truth == pytest.approx(2.1)
    with pytest.raises(FitError, match="no calibration 'both' by 'least_squares'"):
        deviation_vector(frame, "both", "least_squares", robot.mechanism)


def test_a_calibration_that_cannot_be_driven_leaves_the_others_their_rows(campaign, caplog):
    robot, plan, measurements = campaign
    fits = fit_sets(measurements, robot.mechanism, _SETTINGS, noise_mm=0.01)
    frame = tables("c", fits, robot.mechanism.identifiable(_ERRORS))["parameters"]
    driven = iter([False, *[True] * 10])

    def drive(controller):
        if not next(driven):
            raise UnreachableError("point 3 is out of reach")
        return robot.run(plan, 0.0, np.random.default_rng(1), controller)[0]

    errors = evaluate.under_calibrations(measurements, robot.mechanism, frame, drive)
    modes = errors.groupby(["calibration", "method"], sort=False)["mode"].unique()
    without = [key for key, one in modes.items() if "model" in one and "closed_loop" not in one]
    assert len(without) == 1 and sum("closed_loop" in one for one in modes) == len(modes) - 2
    assert "point 3 is out of reach" in caplog.text and without[0][0] in caplog.text


def test_a_campaign_without_any_set_is_refused(campaign):
    robot, _, measurements = campaign
    with pytest.raises(
        ConfigError, match=r"no set matches the campaign's trajectories \(line_1, line_2, line_3, spiral\)"
    ):
        fit_sets(measurements, robot.mechanism, CalibrationSettings({"x": ["circle"]}))


def test_summary_equals_the_plain_statistics(campaign):
    _, _, measurements = campaign
    errors = evaluate.before(measurements)
    summary = evaluate.summarise(errors, measurements).set_index("trajectory")
    chosen = errors.loc[errors["trajectory"] == "line_2", "error_mm"]
    row = summary.loc["line_2"]
    assert (row["min_mm"], row["max_mm"]) == (chosen.min(), chosen.max())
    assert row["mean_mm"] == pytest.approx(chosen.mean()) and row["rms_mm"] == pytest.approx(
        np.sqrt(np.mean(chosen**2))
    )
    assert summary.loc["all_lines", "points"] == 180 and summary.loc["all", "points"] == 300
    assert (summary["repeats"] == 3).all()


def test_iso_9283_by_hand():
    """Four passes along x, two and two alike: barycentre errors known, the along-path part of the error is no path
    error.
    """
    position = np.array([[-300.0, 0.0, 600.0], [-290.0, 0.0, 600.0], [-280.0, 0.0, 600.0]])
    error = np.zeros((4, 3, 3))
    error[:2], error[2:] = [0.3, 0.1, 0.0], [0.3, 0.3, 0.0]
    error[:2, 1], error[2:, 1] = [0.0, 0.0, 1.0], [0.0, 0.0, 1.4]
    frame = pd.DataFrame(
        {"run": np.repeat([1, 2, 3, 4], 3), "trajectory": "line_1", "point": np.tile([1, 2, 3], 4), "status": "ok"}
    )
    for k, axis in enumerate("xyz"):
        frame[f"command_{axis}_mm"] = np.tile(position[:, k], 4)
        frame[f"measured_{axis}_mm"] = np.tile(position[:, k], 4) + error[..., k].ravel()
    frame["speed_mm_s"], frame["payload_kg"] = 80.0, np.nan
    row = evaluate.summarise(evaluate.before(frame), frame).iloc[0]
    assert row["repeats"] == 4
    assert row["pose_accuracy_mm"] == pytest.approx(1.2) and row["path_accuracy_mm"] == pytest.approx(1.2)
    # l = 0.2 at all passes of point 2, no spread: RP = 0.2 + 3 x 0
    assert row["repeatability_mm"] == pytest.approx(0.2)
    only = frame[frame["point"] != 2].reset_index(drop=True)
    row = evaluate.summarise(evaluate.before(only), only).iloc[0]
    assert row["pose_accuracy_mm"] == pytest.approx(np.hypot(0.3, 0.2)) and row["path_accuracy_mm"] == pytest.approx(
        0.2
    )


def test_reverse_passes_are_told_apart_on_open_and_closed_paths():
    angle = np.linspace(0.0, 2.0 * np.pi, 30)
    closed = np.round(np.stack([100.0 * np.cos(angle), 100.0 * np.sin(angle), np.full(30, 600.0)], axis=1), 6)
    points = np.concatenate([closed, closed[::-1], closed[2:], closed[::-1][:-3]])
    frame = pd.DataFrame(points, columns=[f"command_{a}_mm" for a in "xyz"])
    frame["run"], frame["trajectory"] = np.repeat([1, 2, 3, 4], [30, 30, 28, 27]), "circle"
    assert [rows.direction(frame)[frame["run"] == run].tolist()[0] for run in (1, 2, 3, 4)] == [1, -1, 1, -1]


def test_names_with_pattern_characters_are_names(campaign):
    _, _, measurements = campaign
    named = measurements.assign(trajectory=measurements["trajectory"].replace({"line_1": "path[1]", "line_2": "all"}))
    summary = evaluate.summarise(evaluate.before(named), named).set_index("trajectory")
    assert (
        summary.loc["path[1]", "points"] == 60
        and summary.loc["all", "points"] == 60
        and summary.loc["all_lines", "points"] == 60
    )


def test_outliers_are_kept_but_not_counted(campaign):
    _, _, measurements = campaign
    spoilt = measurements.copy()
    spoilt.loc[4, "measured_z_mm"] += 500.0
    spoilt.loc[4, "status"] = "outlier"
    errors = evaluate.before(spoilt)
    assert len(errors) == len(spoilt) and np.isnan(errors.loc[4, "error_mm"])
    assert evaluate.summarise(errors, spoilt)["max_mm"].max() < 100.0
    assert not rows.usable(spoilt)[4]


def test_noise_from_repeats_is_the_noise(campaign):
    _, _, measurements = campaign
    noise, freedom = repeat_noise(measurements)
    assert freedom == 3 * 2 * 100 and noise == pytest.approx(0.01, rel=0.1)
    once = measurements[measurements["run"] <= 4]
    assert repeat_noise(once)[1] == 0 and np.isnan(repeat_noise(once)[0])
