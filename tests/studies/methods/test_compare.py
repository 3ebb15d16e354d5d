"""The comparison of methods: each against what it must do on a robot whose truth is known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml
from snakemake.utils import validate

from rrru.errors import ConfigError
from rrru.plant.virtual_tripod import VirtualTripod
from rrru.studies.methods import benches, compare, learners
from tests.schemas import check
from tests.workflow.folder import ROOT

CONFIG = yaml.safe_load((ROOT / "config.yaml").read_text())
validate(CONFIG, str(ROOT / "workflow/schemas/config.schema.yaml"))
SHORT = CONFIG | {
    "methods": CONFIG["methods"] | {"points": [20, 60], "test_points": 20},
    "genetic": CONFIG["genetic"] | {"generations": 60},
}


@pytest.fixture(scope="module")
def delta():
    bench = benches.bench(SHORT, "delta")
    offsets = {
        "dtheta_rad": [bench.robot.deviations[f"dtheta{k}"] for k in (1, 2, 3)],
        "poses": 20,
        "measuring_time_s": 60.0,
    }
    return bench, *compare.compare(bench, SHORT, offsets)


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
    # the drives' own errors taken out, the lengths' stay: offsets fitted to positions also take up a part of these
    assert inside["zero_offsets"] < inside["zero_offsets_images"] < delta[1]["before_mean_mm"].iloc[0]
    # a step measures each target with noise, and leaves that and the second order of the error
    assert 0.5 * noise < inside["jacobian_step"] < 4.0 * noise


def test_before_is_the_distance_of_the_nominal_controllers_points(delta):
    """The kinematic part of it: without play and compliance, which move the platform by some hundredths only."""
    bench, methods = delta[0], delta[1]
    for test in benches.TESTS:
        targets = bench.plan(bench.tests[test]).targets()
        true = bench.robot.geometry.mechanism.forward(
            bench.robot.mechanism.inverse(targets),
            bench.robot.geometry.mechanism.parameters.vector(bench.robot.deviations),
        )
        expected = np.linalg.norm(true - targets, axis=1)
        row = methods.query("test == @test").iloc[0]
        assert abs(row["before_mean_mm"] - expected.mean()) < 0.1
        errors = compare._errors(
            replace(bench, robot=replace(bench.robot, effects=())), bench.plan(bench.tests[test]), test
        )
        np.testing.assert_allclose(errors, expected, atol=1e-9)
        assert row["before_max_mm"] == pytest.approx(expected.max(), abs=0.1)


@pytest.mark.parametrize(("noise_mm", "needed"), [(0.0, 80), (0.02, 20), (0.5, 10)])
def test_the_points_needed_are_the_fewest_from_which_on_more_bring_next_to_nothing(noise_mm, needed):
    label = {
        "before_mean_mm": 1.0,
        "before_max_mm": 2.0,
        "after_max_mm": 1.0,
        "numbers": 3,
        "evaluations": 1,
        "method": "genetic",
    }
    curve = pd.DataFrame(
        [
            label | {"test": test, "points": points, "after_mean_mm": after, "measuring_time_s": float(points)}
            for test in benches.TESTS
            for points, after in ((10, 0.5), (20, 0.109), (40, 0.111), (80, 0.1))
        ]
    )
    found = compare._methods(curve, noise_mm)
    # 40 points are worse than a tenth above the last, so that 20 were lucky
    assert (
        (found["points"] == 80).all()
        and (found["points_needed"] == needed).all()
        and (found["needed_time_s"] == needed).all()
    )
    assert found["removed_share"].to_numpy() == pytest.approx(0.9)


def test_a_perfect_robot_is_left_as_it_is():
    """Without errors and noise no method may move the robot off its targets."""
    bench = benches.bench(SHORT, "ptt3")
    ideal = VirtualTripod(bench.robot.mechanism)
    still = SimpleNamespace(**{**bench.__dict__, "robot": ideal, "noise_mm": 0.0})
    still.generator = bench.generator
    still.plan = bench.plan
    still.run = lambda plan, label, controller=None: ideal.run(plan, 0.0, bench.generator("run", label), controller)
    quiet = SHORT | {"methods": SHORT["methods"] | {"points": [60]}}
    _, curve, _ = compare.compare(still, quiet)
    after = curve.groupby("method")["after_max_mm"].max()
    # the genetic algorithm comes near, never there
    assert after.drop("genetic").max() < 1e-6 < after["genetic"]


def test_points_outside_lie_around_the_region_and_all_are_reachable():
    for robot in benches.ROBOTS:
        bench, region = benches.bench(SHORT, robot), SHORT["methods"]["regions"][robot]

        def within(points, region=region):
            near = np.hypot(*(points[:, :2] - region["centre_mm"]).T) <= region["radius_mm"] * (1.0 + 1e-12)
            return near & (points[:, 2] >= min(region["z_mm"])) & (points[:, 2] <= max(region["z_mm"]))

        assert (
            within(bench.train).all()
            and within(bench.tests["inside"]).all()
            and not within(bench.tests["outside"]).any()
        )
        assert len(bench.tests["outside"]) == len(bench.tests["inside"]) == 20


def test_a_region_out_of_reach_is_refused():
    far = {"ptt3": {"centre_mm": [0.0, 0.0], "radius_mm": 80.0, "z_mm": [-500.0, -400.0], "noise_mm": 0.0}}
    with pytest.raises(ConfigError, match=r"methods.regions.ptt3: 60 of 60 points are out of reach"):
        benches.bench(SHORT | {"methods": SHORT["methods"] | {"regions": SHORT["methods"]["regions"] | far}}, "ptt3")
