"""Other ways to find a cause, and what the answers of all are worth."""

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd
import pytest
from scipy.linalg import null_space
from scipy.stats import multivariate_normal

from rrru.diagnosis.diagnose import MeasuredRobot
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.terms import EffectTerm
from rrru.studies.blind_validation import rivals
from rrru.studies.blind_validation.chunks import chunks, rivalled
from rrru.studies.blind_validation.rivals import beliefs
from rrru.studies.blind_validation.summary import compare_methods
from rrru.studies.blind_validation.verdicts import in_order
from tests.schemas import check
from tests.studies.blind_validation.conditions import CONDITIONS, acting, bare, section

_SETTINGS = GapSettings(("backlash", "axis_tilt", "thermal_growth"), draws=20)


def _known(name="robot"):
    return MeasuredRobot(CONDITIONS.mechanism, CONDITIONS.masses, CONDITIONS.noise_mm, name)


@pytest.fixture(scope="module")
def faulty():
    """A robot with backlash of six times the noise, and its measurements."""
    robot = bare(7)
    robot = replace(robot, acting=(acting(robot, "backlash", span=(6.0, 6.001), seed=3),))
    return robot, robot.measured(CONDITIONS)


@pytest.fixture(scope="module")
def campaign(faulty):
    return rivals.Campaign.of(faulty[1], _known(), _SETTINGS.library(CONDITIONS.mechanism))


def _said(campaign, effects, size=8.0):
    """The campaign whose data are noise of unit variance and what effects do, of that rms."""
    generator = np.random.default_rng(1)
    data = generator.standard_normal(len(campaign.data)) + campaign.base @ generator.standard_normal(7)
    for name in effects:
        columns = campaign.columns[EffectTerm(name)]
        typical = campaign.problem.library[name].coordinates.typical
        part = columns @ (typical * generator.uniform(1.0, 2.0, len(typical)))
        data = data + size * part / np.sqrt((part**2).mean())
    return replace(campaign, data=data)


def test_bic_is_that_of_least_squares(campaign):
    """Weights from residuals of explicit fits, for what every set reaches at its best."""
    made = _said(campaign, ["axis_tilt"], 0.5)
    n, p = made.base.shape

    def bic(terms):
        columns = np.concatenate([made.base, *(made.columns[term] for term in terms)], axis=1)
        size = np.linalg.norm(columns, axis=0)
        fitted, _, rank, _ = np.linalg.lstsq(columns / size, made.data, rcond=1e-9)
        return ((made.data - columns / size @ fitted) ** 2).sum() + (rank - p) * np.log(n)

    found = rivals.bayes_information(made)
    none = bic([])
    for name in _SETTINGS.effects:
        best = min(bic([term]) for term in made.columns if term.effect == name)
        np.testing.assert_allclose(np.log(found[name] / found["none"]), 0.5 * (none - best), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(sum(found.values()), 1.0)
    assert len(found) == 1 + 3 + 3 and max(found, key=found.get).startswith("axis_tilt")


@pytest.mark.parametrize("effects", [[], ["axis_tilt"], ["backlash"]])
def test_the_lasso_keeps_what_acts(campaign, effects):
    found = rivals.lasso(_said(campaign, effects), np.random.default_rng(2))
    np.testing.assert_allclose(sum(found.values()), 1.0)
    holding = sum(p for names, p in found.items() if set(effects) <= set(names.split("+")))
    assert holding > 0.9
    if not effects:
        assert max(found, key=found.get) == "none"


def test_the_spike_and_slab_is_the_sum_over_all_states(campaign, monkeypatch):
    """Of three effects in one shape on all legs with two sizes of their coefficients, by explicit covariances."""
    slabs = np.array([2.0, 8.0])
    monkeypatch.setattr(rivals, "_SLABS", slabs)
    few = replace(campaign, columns={term: campaign.columns[term] for term in map(EffectTerm, _SETTINGS.effects)})
    made = _said(few, ["axis_tilt"], 0.12)
    left = null_space(made.base.T).T
    weights = {}
    for sizes in product((0.0, *slabs), repeat=3):
        covariance = np.eye(len(left))
        for size, columns in zip(sizes, made.columns.values(), strict=True):
            part = left @ columns
            covariance += size**2 * (part / np.linalg.norm(part, axis=0)) @ (part / np.linalg.norm(part, axis=0)).T
        log = multivariate_normal(np.zeros(len(left)), covariance).logpdf(left @ made.data)
        acting = np.array(sizes) > 0.0
        log += np.where(acting, np.log(0.1 / 2), np.log(0.9)).sum()
        name = in_order("+".join(np.array(_SETTINGS.effects)[acting])) or "none"
        weights[name] = np.logaddexp(weights.get(name, -np.inf), log)
    total = np.logaddexp.reduce(list(weights.values()))
    found = rivals.spike_and_slab(made, np.random.default_rng(4))
    for name, log in weights.items():
        assert found.get(name, 0.0) == pytest.approx(np.exp(log - total), abs=0.06), (found, name)


def test_a_gaussian_process_predicts_what_is_smooth_and_not_what_is_not(campaign):
    position = campaign.problem.motion.position_mm[campaign.problem.at]
    smooth = 20.0 * np.sin(position[:, [2, 0, 1]] / 120.0)
    generator = np.random.default_rng(5)
    noise = generator.standard_normal(smooth.shape)
    assert rivals.gaussian_process(replace(campaign, data=(smooth + noise).ravel())) > 0.5
    assert rivals.gaussian_process(replace(campaign, data=10.0 * generator.standard_normal(smooth.size))) < 0.1


def test_all_ways_find_a_strong_cause(faulty):
    table = check("withheld_beliefs", beliefs(faulty[1], _known("faulty"), _SETTINGS)).set_index("method")
    assert list(table.index) == ["diagnosis", "bic", "lasso", "spike_and_slab", "gaussian_process"]
    for method in ("diagnosis", "bic", "lasso", "spike_and_slab"):
        probabilities = json.loads(table.loc[method, "probabilities"])
        np.testing.assert_allclose(sum(probabilities.values()), 1.0, atol=1e-9)
        assert "backlash" in table.loc[method, "effects"]
    assert table.loc["diagnosis", "effects"] == "backlash" and table.loc["diagnosis", "share_closed"] > 0.8
    assert table.loc["gaussian_process", "effects"] == "" and table.loc["gaussian_process", "share_closed"] < 0.8
    assert (table["seconds"] > 0.0).all()


def _row(method, robot, effects, probabilities, share=np.nan, seconds=1.0):
    said = {"effects": effects, "probabilities": json.dumps(probabilities) if probabilities else ""}
    return {"method": method, "robot": robot, **said, "share_closed": share, "seconds": seconds}


def test_answers_are_scored_against_the_truth():
    answers = pd.DataFrame(
        {
            "robot": ["a", "b", "c"],
            "truth": ["backlash", "outside:rehoming", "axis_tilt+backlash"],
            "strength": [2.0, 3.0, 1.0],
        }
    )
    said = [
        _row("diagnosis", "a", "backlash", {"backlash": 0.8, "none": 0.2}, 0.9, 1.0),
        _row("diagnosis", "b", "backlash+unexplained", {"unexplained": 0.6, "none": 0.4}, 0.5, 2.0),
        _row("diagnosis", "c", "backlash", {"backlash": 1.0}, 0.1, 3.0),
        _row("gaussian_process", "a", "", {}, 0.4),
    ]
    table = check("withheld_methods", compare_methods(pd.DataFrame(said), answers)).set_index("method")
    own = table.loc["diagnosis"]
    assert own["robots"] == 3 and own["seconds"] == 2.0
    np.testing.assert_allclose(own["right"], 2.0 / 3.0)
    np.testing.assert_allclose(own["probability_true"], (0.8 + 0.6 + 0.0) / 3.0)
    # Brier's sum over all sets, the true one among them
    np.testing.assert_allclose(own["brier"], ((0.2**2 + 0.2**2) + (0.4**2 + 0.4**2) + (1.0 + 1.0)) / 3.0)
    np.testing.assert_allclose(own["log_score"], (np.log(0.8) + np.log(0.6) + np.log(1e-3)) / 3.0)
    np.testing.assert_allclose(own["share_closed"], 0.7)
    process = table.loc["gaussian_process"]
    assert process[["right", "right_low", "probability_true", "brier", "log_score"]].isna().all()
    assert process["share_closed"] == 0.4


def test_other_ways_are_tried_on_the_first_robots_of_the_label_check():
    asked = section(robots=7, per_effect=1, effects=["backlash"], methods=5)
    found = rivalled(asked)
    assert set(found) <= set(chunks(asked))
    assert [name for names in found.values() for name in names] == [f"label_{k:04d}" for k in range(5)]
