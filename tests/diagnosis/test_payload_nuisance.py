"""An unstated mass and a tilted base: the compliance is named, its parameters hold, and notes say what is off."""

from dataclasses import replace
from itertools import permutations
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from rrru.diagnosis.design.expected_information import contests
from rrru.diagnosis.design.rival_answers import RivalAnswer
from rrru.diagnosis.diagnose import MeasuredRobot, diagnose
from rrru.diagnosis.payload_nuisance import nuisance_priors
from rrru.diagnosis.settings import GapSettings, check
from rrru.diagnosis.terms import EffectTerm
from rrru.diagnosis.whitened import DISCREPANCY_SCALES
from rrru.effects.protocol import bears_load, is_compliant
from rrru.errors import ConfigError
from rrru.kinematics.dynamics import Masses
from rrru.kinematics.point_masses import PLATFORM
from rrru.seeds import stream
from rrru.studies.blind_validation.causes import Fault
from rrru.studies.blind_validation.draw import draw_trajectories
from rrru.studies.blind_validation.robots import FileRobot
from tests.diagnosis.campaigns import ROBOT, active, measure
from tests.diagnosis.test_marginal_problem import GRIDS, asked, coefficients_of, the_same
from tests.studies.blind_validation.files import conditions

_FILE, _SOFT = "hexapod_file", (0.03, 0.012, 0.045, 0.02, 0.035, 0.025)
_OFF = {"extra_kg": 1.2, "lean_x": 0.025, "lean_y": -0.02}


def _found(more, settings=None):
    """Verdict and `gap_parameters` by effect and parameter of a hexapod with soft legs."""
    known = conditions(_FILE)
    fault = Fault("soft_servo_under_a_load", _SOFT, more)
    paths = draw_trajectories(stream(5, "paths"), known)
    robot = FileRobot("a hexapod", _FILE, "own", paths, (0.2, -0.1, 0.3, 0.1, -0.4, 0.2), (fault,))
    measurements = robot.measured(known)
    robot = MeasuredRobot(known.seen(measurements), known.masses, known.noise_mm)
    result = diagnose(measurements, robot, settings or GapSettings(), details=False)
    return result.verdict, result.tables["gap_parameters"].set_index(["effect", "parameter"]), result.inference


@pytest.fixture(scope="module")
def misled():
    """With payload and tilt that are not as stated."""
    return _found({"load_kg": _OFF["extra_kg"], "tilt_x_rad": _OFF["lean_x"], "tilt_y_rad": _OFF["lean_y"]})


@pytest.fixture(scope="module")
def as_stated():
    """With payload and tilt as stated."""
    return _found({})


def test_the_campaign_driven_once_more_is_worth_as_much_again(misled):
    *_, inference = misled
    nothing = replace(inference.hypothesis, terms=(), prior_scales=np.zeros((len(DISCREPANCY_SCALES), 0)))
    answers = [
        RivalAnswer(words, (hypothesis, inference.level), 0.5)
        for words, hypothesis in (("named", inference.hypothesis), ("none", nothing))
    ]
    # all of its points as one run
    once = replace(inference.problem, measurements=inference.problem.measurements.assign(run=1))
    about = contests(inference, answers, once)
    np.testing.assert_allclose(about.gains()[0], np.concatenate([one.now_nats for one in about.predictions]), rtol=1e-3)


def test_with_payload_and_tilt_the_order_of_the_terms_makes_no_difference(misled):
    *_, inference = misled
    evidence = inference.evidence
    terms = EffectTerm("backlash"), EffectTerm("drive_compliance"), EffectTerm("joint_clearance", 1)
    assert evidence.projected(terms, [0]).weights
    the_same(asked(evidence, terms, GRIDS))
    first, *others = (coefficients_of(evidence, terms, order) for order in permutations(range(3)))
    for other in others:
        for one, own in zip(first, other, strict=True):
            np.testing.assert_allclose(own, one, rtol=1e-6, atol=1e-9)


def test_the_springs_are_named_and_within_their_errors(misled):
    verdict, numbers, _ = misled
    assert verdict["effects"] == "drive_compliance"
    own = numbers.loc["drive_compliance"]
    off = (own["value"] - np.array(_SOFT)) / own["standard_error"]
    # six numbers of chi-square 22.5 in a thousand draws once
    assert (off**2).sum() < 22.5
    assert (own["standard_error"] < 0.1 * np.array(_SOFT)).sum() >= 4


def test_errors_of_payload_and_tilt_are_found_and_reported(misled):
    verdict, numbers, _ = misled
    weight = numbers.loc["weight"]
    off = (weight["value"] - list(_OFF.values())) / weight["standard_error"]
    assert list(weight.index) == list(_OFF) and (off**2).sum() < 16.3
    sure = weight[weight["value"].abs() > 3.0 * weight["standard_error"]]
    said = sum(verdict["notes"].count(words) for words in ("more than stated", "the base is tilted"))
    assert len(sure) and said == len(sure)


def test_payload_and_tilt_that_are_as_stated_stay_so(as_stated):
    verdict, numbers, _ = as_stated
    weight = numbers.loc["weight"]
    assert verdict["effects"] == "drive_compliance" and "tilted" not in verdict["notes"]
    assert (weight["value"].abs() < 3.0 * weight["standard_error"]).all()


def test_known_payload_and_tilt_are_not_fitted(as_stated):
    known = dict.fromkeys(_OFF, 0.0)
    verdict, numbers, _ = _found({}, GapSettings(known={"weight": known}))
    assert verdict["effects"] == "drive_compliance" and "weight" not in numbers.index.get_level_values("effect")
    _, free, _ = as_stated
    sizes = [one.loc["drive_compliance", "standard_error"] for one in (numbers, free)]
    assert (sizes[0] < sizes[1]).all()


@pytest.mark.parametrize("wrong", [{"lean": 0.0}, {"extra_kg": 1.0}], ids=["no such number", "not as stated"])
def test_payload_and_tilt_can_be_known_only_as_stated(wrong):
    with pytest.raises(ConfigError, match=r"gap\.known: weight"):
        GapSettings(known={"weight": wrong}).library(conditions(_FILE).mechanism)


def test_leans_about_all_axes_may_be_known_for_robots_of_one_configuration_stand_or_hang():
    known = {"weight": dict.fromkeys(("extra_kg", "lean_x", "lean_y", "lean_z"), 0.0)}
    config = yaml.safe_load(Path("config.yaml").read_text())
    check({"gap": config["gap"] | {"known": known}, "seed": 1})
    GapSettings(known=known).library(conditions(_FILE).mechanism)


def test_a_weight_may_lean_either_way_and_no_platform_is_lighter_than_nothing():
    masses = Masses(platform_kg=3.0, arm_kg=1.0, forearm_kg=0.0)
    nuisance_sd, bounds = nuisance_priors(
        SimpleNamespace(robot=ROBOT, payload_kg=np.array([0.0, 20.0, np.nan])), masses
    )
    assert nuisance_sd["extra_kg"] == pytest.approx(0.3 * 23.0) and -3.0 < bounds["extra_kg"][0] < -2.0
    assert all(bounds[lean][0] == -bounds[lean][1] for lean in ("lean_x", "lean_y"))
    nothing, _ = nuisance_priors(SimpleNamespace(robot=ROBOT, payload_kg=np.zeros(1)), Masses(0.0, 0.0, 0.0))
    assert not any(nothing.values())


def test_an_arm_without_a_stated_tool_may_carry_one():
    arm = conditions("arm6_file").mechanism
    arm = replace(
        arm, point_masses=tuple(point_mass for point_mass in arm.point_masses if point_mass.joint != PLATFORM)
    )
    nuisance_sd, _ = nuisance_priors(SimpleNamespace(robot=arm, payload_kg=np.zeros(1)), Masses(0.0, 0.0, 0.0))
    assert (
        nuisance_sd["extra_kg"] == pytest.approx(0.1 * sum(point_mass.mass_kg for point_mass in arm.point_masses))
        and nuisance_sd["lean_x"] > 0.0
    )


def test_where_a_joint_is_loose_payload_and_tilt_are_not_fitted():
    loose = active("joint_clearance", [0.3, 0.25, 0.35])
    assert bears_load(loose.effect) and not is_compliant(loose.effect)
    measurements = measure((loose,), seed=3)
    result = diagnose(measurements, MeasuredRobot(ROBOT, Masses(3.0, 1.0, 0.5), 0.02), GapSettings(), details=False)
    assert result.verdict["effects"] == "joint_clearance" and not result.inference.state.weight
    assert "tilted" not in result.verdict["notes"]
