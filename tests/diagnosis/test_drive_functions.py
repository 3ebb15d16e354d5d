"""Errors of drives over their values: the true function lies in the band, and the worst place is the true one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.drive_functions import drive_functions
from rrru.diagnosis.model_fit import fit_model
from rrru.diagnosis.terms import EffectTerm
from rrru.effects.library import find
from rrru.effects.protocol import ActiveEffect, Effect, plain_coordinates
from rrru.parameters import Parameter, ParameterSet
from tests.diagnosis import arms
from tests.schemas import check

NAMES = tuple(f"axis{k}" for k in range(1, 7))
# sine and cosine of each drive's error once a turn, rad; the fourth has none
WAVES = np.array([[4e-4, 0.0], [0.0, 5e-4], [2e-4, -3e-4], [0.0, 0.0], [-3e-4, 1e-4], [1e-4, 4e-4]])


@pytest.fixture(scope="module")
def found():
    """The table of a fit to an arm with eccentric encoders, and the problem."""
    name = "encoder_eccentricity"
    problem = arms.problem_of(arms.measure((arms.active(name, WAVES.ravel()),), count=120), name)
    scales = 3.0 * problem.library[name].coordinates.typical
    fit = fit_model(problem, [calibrate(problem)], [EffectTerm(name)], scales)
    table = drive_functions(SimpleNamespace(problem=problem, fit=fit), NAMES)
    return check("gap_drive_functions", table.assign(campaign="made up")), problem


def test_the_true_function_of_every_drive_lies_in_its_band(found):
    table, _ = found
    inside = []
    for number, rows in table.groupby("drive"):
        value = rows["drive_value"].to_numpy()
        true = WAVES[number - 1] @ [np.sin(value), np.cos(value)]
        off = (rows["error"] - (true - true.mean())) / (0.5 * (rows["high_95"] - rows["low_95"]))
        assert np.abs(off).max() < 2.0, number
        inside.append((np.abs(off) < 1.0).mean())
        assert np.abs(rows["error"].mean()) < 1e-12
    assert len(inside) == 6 and np.mean(inside) > 0.75


def test_it_spans_the_measured_range_and_one_place_of_each_drive_is_the_worst(found):
    table, problem = found
    for number, rows in table.groupby("drive"):
        measured = problem.motion.drive[problem.used][:, number - 1]
        assert rows["drive_value"].min() == measured.min() and rows["drive_value"].max() == measured.max()
        worst = rows[rows["worst"]]
        assert len(worst) == 1 and worst["error"].abs().iloc[0] == rows["error"].abs().max()
        assert set(rows["name"]) == {f"axis{number}"} and set(rows["unit"]) == {"rad"}


def _step(motion, values):
    """The third joint's encoder errs by a constant beyond a joint of its scale."""
    change = np.zeros_like(motion.drive)
    change[:, 2] = values[0] * (motion.drive[:, 2] > 0.1)
    return motion.at_drives(change)


def test_the_interval_of_a_zero_holds_it_where_the_drive_s_error_has_a_step():
    """The mean of the error function over all values is no part of its waves: it is confounded with the zero."""
    name, size = "drive_error_function", 2e-3
    parameters = ParameterSet((Parameter("size", "rad", 0.0, -0.01, 0.01, "test", 3),))
    step = ActiveEffect(Effect("step", parameters, plain_coordinates(parameters, 1e-3), _step), {"size": size})
    still = arms.problem_of(arms.measure(count=80, noise=(0.0, 0.0)))
    problem = replace(arms.problem_of(arms.measure((step,), count=80)), library={name: find(name, arms.ARM)})
    true = dict(zip(still.mechanism.parameters.names, calibrate(still).deviations, strict=True))["dq3"]
    coordinates = problem.library[name].coordinates
    # the first spectrum is that of steps
    scales = size / 1e-4 * coordinates.typical[coordinates.legs == 3]
    fit = fit_model(problem, [calibrate(problem)], [EffectTerm(name, 0, 3)], scales)
    low, high = fit.estimate.intervals[problem.mechanism.parameters.names.index("dq3")]
    assert low <= true <= high
    assert high - low < 8.0 * size


def test_an_effect_that_is_no_function_of_a_drive_s_value_has_no_rows():
    problem = arms.problem_of(arms.measure(count=60), "drive_compliance")
    fit = SimpleNamespace(terms=[EffectTerm("drive_compliance")])
    assert drive_functions(SimpleNamespace(problem=problem, fit=fit), NAMES).empty


def test_a_function_of_many_coefficients_is_what_steps_of_each_of_them_give(monkeypatch):
    # the slow way takes seconds for each place
    monkeypatch.setattr("rrru.diagnosis.drive_functions._PLACES", 31)
    name = "drive_error_function"
    problem = arms.problem_of(arms.measure(count=60), name)
    fit = fit_model(problem, [calibrate(problem)], [EffectTerm(name)], 3.0 * problem.library[name].coordinates.typical)
    table = drive_functions(SimpleNamespace(problem=problem, fit=fit), NAMES)
    stepped = replace(problem, library={name: replace(problem.library[name], along_drives=None)})
    again = drive_functions(SimpleNamespace(problem=stepped, fit=fit), NAMES)
    for column in ("error", "low_95", "high_95"):
        np.testing.assert_allclose(table[column], again[column], rtol=0.0, atol=1e-9)
    assert set(table["drive"]) == {1, 2, 3, 4, 5, 6} and (table["high_95"] > table["low_95"]).all()
