"""Prediction errors of each stop by the hat matrix, against fits to the other stops."""

import numpy as np
import pytest

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.model_fit import fit_model
from rrru.diagnosis.prediction_errors import prediction_errors
from rrru.diagnosis.terms import EffectTerm
from rrru.estimation.noise_model import NoiseModel
from tests.diagnosis.campaigns import EFFECTS, measure, problem_of, strong


@pytest.mark.parametrize("axis_mm", [(0.02, 0.02, 0.02), (0.02, 0.04, 0.1)])
def test_a_stop_is_predicted_as_by_a_fit_without_it(axis_mm):
    frame = measure((strong("leg_asymmetry", 4.0),))
    problem = problem_of(frame, {"leg_asymmetry": EFFECTS["leg_asymmetry"]}).under(NoiseModel(np.array(axis_mm), 0.0))
    terms, scales = [EffectTerm("leg_asymmetry")], 3.0 * EFFECTS["leg_asymmetry"].coordinates.typical
    whole = fit_model(problem, [calibrate(problem)], terms, scales)
    found = prediction_errors(whole)
    for stop in np.random.default_rng(3).choice(np.unique(problem.stop), 6, replace=False):
        here = problem.stop == stop
        others = problem.without(here)
        expected = problem.residual(fit_model(others, [whole.state], terms, scales).state)[here]
        np.testing.assert_allclose(found[here], expected, rtol=0.02, atol=2e-5)
    # of every stop the fit has taken something
    assert np.quantile(np.abs(found - whole.estimate.residual).max(axis=1), 0.2) > 1e-4
