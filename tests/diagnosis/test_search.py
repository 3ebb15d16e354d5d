"""The search against an enumeration of everything, the exact fit against known truth, and advice against brute
force.
"""

from dataclasses import dataclass, replace
from itertools import combinations, product
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import multivariate_normal

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.design import advise as advise_module
from rrru.diagnosis.design.advise import NOTHING, advise
from rrru.diagnosis.design.expected_information import realized_log_bayes_factors
from rrru.diagnosis.design.rival_answers import apart
from rrru.diagnosis.design.run_limits import StatedLimits
from rrru.diagnosis.evidence import averaged
from rrru.diagnosis.hypothesis import Hypothesis
from rrru.diagnosis.inference import InferenceResult, fit_hypothesis, infer
from rrru.diagnosis.model_fit import fit_model
from rrru.diagnosis.model_space import explore
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.settings import Prior
from rrru.diagnosis.state import ModelState
from rrru.diagnosis.terms import EffectTerm, spread, variants
from rrru.diagnosis.verdict import Group, decide
from rrru.diagnosis.whitened import DISCREPANCY_SCALES
from rrru.effects.protocol import Coordinates
from rrru.kinematics.dynamics import Masses
from rrru.parameters import ParameterSet
from tests.diagnosis.campaigns import (
    EFFECTS,
    FORWARD,
    FULL,
    MASSES,
    REVERSE,
    active,
    drawn,
    measure,
    plan_of,
    problem_of,
    strong,
)
from tests.diagnosis.every_term import every_term

FEW = ("leg_asymmetry", "servo_lag", "backlash")


def _library(*names):
    return {name: EFFECTS[name] for name in names}


def _score(evidence, terms):
    """Log evidence (levels,) averaged over all combinations of prior scales."""
    return averaged(evidence.over_strengths(terms)[0], evidence.log_scales(terms)) if terms else evidence.none


@pytest.mark.parametrize("acting", [(), ("servo_lag",), ("leg_asymmetry", "backlash")])
def test_the_search_finds_what_an_enumeration_of_all_sets_finds(acting):
    problem = problem_of(measure(tuple(strong(name, 4.0) for name in acting)), _library(*FEW))
    evidence = problem.evidence(problem.linearise(calibrate(problem)))
    found = explore(evidence, Prior()).hypotheses
    choices = {name: every_term(EFFECTS[name]) for name in FEW}
    for size in range(3):
        every = [terms for names in combinations(FEW, size) for terms in product(*(choices[name] for name in names))]
        best = max(_score(evidence, terms).max() for terms in every)
        reached = max(h.evidence.max() for h in found if len(h.terms) == size)
        assert reached == pytest.approx(best, abs=1e-6)
    assert len({frozenset(h.terms) for h in found}) == len(found)
    assert all(len(h.effects) == len(h.terms) for h in found)


@pytest.mark.parametrize("count", [2, 3])
def test_prior_scales_averaged_one_by_one_are_near_the_average_over_all_combinations(count):
    problem = problem_of(measure((strong("servo_lag", 6.0), strong("backlash", 3.0))), _library(*FEW))
    evidence = problem.evidence(problem.linearise(calibrate(problem)))
    terms = tuple(EffectTerm(name) for name in FEW[-count:])
    for level in (0, 2, 4):
        one_by_one, best = evidence.over_all_strengths(terms, level)
        together, grid = evidence.over_strengths(terms, None, [level])
        exact = averaged(together, evidence.log_scales(terms))[0]
        assert one_by_one == pytest.approx(exact, abs=0.7 if count > 2 else 1e-9)
        assert (best == grid[together[0].argmax()]).mean() > 0.6


def test_five_effects_at_once_are_all_found():
    names = ("leg_asymmetry", "servo_lag", "backlash", "thermal_growth", "encoder_eccentricity")
    problem = problem_of(measure(tuple(strong(name, 8.0) for name in names)), EFFECTS)
    found = infer(problem, Prior())
    assert found.hypothesis.effects == set(names)
    assert min(found.posterior.marginal(name) for name in names) > 0.99
    assert sum(p for (effects, flag), p in found.posterior.sets.items() if not flag and effects == set(names)) > 0.5


def test_every_effect_alone_is_always_weighed():
    problem = problem_of(measure())
    evidence = problem.evidence(problem.linearise(calibrate(problem)))
    single = {h.terms[0] for h in explore(evidence, Prior()).hypotheses if len(h.terms) == 1}
    assert single >= {term for effect in EFFECTS.values() for term in variants(effect)}


def _fitted(problem, start, *terms):
    """ModelFit of a hypothesis from a start."""
    evidence = problem.evidence(problem.linearise(calibrate(problem)))
    return fit_hypothesis(problem, evidence, (start,), (_hypothesis(*terms), 0))


def _hypothesis(*terms):
    """A hypothesis of strong terms."""
    return Hypothesis(terms, np.zeros(len(DISCREPANCY_SCALES)), np.full((len(DISCREPANCY_SCALES), len(terms)), 30.0))


@pytest.mark.parametrize("name", ["backlash", "servo_lag", "axis_tilt", "joint_clearance", "encoder_eccentricity"])
def test_the_exact_fit_finds_the_truth_without_noise(name):
    truth = 3.0 * drawn(name, 7)
    problem = problem_of(measure((active(name, truth),), 0.0), _library(name))
    start = calibrate(problem)
    fit = _fitted(problem, start, EffectTerm(name))
    state, (shapes, covariance) = fit.state, fit.effect_covariance(EffectTerm(name))
    before, after = np.abs(problem.residual(start)), np.abs(problem.residual(state))
    # in the mean the few points matter at which a hard contact has just changed sides
    assert np.median(after) < 0.03 * np.median(before) and covariance.shape == (len(truth) + len(shapes),) * 2
    # the motion read from the columns is not quite the one driven
    np.testing.assert_allclose(state.effects[name, 0], truth, atol=0.03 * np.abs(truth).max())


def test_the_exact_fit_finds_a_time_constant_between_those_tried():
    effect = EFFECTS["thermal_growth"]
    true = replace(active("thermal_growth", [8e-4]), values={"strain": 8e-4, "time_constant": 380.0})
    problem = problem_of(measure((true,)), {"thermal_growth": effect})
    shape = next(k for k, shape in enumerate(effect.coordinates.shapes) if shape["time_constant"] == 250.0)
    state = _fitted(problem, calibrate(problem), EffectTerm("thermal_growth", shape)).state
    assert state.shape_values["thermal_growth"]["time_constant"] == pytest.approx(380.0, rel=0.1)
    assert state.effects["thermal_growth", shape][0] == pytest.approx(8e-4, rel=0.05)


def test_an_exact_fit_from_another_fit_keeps_what_both_share():
    both = (strong("servo_lag", 4.0), strong("leg_asymmetry", 4.0))
    problem = problem_of(measure(both), _library("servo_lag", "leg_asymmetry"))
    one = _fitted(problem, calibrate(problem), EffectTerm("servo_lag")).state
    fit = _fitted(problem, one, EffectTerm("servo_lag"), EffectTerm("leg_asymmetry"))
    two, covariance = fit.state, fit.effect_covariance(EffectTerm("servo_lag"))[1]
    direct = _fitted(problem, calibrate(problem), EffectTerm("servo_lag"), EffectTerm("leg_asymmetry")).state
    error = np.sqrt(np.diag(covariance)[:3])
    assert (np.abs(two.effects["servo_lag", 0] - direct.effects["servo_lag", 0]) < error).all()
    left = np.sqrt((problem.residual(two) ** 2).mean())
    assert left == pytest.approx(problem.noise_mm, rel=0.1)


TWINS = frozenset({"drive_compliance", "own_weight"})


@dataclass(frozen=True)
class FakeCompliance:
    """A drive with the compliance of `drive_compliance`, but to the robot's own weight alone."""

    name: str = "own_weight"
    parameters: ParameterSet = EFFECTS["drive_compliance"].parameters
    coordinates: Coordinates = EFFECTS["drive_compliance"].coordinates
    needs: tuple = ("drive_load",)
    along_drives = with_waves = None
    switches = False

    def contribute(self, motion, values):
        """Changes (n, 3) of the drive angles."""
        share = 1.0 / (1.0 + np.nan_to_num(motion.payload_kg))[:, None]
        return motion.at_drives(np.asarray(values) * motion.drive_load * share)


@pytest.fixture(scope="module")
def twins():
    """InferenceResult, about the calibration alone, of a campaign without payloads between two effects that differ
    under payload only.
    """
    problem, calibrated = _twins()
    evidence = problem.evidence(problem.linearise(calibrated))
    posterior = explore(evidence, Prior())
    found = InferenceResult(
        problem, calibrated, calibrated, fit_model(problem, [calibrated]), evidence, posterior, *posterior.best()
    )
    verdict = decide(posterior, problem.library)
    return found, verdict, advise(found, verdict, MASSES).runs


def _twins():
    library = _library("drive_compliance", "servo_lag", "thermal_growth", "transmission_error") | {
        "own_weight": FakeCompliance()
    }
    problem = problem_of(measure((strong("drive_compliance", 6.0),), plan=plan_of((FORWARD, REVERSE))), library)
    return problem, calibrate(problem)


def test_what_no_run_separates_shares_the_probability(twins):
    found, verdict, _ = twins
    assert found.posterior.marginal("own_weight") == pytest.approx(
        found.posterior.marginal("drive_compliance"), rel=1e-2
    )
    assert verdict.probability < 0.6 and {*verdict.effects, *verdict.confounded_with} >= TWINS


def test_it_still_does_once_one_of_them_has_been_fitted():
    posterior = infer(_twins()[0], Prior()).posterior
    assert posterior.marginal("own_weight") == pytest.approx(posterior.marginal("drive_compliance"), rel=0.1)


def test_a_payload_is_advised_where_only_a_payload_decides(twins):
    _, _, table = twins
    assert (table["payload_kg"] > 0.0).all() and len(table) and (table["gain_nats"] > OPTIONS.decisive_gain_nats).all()
    assert table["now_nats"].iloc[0] < 0.01 * table["gain_nats"].iloc[0]
    assert table["run"].str.contains("5 kg payload").all()


def test_without_the_only_decisive_payload_nothing_decides_and_the_limit_is_said(twins):
    found, verdict, _ = twins
    none = advise(found, verdict, MASSES, StatedLimits(payload_kg=0.0))
    sides = [set(side.split("+")) for side in none.undecided.split(" / ")]
    assert sides[0] ^ sides[1] == TWINS and not none.runs["separates"].eq(none.undecided).any()
    assert none.limited == "runs are proposed within the limits payload_kg 0"
    light = advise(found, verdict, Masses(0.5, 0.1, 0.1))
    assert light.undecided == none.undecided and light.limited.startswith("no run with a payload is proposed, ")
    sure = advise(found, replace(verdict, sure=0.95), MASSES, StatedLimits(payload_kg=0.0))
    assert sure.undecided == ""


def test_runs_that_split_a_group_come_before_more_informative_ones_on_something_else(twins):
    found, verdict, _ = twins
    group = Group(tuple(sorted(TWINS)), 0.99)
    runs = advise(found, replace(verdict, effects=("drive_compliance",), groups=(group,)), MASSES).runs
    first = runs["separates"] == "drive_compliance / own_weight"
    assert first.iloc[0] and (runs.loc[first, "gain_nats"] > OPTIONS.decisive_gain_nats).all()


def _columns(library, linear, hypothesis):
    own = [linear.columns[t.effect, t.shape] @ spread(library[t.effect].coordinates, t.legs) for t in hypothesis.terms]
    return np.concatenate([linear.base, *own], axis=-1)


def test_the_best_runs_gain_is_what_appending_it_brings(twins):
    """The run is driven once more at the end of the campaign's table and both sums of squares are made anew by least
    squares.
    """
    found, _, table = twins
    best, problem = table.iloc[0], found.problem
    frame = problem.measurements
    first = frame[(frame["trajectory"] == best["trajectory"])]
    first = first[first["run"] == first["run"].iloc[0]]
    first = first.iloc[::-1].assign(time_s=lambda f: first["time_s"].max() - f["time_s"]) if best["reverse"] else first
    extra = first.assign(run=99, payload_kg=best["payload_kg"], speed_mm_s=best["speed_mm_s"])
    clock = (extra["time_s"] - extra["time_s"].iloc[0]) * first["speed_mm_s"].iloc[0] / best["speed_mm_s"]
    extra = extra.assign(time_s=clock + frame["time_s"].max() + 60.0)
    longer = problem_of(pd.concat([frame, extra], ignore_index=True), problem.library)
    tail = longer.run == 99
    pair = [found.posterior.best_of(frozenset(side.split("+"))) for side in best["separates"].split(" / ")]
    assert set.union(*apart(best["separates"])) >= TWINS
    # the answer with more effects makes the data
    truth, rival = sorted(pair, key=lambda one: -len(one[0].terms))
    keys = [(term.effect, term.shape) for term in (*truth[0].terms, *rival[0].terms)]
    new = longer.linearise(found.calibrated, keys)
    mean, covariance = found.evidence.coefficients(truth[0].terms, truth[0].prior_scales[truth[1]], truth[1])
    size = _columns(problem.library, new, truth[0]).shape[-1] - 7
    mean, covariance = mean[:size], covariance[:size, :size]
    prior = found.evidence.scales(rival[0].terms, rival[0].prior_scales[rival[1]])
    costs = []
    for rows in (np.zeros(len(tail), dtype=bool), tail):
        made, design = (
            np.concatenate(
                [
                    columns.reshape(-1, columns.shape[-1])
                    for columns in (
                        _columns(problem.library, found.evidence.linear, answer),
                        _columns(problem.library, new, answer)[rows],
                    )
                ]
            )
            / problem.noise_mm
            for answer in (truth[0], rival[0])
        )
        penalty = np.concatenate([np.zeros((len(prior), 7)), np.diag(1.0 / prior)], axis=1)
        matrix, target = np.concatenate([design, penalty]), np.concatenate([made[:, 7:], np.zeros((len(prior), size))])
        matrix = matrix / np.linalg.norm(matrix, axis=0)
        left = target - matrix @ np.linalg.lstsq(matrix, target, rcond=None)[0]
        # the mean of a quadratic form
        quadratic = left.T @ left
        costs.append(0.5 * (mean @ quadratic @ mean + np.trace(quadratic @ covariance)))
    assert best["now_nats"] == pytest.approx(costs[0], rel=1e-3)
    assert best["gain_nats"] == pytest.approx(costs[1] - costs[0], rel=0.02)


def test_nothing_is_advised_where_nothing_rivals():
    found = infer(
        problem_of(
            measure((strong("frame_misregistration", 10.0),), plan=plan_of(FULL)), _library("frame_misregistration")
        ),
        Prior(),
    )
    verdict = decide(found.posterior, found.problem.effects)
    assert verdict.label == "frame_misregistration"
    assert advise(found, replace(verdict, rivals=()), MASSES) is NOTHING
    assert isinstance(found.state, ModelState) and found.dropped == 0


def test_what_a_run_adds_is_the_ratio_of_the_predictive_densities_of_its_readings(twins):
    """Against normal densities of the readings of a run, by a dense fit of the other runs."""
    found, verdict, _ = twins
    names = frozenset(verdict.effects)
    answers = found.posterior.best_of(names), found.posterior.best_of(TWINS - names)
    problem = found.problem
    added = realized_log_bayes_factors(found, answers)
    assert set(added) == set(problem.run.tolist())
    run = problem.run[-1]
    here, logs = problem.run == run, []
    keys = [(term.effect, term.shape) for hypothesis, _ in answers for term in hypothesis.terms]
    linear = problem.linearise(found.state, keys)
    for hypothesis, level in answers:
        design = _columns(problem.library, linear, hypothesis) / problem.noise_mm
        sd = found.evidence.scales(hypothesis.terms, hypothesis.prior_scales[level])
        unit = np.concatenate([np.linalg.norm(design[~here][..., :7], axis=(0, 1)) ** -1.0, sd])
        penalty = np.diag(np.concatenate([np.zeros(7), np.ones(len(sd))]))
        old, new = ((design[rows] * unit).reshape(3 * rows.sum(), -1) for rows in (~here, here))
        known, data = (linear.data[rows].ravel() / problem.noise_mm for rows in (~here, here))
        covariance = np.linalg.inv(old.T @ old + penalty)
        spread_of = np.eye(len(new)) + new @ covariance @ new.T
        logs.append(multivariate_normal(new @ covariance @ old.T @ known, spread_of).logpdf(data))
    assert added[run] == pytest.approx(logs[0] - logs[1], abs=1e-3)


class _Pair:
    """One pair of answers, whose gains are those of the candidates."""

    first, pairs = 0, ((SimpleNamespace(answer="a"), SimpleNamespace(answer="b")),)

    @staticmethod
    def by_pair(gains):
        return gains


# of 6 nats expected one run is off by sqrt(12) nats, of 30 nats five runs by sqrt(60)
@pytest.mark.parametrize(
    ("added", "share"),
    [
        ([0.15], (0.15 + np.sqrt(12.0)) / 6.0),
        ([-0.15], (0.15 + np.sqrt(12.0)) / 6.0),
        ([7.0], 1.0),
        ([-7.0], 1.0),
        ([0.5, -0.5, 0.1, -0.1, 0.0], np.sqrt(60.0) / 30.0),
        ([6.0, 6.0, 6.0, 6.0, 0.0], 1.0),
    ],
)
def test_runs_that_did_not_decide_are_expected_to_add_less(added, share, monkeypatch):
    """Runs along line_1 once more were each expected to add 6 nats."""
    again = range(3, 3 + len(added))
    names = ["line_1", "line_2", *["line_1"] * len(added)]
    frame = pd.DataFrame({"run": np.repeat([1, 2, *again], 10), "trajectory": np.repeat(names, 10)})
    inference = SimpleNamespace(problem=SimpleNamespace(measurements=frame, used=np.ones(len(frame), dtype=bool)))
    rows = [
        ("line_1 once more", 6.0, 6.0),
        ("line_1 with 5 kg payload", 9.0, 6.0),
        ("line_2 once more", 5.0, 5.0),
        ("10 poses", 8.0, 8.0),
    ]

    def listed(unit):
        return [
            advise_module.Candidate(
                {"run": name, "trajectory": name.split(" ")[0], "points": 10},
                _Pair,
                np.array([unit * gain]),
                np.array([unit * plain]),
            )
            for name, gain, plain in rows
        ]

    found = {1: 0.0, 2: 0.0} | dict(zip(again, added, strict=True))
    monkeypatch.setattr(advise_module, "realized_log_bayes_factors", lambda *_: found)
    known = advise_module.realized_share(inference, listed(1.0))
    assert known == pytest.approx(share)
    left = [float(one.as_realized(known).gains[0]) for one in listed(1.0)]
    np.testing.assert_allclose(left, [6.0 * share, 3.0 + 6.0 * share, 5.0 * share, 8.0 * share])
    # of runs that were expected to add little nothing follows
    assert advise_module.realized_share(inference, listed(0.08)) == 1.0
