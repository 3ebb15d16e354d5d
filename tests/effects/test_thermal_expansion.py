"""Links that follow a measured temperature."""

import numpy as np
import pytest

from rrru.campaign import measurements as rows
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.model_fit import fit_named_effects
from rrru.effects import library as effects
from tests.diagnosis import arms

_EXPANSION = 2.3e-5
_TEMPERATURE = 20.0 + np.array([0.0, 1.0, 4.0, 10.0, -5.0, 2.5])
EFFECT = effects.find("thermal_expansion", arms.ARM)


def _motion():
    frame = arms.measure(count=len(_TEMPERATURE)).assign(temperature_c=_TEMPERATURE)
    return arms.problem_of(frame).motion


def test_an_arm_of_one_material_grows_as_a_whole():
    """All angles stay: where it ends is the nominal place, enlarged about the base by what its temperature asks for."""
    motion = _motion()
    np.testing.assert_array_equal(motion.temperature_c, _TEMPERATURE)
    twists = EFFECT.contribute(motion, [_EXPANSION]).twists
    cold = arms.ARM.solve(motion.drive, motion.position_mm)
    warm = arms.ARM.solve(motion.drive, motion.position_mm, twists)
    factor = 1.0 + _EXPANSION * (_TEMPERATURE - 20.0)
    np.testing.assert_allclose(warm.position_mm, cold.position_mm * factor[:, None], atol=1e-6)
    np.testing.assert_allclose(warm.turn, cold.turn, atol=1e-9)


def test_without_a_temperature_it_says_nothing_and_is_not_tested():
    frame = arms.measure(count=6)
    motion = arms.problem_of(frame).motion
    assert np.isnan(motion.temperature_c).all()
    assert not EFFECT.contribute(motion, [_EXPANSION]).twists.any()
    problem = arms.problem_of(frame, "thermal_expansion")
    assert "needs temperature_c" in problem.untestable["thermal_expansion"]


def test_the_coefficient_is_found_from_an_arm_measured_warm_and_cold():
    frame = arms.measure(count=60)
    temperature = 20.0 + 8.0 * np.sin(np.arange(60.0))
    grown = rows.measured(frame) * (1.0 + _EXPANSION * (temperature - 20.0))[:, None]
    frame = frame.assign(temperature_c=temperature, **rows.vector_columns("measured", grown))
    problem = arms.problem_of(frame, "thermal_expansion")
    fit = fit_named_effects(problem, ["thermal_expansion"], calibrate(problem))
    found, error = fit.state.effects["thermal_expansion", 0][0], fit.estimate.block_errors("thermal_expansion")[0]
    assert error < 0.05 * _EXPANSION
    assert found == pytest.approx(_EXPANSION, abs=4.0 * error)
