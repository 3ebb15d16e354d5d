"""What prediction rules out of a verdict, and where the answer then comes from."""

from types import SimpleNamespace

import numpy as np
import pytest

from rrru.diagnosis import diagnose
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.evidence import ModelEvidence
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.model_fit import fit_model
from rrru.diagnosis.model_space import explore
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.settings import Prior
from rrru.diagnosis.state import LinearizedProblem
from rrru.effects.protocol import Coordinates
from rrru.estimation.noise_model import NoiseModel
from tests.diagnosis.campaigns import EFFECTS, measure, problem_of, strong

NOISE_MM, PRIOR = 0.05, Prior()


def _effect(name, count):
    none = np.zeros(count, dtype=int)
    return SimpleNamespace(name=name, coordinates=Coordinates(np.ones(count), none, none > 0, None))


LIBRARY = {name: _effect(name, count) for name, count in {"whole": 2, "first": 1, "second": 1, "idle": 2}.items()}


def _found(off, whole=True):
    """Evidence and posterior of data of one effect, which two others together explain except for a share `off`."""
    generator, shape = np.random.default_rng(1), (40, 3)
    own, more = generator.normal(size=(*shape, 2)), off * generator.normal(size=(*shape, 2))
    columns = {("first", 0): own[..., :1] + more[..., :1], ("second", 0): own[..., 1:] + more[..., 1:]}
    columns["idle", 0] = generator.normal(size=(*shape, 2))
    library = {name: effect for name, effect in LIBRARY.items() if whole or name != "whole"}
    columns = {("whole", 0): own} | columns if whole else columns
    data = own @ [1.0, -0.8] + NOISE_MM * generator.standard_normal(shape)
    linear = LinearizedProblem(data, generator.normal(size=(*shape, 3)), columns, {}, {}, None)
    evidence = ModelEvidence(library, linear, np.ones(40, dtype=int), NoiseModel.white(NOISE_MM), smooth=False)
    return SimpleNamespace(evidence=evidence, posterior=explore(evidence, PRIOR))


def test_where_every_likely_set_holds_it_others_are_looked_for():
    found = _found(0.3)
    likely = [names for (names, _), p in found.posterior.sets.items() if p > 1e-9]
    assert likely and all("whole" in names for names in likely)
    pair = frozenset({"first", "second"})
    assert found.posterior.best_of(pair) is None
    rest = diagnose._without(found, {"whole"}, {"whole"}, PRIOR)
    assert rest.best()[0].effects == pair and rest.marginal("whole") == 0.0
    # as if it had never been in the library
    fresh, level = _found(0.3, whole=False).posterior.best_of(pair)
    np.testing.assert_allclose(rest.best()[0].evidence[level], fresh.evidence[level], rtol=1e-9)


def test_where_a_likely_set_does_without_it_nothing_is_searched(monkeypatch):
    found = _found(0.02)
    posterior = found.posterior
    remaining = posterior.without("whole")
    assert remaining.height > posterior.height - OPTIONS.negligible_nats and remaining.best()[0].effects == {
        "first",
        "second",
    }
    monkeypatch.setattr(diagnose, "explore", lambda *_, **__: pytest.fail("searched"))
    rest = diagnose._without(found, {"whole"}, {"whole"}, PRIOR)
    assert rest.best() == remaining.best() and rest.marginal("whole") == 0.0
    assert rest.weights.sum() == pytest.approx(1.0)


def test_what_was_ruled_out_before_does_not_come_back():
    """All that was ruled out stays so when a later veto makes the search begin again."""
    found = _found(0.3)
    found.posterior = diagnose._without(found, {"whole"}, {"whole"}, PRIOR)
    rest = diagnose._without(found, {"whole", "first"}, {"first"}, PRIOR)
    assert rest.marginal("whole") == 0.0 and rest.marginal("first") == 0.0
    assert rest.best()[0].effects <= {"second", "idle"}
    nothing = diagnose._without(found, set(LIBRARY), {"first", "second", "idle"}, PRIOR)
    assert {h.effects for h in nothing.hypotheses} == {frozenset()}


@pytest.fixture(scope="module")
def inference():
    """InferenceResult, about the calibration alone, of a campaign in which two effects act for certain."""
    names = ("servo_lag", "leg_asymmetry", "backlash")
    problem = problem_of(
        measure((strong("servo_lag", 8.0), strong("leg_asymmetry", 8.0))), {n: EFFECTS[n] for n in names}
    )
    calibrated = calibrate(problem)
    evidence = problem.evidence(problem.linearise(calibrated))
    decisive = evidence.on_library()
    posterior = explore(decisive, PRIOR)
    return InferenceResult(
        problem, calibrated, calibrated, fit_model(problem, [calibrated]), evidence, posterior, *posterior.best()
    )


def test_a_verdict_is_decided_anew_until_prediction_agrees(inference, monkeypatch):
    """Gains made up: one effect spoils what is predicted wherever it is named."""
    asked, gains = [], diagnose._gains

    def spoilt(fitted):
        asked.append(fitted.hypothesis.effects)
        return gains(fitted) | {name: -50.0 for name in asked[-1] if name == "servo_lag"}

    assert set(diagnose._decide(inference, PRIOR)[0].effects) == {"servo_lag", "leg_asymmetry"}
    monkeypatch.setattr(diagnose, "_gains", spoilt)
    verdict, fitted, ordered = diagnose._decide(inference, PRIOR)
    assert "servo_lag" in asked[0] and all("servo_lag" not in names for names in asked[1:]) and len(asked) > 1
    assert "servo_lag" not in verdict.effects and "servo_lag" not in verdict.confounded_with
    assert fitted.posterior.marginal("servo_lag") == 0.0
    assert {term.effect for term, _ in ordered} == fitted.hypothesis.effects == set(verdict.effects)


def test_where_every_effect_is_vetoed_nothing_of_the_library_is_named(inference, monkeypatch):
    monkeypatch.setattr(diagnose, "_gains", lambda fitted: dict.fromkeys(fitted.hypothesis.effects, -50.0))
    verdict, fitted, _ = diagnose._decide(inference, PRIOR)
    assert verdict.effects == () and verdict.label in ("none", "unexplained")
    assert fitted.hypothesis.effects == frozenset()
