"""Predictions of left-out points, how far the gap shrinks, and the measuring noise, against slow and obvious
computations.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.fft import dct
from scipy.stats import multivariate_normal, norm

from rrru.calibration.calibrate import calibrate as calibrate_positions
from rrru.calibration.campaign_noise import campaign_noise
from rrru.campaign import measurements as rows
from rrru.campaign.outliers import isolated
from rrru.diagnosis import shrink
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.heldout import HeldOut, Prediction, resampled_groups, resampled_quantiles, resampled_rows
from rrru.diagnosis.inference import with_noise
from rrru.diagnosis.terms import EffectTerm, signatures
from rrru.diagnosis.whitened import DISCREPANCY_SCALES
from rrru.effects.library import find
from rrru.errors import ConfigError
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.studies.real import length_tables
from tests.diagnosis import arms
from tests.diagnosis.campaigns import (
    EFFECTS,
    FORWARD,
    FULL,
    LINES,
    MODEL,
    NOISE_MM,
    SPIRAL,
    diagnosed,
    measure,
    plan_of,
    problem_of,
    strong,
)

TERMS = (EffectTerm("servo_lag", 0, 2), EffectTerm("leg_asymmetry"))
PRIOR_SCALES = [1.0, 3.0]


def _setting(passes, effects=()):
    problem = problem_of(
        measure(effects, plan=plan_of(passes)), {name: EFFECTS[name] for name in ("servo_lag", "leg_asymmetry")}
    )
    return HeldOut(problem, problem.evidence(problem.linearise(calibrate(problem))))


@pytest.fixture(scope="module")
def full():
    return _setting(FULL, (strong("leg_asymmetry", 3.0),))


def _refitted(held_out, level, smooth):
    """Residuals and covariances of predictions of each fold by a dense fit of all others."""
    problem, evidence, fold = held_out.problem, held_out.evidence, held_out.fold
    linear, n = evidence.linear, len(problem)
    columns = np.concatenate(
        [linear.base, linear.columns["servo_lag", 0][..., 1:2], linear.columns["leg_asymmetry", 0]], axis=-1
    )
    prior = np.concatenate([np.zeros(7), evidence.scales(TERMS, PRIOR_SCALES) ** -2.0])
    weight = np.eye(n) / (problem.noise_mm**2 * (1.0 + DISCREPANCY_SCALES[level] ** 2))
    if smooth:
        transform, wave = np.zeros((n, n)), np.zeros(n)
        for run in np.unique(problem.run):
            rows = np.flatnonzero(problem.run == run)
            transform[np.ix_(rows, rows)], wave[rows] = (
                dct(np.eye(len(rows)), axis=0, norm="ortho"),
                np.arange(len(rows)),
            )
        density = 1.0 / (1.0 + (wave / 3.0) ** 2) + 0.01
        weight = (
            transform.T
            @ np.diag(1.0 / (problem.noise_mm**2 * (1.0 + DISCREPANCY_SCALES[level] ** 2 * density / density.mean())))
            @ transform
        )
    residual, uncertain = np.empty((n, 3)), np.empty(n)
    for number in np.unique(fold):
        out, fitted = fold == number, fold != number
        inner = weight[np.ix_(fitted, fitted)]
        precision = np.diag(prior) + sum(columns[fitted, axis].T @ inner @ columns[fitted, axis] for axis in range(3))
        moment = sum(columns[fitted, axis].T @ inner @ linear.data[fitted, axis] for axis in range(3))
        covariance = np.linalg.inv(precision)
        residual[out] = linear.data[out] - columns[out] @ covariance @ moment
        uncertain[out] = np.einsum("nak,kl,nal->n", columns[out], covariance, columns[out])
    return residual, uncertain


@pytest.mark.parametrize("level", [0, 3])
@pytest.mark.parametrize("passes", [(FORWARD,), FULL], ids=["stretches", "runs"])
def test_predictions_equal_a_refit_without_the_fold(passes, level):
    held_out = _setting(passes)
    found = held_out.predict(TERMS, PRIOR_SCALES, level)
    residual, uncertain = _refitted(held_out, level, smooth=passes is FULL)
    np.testing.assert_allclose(found.residual_mm, residual, atol=2e-6)
    np.testing.assert_allclose(found.uncertainty_mm2, uncertain, rtol=1e-4)


def test_a_function_that_follows_random_errors_is_misleading_and_an_effect_that_acts_is_not(full):
    """Errors of ten times the noise, next to which a wide function of a drive passes through the readings."""
    assert full.misleading(TERMS, PRIOR_SCALES, 0) is None
    frame = measure(plan=plan_of((FORWARD,)))
    wild = rows.measured(frame) + np.random.default_rng(2).normal(0.0, 10.0 * NOISE_MM, (len(frame), 3))
    frame = frame.assign(**rows.vector_columns("measured", wild))
    names = ("servo_lag", "drive_error_function")
    problem = problem_of(frame, {name: find(name, MODEL) for name in names})
    held_out = HeldOut(problem, problem.evidence(problem.linearise(calibrate(problem))))
    terms, scales = (EffectTerm("servo_lag", 0, 2), EffectTerm("drive_error_function", 0, 1)), [1.0, 30.0]
    assert held_out.misleading(terms, scales, 0) == terms[1]
    assert held_out.misleading(terms[:1], scales[:1], 0) is None and held_out.misleading((), [], 0) is None
    # by least squares of the other folds
    linear, squares = held_out.evidence.linear, {}
    for name, used in (("alone", ()), ("both", terms)):
        columns = np.concatenate([linear.base, *signatures(problem.library, linear, used)], axis=-1) / problem.noise_mm
        prior = np.zeros(columns.shape[-1])
        prior[linear.base.shape[-1] :] = 1.0 / held_out.evidence.scales(used, scales[: len(used)])
        left = []
        for number in np.unique(held_out.fold):
            out = held_out.fold == number
            design = np.concatenate([columns[~out].reshape(-1, len(prior)), np.diag(prior)])
            data = np.concatenate([linear.data[~out].ravel() / problem.noise_mm, np.zeros(len(prior))])
            unit = np.linalg.norm(design, axis=0)
            found = np.linalg.lstsq(design / unit, data, rcond=None)[0] / unit
            left.append(linear.data[out] - problem.noise_mm * columns[out] @ found)
        squares[name] = (np.concatenate(left) ** 2).mean()
    assert squares["both"] > 1.1 * squares["alone"]


@pytest.mark.parametrize("level", [0, 3])
def test_the_spread_at_a_new_stop_is_that_of_a_refit_without_it(level):
    held_out = _setting((FORWARD,))
    found = (held_out.spread_at_new_stops(TERMS, PRIOR_SCALES, level) ** 2).sum(axis=(1, 2))
    alone = SimpleNamespace(problem=held_out.problem, evidence=held_out.evidence, fold=held_out.problem.stop)
    _, uncertain = _refitted(alone, level, smooth=False)
    np.testing.assert_allclose(found, uncertain, rtol=1e-4)
    # fits of four fifths are less certain
    assert found.mean() < held_out.predict(TERMS, PRIOR_SCALES, level).uncertainty_mm2.mean()


@pytest.mark.parametrize("level", [0, 3])
def test_what_an_effect_gains_is_what_its_prediction_alone_loses(full, level):
    whole = full.predict(TERMS, PRIOR_SCALES, level).log_score.sum()
    without = [full.predict(TERMS[1 - k : 2 - k], PRIOR_SCALES[1 - k : 2 - k], level).log_score.sum() for k in range(2)]
    np.testing.assert_allclose(full.gains(TERMS, PRIOR_SCALES, level), whole - np.array(without), rtol=1e-5, atol=1e-5)
    assert full.gains((), [], level) == []


def test_folds_are_runs_where_every_trajectory_was_driven_twice_else_stretches(full):
    assert [len(np.unique(full.problem.run[full.fold == k])) for k in np.unique(full.fold)] == [1] * 16
    once = _setting((FORWARD, FORWARD | {"reverse": True, "trajectories": ["line_1"]}))
    assert np.unique(once.fold).tolist() == [0, 1, 2, 3, 4]
    for run in np.unique(once.problem.run):
        own = once.fold[once.problem.run == run]
        assert [len(piece) for piece in np.split(own, np.flatnonzero(np.diff(own)) + 1)][:-1] == [5] * (
            (len(own) - 1) // 5
        )


def test_a_payload_of_one_run_alone_is_not_left_out_with_it():
    spiral = FORWARD | {"trajectories": ["spiral"]}
    twice = _setting((spiral, spiral | {"reverse": True}))
    assert np.unique(twice.fold).tolist() == [0, 1]
    loaded = _setting((spiral, spiral | {"payload_kg": 5.0}))
    assert np.unique(loaded.fold).tolist() == [0, 1, 2, 3, 4]
    for number in range(5):
        assert set(loaded.problem.points["payload_kg"][loaded.fold != number]) == {0.0, 5.0}


def test_errors_of_predictions_by_a_true_effect_are_noise_and_their_own_uncertainty(full):
    found = full.predict((EffectTerm("leg_asymmetry"),), [3.0], 0)
    expected = 3.0 * NOISE_MM**2 + found.uncertainty_mm2
    ratio = ((found.residual_mm**2).sum(axis=1) / expected).mean()
    assert ratio == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / (3.0 * len(full.problem))))


def test_the_share_of_an_effect_has_half_of_what_it_shares_with_another_one():
    """Against the parts that were simulated: the mean product of each with the whole gap."""
    effects = strong("drive_compliance", 8.0), strong("link_flexure", 12.0)
    found = diagnosed(measure(effects), NOISE_MM).inference
    terms, level = found.hypothesis.terms, found.level
    shares = found.held_out.shares(terms, found.hypothesis.prior_scales[level], level)
    parts = {one.effect.name: _left_by_calibration((one,)) for one in effects}
    gap = _left_by_calibration(effects)
    assert set(shares) == set(parts)
    for name, part in parts.items():
        assert shares[name] == pytest.approx((part * gap).sum() / (gap**2).sum(), abs=0.06)
    assert sum(shares.values()) == pytest.approx(1.0, abs=0.02)


def _left_by_calibration(effects):
    """Residuals (n, 3) of a calibration of a robot with these effects, by the exact closure without noise."""
    frame = measure(effects, noise_mm=0.0)
    driven = rows.actuators(frame, MODEL), rows.measured(frame), rows.command(frame)
    return calibrate_positions(TargetPositions(MODEL, *driven)).residual_mm


def test_shares_are_of_parts_that_a_refit_without_the_fold_predicts():
    held_out = _setting((FORWARD,), (strong("leg_asymmetry", 3.0),))
    linear, scales = held_out.evidence.linear, held_out.evidence.scales(TERMS, PRIOR_SCALES)
    blocks = [linear.base, linear.columns["servo_lag", 0][..., 1:2], linear.columns["leg_asymmetry", 0]]
    columns, ends = np.concatenate(blocks, axis=-1), np.cumsum([block.shape[-1] for block in blocks])
    prior = np.diag(np.concatenate([np.zeros(ends[0]), NOISE_MM / scales]))
    parts = np.zeros((2, *linear.data.shape))
    for number in np.unique(held_out.fold):
        out = held_out.fold == number
        design = np.concatenate([columns[~out].reshape(-1, ends[-1]), prior])
        size = np.linalg.norm(design, axis=0)
        data = np.append(linear.data[~out].ravel(), np.zeros(len(prior)))
        fitted = np.linalg.lstsq(design / size, data, rcond=None)[0] / size
        for k in range(2):
            parts[k, out] = columns[out][..., ends[k] : ends[k + 1]] @ fitted[ends[k] : ends[k + 1]]

    def left(values):
        design = linear.base.reshape(values.size, -1)
        size = np.linalg.norm(design, axis=0)
        return values.ravel() - design / size @ np.linalg.lstsq(design / size, values.ravel(), rcond=None)[0]

    gap = left(linear.data)
    total = gap @ gap - NOISE_MM**2 * (gap.size - ends[0])
    shares = held_out.shares(TERMS, PRIOR_SCALES, 0)
    assert list(shares) == ["servo_lag", "leg_asymmetry"] and shares["leg_asymmetry"] > 0.9
    np.testing.assert_allclose(list(shares.values()), [left(part) @ gap / total for part in parts], atol=1e-6)


def test_without_a_gap_beyond_the_noise_there_are_no_shares():
    problem = problem_of(measure(noise_mm=0.5 * NOISE_MM), {"servo_lag": EFFECTS["servo_lag"]})
    held_out = HeldOut(problem, problem.evidence(problem.linearise(calibrate(problem))))
    assert held_out.shares(TERMS[:1], PRIOR_SCALES[:1], 0) == {"servo_lag": 0.0}


def test_shares_do_not_count_readings_at_which_an_effect_lacks_what_it_needs(full):
    """A third of the readings have no column of the effect: shares are those of the other two thirds alone."""
    problem, term = full.problem, TERMS[1:]
    known = {"leg_asymmetry": np.arange(len(problem)) % 48 < 32}
    linear = full.evidence.linear
    columns = linear.columns["leg_asymmetry", 0] * known["leg_asymmetry"][:, None, None]
    linear = replace(linear, columns=linear.columns | {("leg_asymmetry", 0): columns})
    problem = replace(problem, known=known)
    found = HeldOut(problem, problem.evidence(linear)).shares(term, [3.0], 0)
    assert found["leg_asymmetry"] == pytest.approx(full.shares(term, [3.0], 0)["leg_asymmetry"], abs=0.03)


def _of_jumps(drive):
    """Held-out predictions of an arm at drive values (n, 6) whose drives have functions that jump, and their term."""
    frame = arms.commands(drive)
    shaken = rows.command(frame) + 0.1 * np.random.default_rng(4).standard_normal((len(drive), 3))
    problem = arms.problem_of(frame.assign(**rows.vector_columns("measured", shaken)), "drive_error_function")
    jumping = replace(problem.library["drive_error_function"], steps=0.6)
    problem = replace(problem, library={jumping.name: jumping})
    return HeldOut(problem, problem.evidence(problem.linearise(calibrate(problem)))), (EffectTerm(jumping.name),)


def test_errors_by_drawn_jumps_have_the_mean_of_all_places_of_the_jump():
    held_out, terms = _of_jumps(arms.drives(40, np.random.default_rng(2)))
    mean = held_out.jumps_mm2(terms, [1.0], 0)
    drawn = held_out.drawn_jumps_mm2(terms, [1.0], 0, (np.random.default_rng(3), 4000))
    error = drawn.std(axis=0) / np.sqrt(len(drawn))
    assert mean.min() > 0.0 and (np.abs(drawn.mean(axis=0) - mean) < 4.0 * error).all()
    # each drive jumps with this probability, or not at all
    assert (drawn == 0.0).all(axis=1).mean() == pytest.approx(0.4**arms.DRIVES, abs=0.004)


def test_a_drive_that_stands_still_has_no_jumps():
    drive = arms.drives(40, np.random.default_rng(2))
    drive[:, 1] = 0.2
    held_out, terms = _of_jumps(drive)
    found = held_out.jumps_mm2(terms, [1.0], 0)
    unmoved = held_out.evidence.linear.drive * (np.arange(arms.DRIVES) != 1)
    evidence = replace(held_out.evidence, linear=replace(held_out.evidence.linear, drive=unmoved))
    assert found.min() > 0.0
    np.testing.assert_array_equal(found, HeldOut(held_out.problem, evidence).jumps_mm2(terms, [1.0], 0))


def _of_runs(run):
    """What is asked of a problem whose points were driven in runs (n,)."""
    return SimpleNamespace(run=run, stop=np.arange(len(run)))


def test_rows_are_resampled_by_runs_or_by_stretches():
    generator = np.random.default_rng(0)
    run = np.repeat(np.arange(12), 5)
    drawn = resampled_rows(_of_runs(run), generator, 20)
    assert drawn.shape == (20, 60) and set(drawn.ravel()) <= set(range(60))
    assert (drawn.reshape(20, 12, 5) == drawn.reshape(20, 12, 5)[..., :1] + np.arange(5)).all() and (
        drawn[:, ::5] % 5 == 0
    ).all()
    few = resampled_rows(_of_runs(np.repeat([3, 1], 10)), generator, 20).reshape(20, 4, 5)
    assert (few == few[..., :1] + np.arange(5)).all() and set(few[..., 0].ravel()) == {0, 5, 10, 15}


def test_the_interval_of_a_mean_of_few_stretches_holds_it_as_often_as_stated():
    """Means of 8 stretches of 5 numbers: of 1,000 intervals 950 hold the true mean, within three standard errors."""
    generator, problem = np.random.default_rng(1), _of_runs(np.repeat([0], 40))
    ends = resampled_quantiles(resampled_groups(problem))
    drawn = resampled_rows(problem, generator, 400)
    values = generator.standard_normal((1000, 40))
    low, high = np.quantile(values[:, drawn].mean(axis=2), ends, axis=1)
    assert ((low <= 0.0) & (high >= 0.0)).sum() == pytest.approx(950, abs=21)


OTHER = (
    replace(LINES[0], start_mm=(-500.0, -200.0, 600.0), end_mm=(50.0, 180.0, 720.0)),
    replace(SPIRAL, start_deg=40.0, turns=3.0),
)


@pytest.mark.parametrize("name", ["leg_asymmetry", "servo_lag", "encoder_eccentricity"])
def test_the_share_closed_holds_on_other_trajectories(name):
    """Against the truth on runs that the diagnosis has never seen."""
    effect = strong(name, 5.0)
    found = diagnosed(measure((effect,)))
    problem = problem_of(measure((effect,), 0.0, plan=plan_of(FULL, OTHER)))
    before, after = problem.residual(found.inference.calibrated), problem.residual(found.state)
    true = 1.0 - (after**2).sum() / (before**2).sum()
    assert found.verdict["share_closed"] == pytest.approx(true, abs=0.03)
    assert found.verdict["share_closed_low"] <= found.verdict["share_closed"] <= found.verdict["share_closed_high"]
    assert found.verdict["gap_rms_mm"] == pytest.approx(5.0 * np.sqrt(3.0) * NOISE_MM, rel=0.25)


def _step(residual_mm, picks=None, groups=None):
    squares, count = (residual_mm**2).sum(axis=1), len(residual_mm)
    picks = np.tile(np.arange(count), (3, 1)) if picks is None else picks
    groups = np.arange(count) if groups is None else groups
    drawn = picks, groups, squares, np.zeros((len(picks), count))
    return shrink.ShrinkStep("", (), residual_mm, squares, *drawn, np.ones(count, dtype=bool))


def test_the_interval_of_the_share_closed_holds_it_as_often_as_stated_with_few_stretches():
    """A gap that half remains at random, on 8 stretches: of 1,000 intervals 950 hold it, within three standard errors.

    Errors of a stretch are the same at its five stops, so that it counts as one number.
    """
    generator, problem, held = np.random.default_rng(2), _of_runs(np.repeat([0], 40)), 0
    picks, groups = resampled_rows(problem, generator, 400), resampled_groups(problem)
    for _ in range(1000):
        gap, rest = (np.repeat(generator.standard_normal((8, 3)), 5, axis=0) for _ in range(2))
        steps = _step(10.0 + gap, picks, groups), _step(np.sqrt(0.5) * (10.0 + rest), picks, groups)
        _, low, high = shrink.share_closed(*steps)
        held += low <= 0.5 <= high
    assert held == pytest.approx(950, abs=21)


def test_the_explained_fraction_is_the_reduction_of_the_mean_square_everywhere():
    generator = np.random.default_rng(1)
    residual = generator.normal(size=(50, 3))
    for factor, share in ((0.5, 0.75), (0.0, 1.0), (1.0, 0.0), (1.2, -0.44), (5.0, -1.0)):
        np.testing.assert_allclose(
            shrink.share_closed(_step(residual), _step(factor * residual)), [share] * 3, atol=1e-12
        )
        found = length_tables.share_closed(residual, factor * residual, 0.0)
        np.testing.assert_allclose(found, [share] * 3, atol=1e-12)
    assert shrink.share_closed(_step(0.0 * residual), _step(residual)) == (0.0, 0.0, 0.0)
    assert shrink.gap_rms(np.array([4.0, -1.0, 0.0])) == 1.0 and shrink.gap_rms(np.array([-4.0])) == 0.0


@pytest.mark.parametrize("name", [None, "thermal_growth", "leg_asymmetry", "servo_lag"])
def test_the_noise_is_found_within_its_error_whatever_smooth_gap_there_is(name):
    problem = problem_of(measure((strong(name, 6.0),) if name else ()))
    estimated, source = with_noise(problem, problem.linearise(calibrate(problem)), None)
    upper = sum(np.count_nonzero(problem.run == run) // 2 for run in np.unique(problem.run))
    assert source == "fitted"
    assert np.sqrt((estimated.noise.axis_mm**2).mean()) == pytest.approx(NOISE_MM, rel=4.0 / np.sqrt(6.0 * upper))


def test_a_campaigns_own_noise_is_found_by_the_same_rule():
    frame = measure((strong("leg_asymmetry", 6.0),))
    given = campaign_noise(MODEL, frame, (0.5, None))
    assert (given.mm, given.source) == (0.5, "given") and np.isnan(given.rad)
    found = campaign_noise(MODEL, frame, (None, None))
    assert found.source == "high_frequency" and found.mm == pytest.approx(NOISE_MM, rel=0.15)
    with pytest.raises(ConfigError, match="too few"):
        campaign_noise(MODEL, frame.head(2), (None, None))


def test_repeats_give_the_noise_where_they_are_clearly_quieter():
    """Many passes of one line with a jagged gap that repeats itself, which looks like noise along the run."""
    frame = measure(plan=plan_of((FORWARD,) * 6, LINES[:1]))
    jagged = np.random.default_rng(3).normal(0.0, 0.3, (16, 3))
    for k, axis in enumerate("xyz"):
        frame[f"measured_{axis}_mm"] += np.tile(jagged[:, k], 6)
    problem = problem_of(frame, {"servo_lag": EFFECTS["servo_lag"]})
    estimated, source = with_noise(problem, problem.linearise(calibrate(problem)), None)
    assert source == "repeats" and estimated.noise_mm == pytest.approx(NOISE_MM, rel=0.2)


def test_single_spikes_are_isolated_and_smooth_gaps_and_noise_are_not(full):
    problem, generator = full.problem, np.random.default_rng(2)
    noise = NOISE_MM * generator.standard_normal((len(problem), 3))
    assert not isolated(noise, problem.run, NOISE_MM).any()
    smooth = 2.0 * np.sin(problem.motion.time_s[problem.used] / 3.0)[:, None] * [1.0, -0.5, 0.2]
    wave = 0.3 * np.sin(np.arange(len(problem)) / 4.0)[:, None] * [1.0, -0.5, 0.2]
    assert not isolated(wave + noise, problem.run, NOISE_MM).any()
    assert not isolated(smooth * 0.05 + noise, problem.run, NOISE_MM).any()
    spiked = noise.copy()
    at = [4, 40, 100, 200]
    spiked[at, [0, 1, 2, 0]] += [1.0, -1.0, 0.5, 0.6]
    assert np.flatnonzero(isolated(spiked, problem.run, NOISE_MM)).tolist() == at
    frequent = noise + 5.0 * (generator.random((len(problem), 1)) < 0.3)
    assert not isolated(frequent, problem.run, NOISE_MM).any()


def test_the_score_of_a_prediction_is_a_normal_density():
    generator = np.random.default_rng(3)
    residual, spread = generator.normal(size=(5, 3)), generator.normal(size=(5, 3, 2))
    left = generator.uniform(0.1, 1.0, (5, 3))
    width = np.sqrt(left + (spread**2).sum(axis=2))
    expected = norm.logpdf(residual, scale=width).sum(axis=1) + 1.5 * np.log(2.0 * np.pi)
    np.testing.assert_allclose(Prediction(residual, spread, left).log_score, expected, rtol=1e-12)


def test_of_runs_it_is_the_density_of_what_is_correlated_along_them():
    generator, series = np.random.default_rng(4), np.repeat([1, 2], [6, 9])
    residual, left = generator.normal(size=(15, 3)), generator.uniform(0.1, 5.0, (15, 3))
    score, expected = Prediction(residual, np.zeros((15, 3, 0)), left, series).log_score, []
    for label, count in ((1, 6), (2, 9)):
        here, cosines = series == label, dct(np.eye(count), axis=0, norm="ortho")
        for axis in range(3):
            covariance = cosines.T @ np.diag(left[here, axis]) @ cosines
            density = multivariate_normal.logpdf(residual[here, axis], cov=covariance)
            expected.append(density + 0.5 * count * np.log(2.0 * np.pi))
    assert score[series == 1].sum() == pytest.approx(sum(expected[:3]), rel=1e-9)
    assert score[series == 2].sum() == pytest.approx(sum(expected[3:]), rel=1e-9)
