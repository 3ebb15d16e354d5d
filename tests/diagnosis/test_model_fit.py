"""Fits of the exact model with effects: derivatives, the objective's minimum, estimate and set belong together."""

from dataclasses import replace

import numpy as np
import pytest

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.inference import KNOWN, infer, with_effects
from rrru.diagnosis.model_fit import EffectModel, fit_model, fit_named_effects, whitening_of
from rrru.diagnosis.payload_nuisance import WEIGHT
from rrru.diagnosis.result_tables import parameter_rows
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.state import ModelState
from rrru.diagnosis.terms import EACH, SAME, EffectTerm
from rrru.effects.library import find
from rrru.estimation.noise_model import NoiseModel
from rrru.estimation.problem import Problem
from tests.diagnosis import arms
from tests.diagnosis.campaigns import EFFECTS, NOISE_MM, diagnosed, measure, problem_of, strong

_UNEQUAL = NoiseModel(np.array([0.02, 0.02, 0.1]), 0.6)


def _problem(*names, acting="leg_asymmetry", noise=_UNEQUAL):
    frame = measure((strong(acting, 4.0),)) if acting else measure()
    return problem_of(frame, {name: EFFECTS[name] for name in names}).under(noise)


def _model(problem, *terms):
    scales = np.concatenate([3.0 * problem.library[t.effect].coordinates.typical[: _count(problem, t)] for t in terms])
    return EffectModel(problem, terms, scales)


def _count(problem, term):
    coordinates = problem.library[term.effect].coordinates
    return len(coordinates) if term.legs == EACH else int((coordinates.legs == 1).sum())


@pytest.mark.parametrize(
    "terms",
    [
        (EffectTerm("leg_asymmetry"),),
        (EffectTerm("drive_compliance", 0, SAME), EffectTerm("encoder_eccentricity")),
        (EffectTerm("thermal_growth"), EffectTerm("link_flexure", 0, 2)),
    ],
    ids=lambda terms: "+".join(t.effect for t in terms),
)
def test_derivatives_are_those_of_the_exact_model(terms):
    """By geometry, coefficients, shape parameters, payload and tilt, about a corrected state."""
    problem = _problem(*(term.effect for term in terms))
    model = _model(problem, *terms)
    parameters = model.parameters
    generator = np.random.default_rng(1)
    size = np.where(np.isfinite(parameters.wide_sd), parameters.wide_sd, parameters.sd)
    # geometric errors of the size that robots have, not of their weak prior
    size[parameters.slices["geometry"]] = [1e-3] * 3 + [0.3] * 4
    values = parameters.clipped(parameters.mean + 0.3 * size * np.abs(generator.standard_normal(len(size))))
    found = model.jacobian(values)
    for number, step in enumerate(1e-3 * size):
        change = step * np.eye(len(size))[number]
        slope = (model.residual(values + change) - model.residual(values - change)) / (2.0 * step)
        scale = np.abs(slope).max()
        np.testing.assert_allclose(
            found[..., number], slope, atol=2e-3 * scale + 1e-9, err_msg=parameters.names[number]
        )
    assert (WEIGHT in parameters.slices) == any(t.effect in ("drive_compliance", "link_flexure") for t in terms)


def _objective(fit, values):
    """Half the sum of squares of whitened residuals and of priors, computed here once more."""
    model = fit.model
    white = whitening_of(model.problem, fit.level)(model.residual(values))
    return 0.5 * (white**2).sum() + model.parameters.prior_cost(values)


@pytest.mark.parametrize("level", [0, 4])
@pytest.mark.parametrize("effect", ["leg_asymmetry", "backlash"])
def test_the_fit_is_the_minimum_of_the_penalised_whitened_objective(effect, level):
    problem = _problem(effect, acting=effect)
    scales = 3.0 * EFFECTS[effect].coordinates.typical
    fit = fit_model(problem, [calibrate(problem)], [EffectTerm(effect)], scales, level)
    assert fit.estimate.end.converged
    best = _objective(fit, fit.estimate.values)
    assert best == pytest.approx(fit.estimate.end.cost, rel=1e-9)
    generator, errors = np.random.default_rng(2), np.nan_to_num(fit.estimate.standard_errors)
    for _ in range(20):
        away = 0.05 * errors * generator.standard_normal(len(errors))
        low = fit.model.parameters.clipped(fit.estimate.values + away)
        assert _objective(fit, low) > best - 1e-6


def test_ordinary_least_squares_is_another_estimate_and_a_worse_one():
    """Under axes of 0.02, 0.02 and 0.1 mm."""
    problem, plain = _problem(acting=None), _problem(acting=None, noise=NoiseModel.white(NOISE_MM))
    weighted, ordinary = (fit_model(one, [calibrate(one)]).estimate for one in (problem, plain))
    assert not np.allclose(weighted.values, ordinary.values, atol=1e-6)
    assert _objective(fit_model(problem, [ModelState(weighted.values, {})]), weighted.values) < _objective(
        fit_model(problem, [ModelState(weighted.values, {})]), ordinary.values
    )


def test_an_effect_that_is_named_has_numbers_whatever_the_start():
    """Where the exact model has no pose at the start with an effect, the fit begins without it."""
    problem = _problem("leg_asymmetry")
    lost = ModelState(calibrate(problem).deviations, {("leg_asymmetry", 0): np.tile([0.0, 0.0, -700.0], 3)})
    assert not np.isfinite(problem.residual(lost)).all()
    fit = fit_model(problem, [lost], [EffectTerm("leg_asymmetry")], 3.0 * EFFECTS["leg_asymmetry"].coordinates.typical)
    assert fit.estimate.end.converged and set(fit.state.effects) == {("leg_asymmetry", 0)}
    other = fit_model(problem, [calibrate(problem)], [EffectTerm("leg_asymmetry")], fit.model.scales)
    np.testing.assert_allclose(
        fit.estimate.values, other.estimate.values, atol=1e-3 * np.nanmax(fit.estimate.standard_errors)
    )


def test_the_fit_is_of_the_named_set_under_the_case_it_is_stated_for():
    problem = problem_of(measure((strong("backlash", 5.0),)))
    found = infer(problem, GapSettings().prior, KNOWN)
    for inference in (found, with_effects(found, ("backlash",)), with_effects(found, ("backlash", "servo_lag"))):
        terms = {(t.effect, t.shape) for t in inference.hypothesis.terms}
        assert set(inference.state.effects) == terms == {(t.effect, t.shape) for t in inference.fit.terms}
        complete = inference.problem.at_complete(inference.hypothesis.effects)
        np.testing.assert_array_equal(inference.fit.model.problem.used, complete.used)
        assert inference.fit.level == inference.level
        rows = parameter_rows(inference)
        for name in inference.hypothesis.effects:
            assert rows.loc[rows["effect"] == name, "standard_error"].notna().any()


def test_fitted_shape_parameters_have_errors():
    found = diagnosed(measure((strong("thermal_growth", 8.0),)))
    numbers = found.tables["gap_parameters"].set_index(["effect", "parameter"])
    constant = numbers.loc[("thermal_growth",)].filter(like="time", axis=0)
    assert len(constant) and constant["standard_error"].notna().all()


def test_named_effects_keep_their_sign_free():
    """A size that contradicts the effect model shows: a compliance of the wrong sign is not cut off at zero."""
    frame = arms.measure((arms.active("drive_compliance", np.full(arms.DRIVES, 2e-8)),), count=80)
    problem = arms.problem_of(frame, "drive_compliance")
    wrong = replace(problem, motion=replace(problem.motion, drive_load=-problem.motion.drive_load))
    fit = fit_named_effects(wrong, ["drive_compliance"], calibrate(wrong))
    sizes, errors = fit.state.effects["drive_compliance", 0], fit.estimate.block_errors("drive_compliance")
    known = errors < 5e-9
    assert known.any() and (sizes[known] < 0.0).all()
    assert find("drive_compliance", arms.ARM).coordinates.positive.all()


def test_one_problem_by_the_core_and_by_the_case():
    """The Problem that `fit_model` solves is the problem's own residual, whitened."""
    problem = _problem("servo_lag", acting="servo_lag")
    model = _model(problem, EffectTerm("servo_lag"))
    estimation = Problem(model, model.parameters, whitening_of(problem, 0))
    state = calibrate(problem)
    np.testing.assert_allclose(
        estimation.observations.residual(model.vector(state)), problem.residual(state), atol=1e-6
    )
