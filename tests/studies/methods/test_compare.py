"""The comparison of methods: each against what it must do on a robot whose truth is known."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml
from snakemake.utils import validate

from rrru.errors import ConfigError
from rrru.genetic.settings import GeneticSettings
from rrru.simulation.virtual_robot import VirtualRobot
from rrru.studies.methods import compare, learners, parts, regions
from tests.places import ROOT
from tests.schemas import check

_LOADS = {"platform_mass_kg": 3.0, "forearm_mass_kg": 1.2, "arm_mass_kg": 2.0}
_BOUNDS = {"angle_rad": 0.025, "length_mm": 3.0}
_COMMON = {
    "seed": 3,
    "points": [20, 60],
    "test_points": 20,
    "outside_factor": 1.5,
    "motion": {"speed_mm_s": 80.0, "acceleration_mm_s2": 400.0, "settle_s": 2.0},
}
_DELTA_ERRORS = {"dtheta1": -0.006, "dtheta2": -0.0055, "dtheta3": 0.004} | {
    f"{kind}_{leg}": value
    for kind, values in {"dl1": (0.4, -0.3, 0.2), "dl2": (-0.5, 0.6, 0.3), "da": (0.2, 0.1, -0.3)}.items()
    for leg, value in zip((1, 2, 3), values, strict=True)
}
_DELTA_EFFECTS = {
    "backlash": {"width1": 1.0e-4, "width2": 0.8e-4, "width3": 1.2e-4},
    "drive_compliance": {"compliance1": 2.0e-8, "compliance2": 2.5e-8, "compliance3": 1.5e-8},
}
DELTA = _COMMON | {
    "robot": "delta",
    "nominal": {"name": "delta", "dimensions": {"l1_mm": 375.0, "l2_mm": 900.0, "a_mm": 125.0}, "bounds": _BOUNDS},
    "real": {"errors": _DELTA_ERRORS, "effects": _DELTA_EFFECTS} | _LOADS,
    "region": {"centre_mm": [0.0, 0.0], "radius_mm": 230.0, "z_mm": [-80.0, 80.0], "noise_mm": 0.015},
}
PTT3 = _COMMON | {
    "robot": "ptt3",
    "nominal": {"name": "ptt3", "dimensions": {"L_mm": 350.0, "R_mm": 300.0, "r_mm": 60.0}, "bounds": _BOUNDS},
    "real": {"errors": {}, "effects": {}} | _LOADS,
    "region": {"centre_mm": [0.0, 0.0], "radius_mm": 80.0, "z_mm": [-275.0, -215.0], "noise_mm": 0.005},
}
NETWORK = learners.Candidates(folds=3, neurons=20, spreads=(2.0, 8.0))
GENETIC = GeneticSettings(generations=60)


@pytest.fixture(scope="module")
def delta():
    one = regions.trial(DELTA)
    offsets = {
        "dtheta_rad": [_DELTA_ERRORS[f"dtheta{leg}"] for leg in (1, 2, 3)],
        "poses": 20,
        "measuring_time_s": 60.0,
    }
    return one, *compare.compare(one, DELTA["points"], NETWORK, GENETIC, offsets)


def test_the_tables_fit_their_schemas(delta):
    for name, frame in zip(("methods", "method_points", "method_timings"), delta[1:], strict=True):
        check(name, frame.assign(robot="delta"))


def test_every_method_is_there_for_both_tests(delta):
    methods = delta[1]
    assert set(methods["method"]) == set(learners.NEEDS)
    assert methods.groupby("method")["test"].apply(set).map(len).eq(2).all()


def test_the_richer_the_model_the_less_is_left(delta):
    """Zero offsets that are exactly right leave the lengths' part; all lengths leave what play and compliance make."""
    inside = delta[1].query("test == 'inside'").set_index("method")["after_mean_mm"]
    noise = delta[0].noise_mm
    assert inside["least_squares_full"] < 3.0 * noise and inside["least_squares_full"] < 0.4 * inside["zero_offsets"]
    # the drives' errors are removed, those of the lengths stay: offsets fitted to positions also absorb a part of these
    assert inside["zero_offsets"] < inside["zero_offsets_images"] < delta[1]["before_mean_mm"].iloc[0]
    # a step measures each target with noise, and leaves that and the second order of the error
    assert 0.5 * noise < inside["jacobian_step"] < 4.0 * noise


def test_before_is_the_distance_of_the_nominal_controllers_points(delta):
    """The kinematic part of it: without play and compliance, which move the platform by some hundredths only."""
    one, methods = delta[0], delta[1]
    rich = replace(one.robot.mechanism, parameter_set="legs")
    plain = compare.Judge(replace(one, robot=replace(one.robot, effects=())))
    for test in regions.TESTS:
        targets = one.plan(one.tests_mm[test]).targets()
        sent = one.robot.mechanism.inverse(targets)
        expected = np.linalg.norm(rich.forward(sent, rich.parameters.vector(_DELTA_ERRORS)) - targets, axis=1)
        row = methods.query("test == @test").iloc[0]
        assert abs(row["before_mean_mm"] - expected.mean()) < 0.1
        assert row["before_max_mm"] == pytest.approx(expected.max(), abs=0.1)
        np.testing.assert_allclose(plain.before[test], expected, atol=1e-9)


@pytest.mark.parametrize(("noise_mm", "needed"), [(0.0, 80), (0.02, 20), (0.5, 10)])
def test_the_points_needed_are_the_fewest_from_which_on_more_bring_next_to_nothing(noise_mm, needed):
    sizes = {"before_mean_mm": 1.0, "before_max_mm": 2.0, "after_max_mm": 1.0, "numbers": 3, "evaluations": 1}
    curve = pd.DataFrame(
        [
            sizes
            | {"method": "genetic", "test": test, "points": points}
            | {"after_mean_mm": after, "measuring_time_s": float(points)}
            for test in regions.TESTS
            for points, after in ((10, 0.5), (20, 0.109), (40, 0.111), (80, 0.1))
        ]
    )
    found = compare.summary(curve, noise_mm)
    # 40 points are worse than a tenth above the last, so that 20 were lucky
    assert found["test"].tolist() == list(regions.TESTS) and (found["points"] == 80).all()
    assert (found["points_needed"] == needed).all() and (found["needed_time_s"] == needed).all()
    assert found["removed_share"].to_numpy() == pytest.approx(0.9)


def test_a_perfect_robot_is_left_as_it_is():
    """Without errors and noise no method may move the robot off its targets."""
    one = regions.trial(PTT3)
    still = replace(one, robot=VirtualRobot(one.robot.mechanism), noise_mm=0.0)
    _, curve, _ = compare.compare(still, [60], NETWORK, GENETIC)
    after = curve.groupby("method")["after_max_mm"].max()
    # the genetic algorithm comes near, never there
    assert after.drop("genetic").max() < 1e-6 < after["genetic"]


@pytest.mark.parametrize("robot", ["rrru3", "ptt3", "delta"])
def test_points_outside_lie_around_the_configured_region_and_all_are_reachable(robot):
    config = yaml.safe_load((ROOT / "config.yaml").read_text())
    validate(config, str(ROOT / "rrru/pipeline/config.schema.yaml"))
    settings = parts.settings(config, robot) | {"test_points": 20}
    one, region = regions.trial(settings), settings["region"]

    def within(points):
        near = np.hypot(*(points[:, :2] - region["centre_mm"]).T) <= region["radius_mm"] * (1.0 + 1e-12)
        return near & (points[:, 2] >= min(region["z_mm"])) & (points[:, 2] <= max(region["z_mm"]))

    assert within(one.train_mm).all() and len(one.train_mm) == max(settings["points"])
    assert within(one.tests_mm["inside"]).all() and not within(one.tests_mm["outside"]).any()
    assert len(one.tests_mm["outside"]) == len(one.tests_mm["inside"]) == 20


def test_a_region_out_of_reach_is_refused():
    far = PTT3["region"] | {"z_mm": [-500.0, -400.0]}
    with pytest.raises(ConfigError, match=r"methods.regions.ptt3: 60 of 60 points are out of reach"):
        regions.trial(PTT3 | {"region": far})
