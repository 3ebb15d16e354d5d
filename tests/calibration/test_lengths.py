"""Calibration from lengths: the full problem as the slow way, known truths, bad readings, and what evidence says."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import optimize, special

from rrru.calibration.lengths import fit_lengths
from rrru.errors import FitError
from rrru.estimation.parameters import Block, Parameters
from tests.estimation.observations.machines import machine, starts, values_of


def _flat(fit):
    """Parameters of a fit with flat priors."""
    names = [str(number) for number in range(len(fit.values))]
    return Parameters((Block.of("machine", names, ["mm"] * len(names), np.inf),))


def test_fit_is_that_of_all_unknowns_at_once():
    """Scipy on anchors, missing length and all places: same numbers, residuals and standard errors."""
    lengths, anchors, places = machine(5, rows=25, missing_mm=40.0, common=True)
    fit = fit_lengths(lengths, starts(lengths))
    numbers = len(fit.values)

    def residual(unknowns):
        at = replace(lengths, places_mm=unknowns[numbers:].reshape(-1, 2))
        return at.residual(unknowns[:numbers]).ravel()

    begin = np.concatenate([values_of(lengths, anchors), places.ravel()])
    slow = optimize.least_squares(residual, begin, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-12)
    np.testing.assert_allclose(fit.values, slow.x[:numbers], atol=1e-3)
    np.testing.assert_allclose(fit.places_mm.ravel(), slow.x[numbers:], atol=1e-3)
    freedom = lengths.counted.size - len(slow.x)
    assert fit.freedom == freedom
    covariance = np.linalg.inv(slow.jac.T @ slow.jac) * (slow.fun**2).sum() / freedom
    np.testing.assert_allclose(fit.covariance, covariance[:numbers, :numbers], rtol=1e-3)
    hat = np.diag(slow.jac @ np.linalg.solve(slow.jac.T @ slow.jac, slow.jac.T))
    np.testing.assert_allclose(fit.redundancy.ravel(), 1.0 - hat, atol=1e-4)


@pytest.mark.parametrize(("count", "dimensions"), [(3, 2), (4, 2), (5, 2), (8, 3)])
def test_missing_length_is_found_without_a_guess(count, dimensions):
    misses = []
    for seed in range(8):
        lengths, _, _ = machine(seed, count, dimensions, missing_mm=90.0, common=True)
        fit = fit_lengths(lengths, starts(lengths))
        assert fit.rms_mm < 0.4 and not len(fit.bad)
        misses.append((fit.values[-1] - 90.0) / fit.standard_errors[-count - 1])
    assert np.abs(misses).max() < 4.0
    assert 0.3 < np.sqrt(np.mean(np.square(misses))) < 2.0


def test_anchors_in_a_plane_do_not_tell_their_shape_in_space():
    """Some maps of the plane fit with other heights of the places: with five anchors one number is open."""
    generator = np.random.default_rng(0)
    anchors = np.array([[0, 0, 0], [3000, 0, 0], [3000, 2000, 0], [0, 2000, 0], [1500, 2500, 0.0]])
    places = np.column_stack([generator.uniform(600.0, 1400.0, (60, 2)), generator.uniform(600.0, 1200.0, 60)])
    lengths, *_ = machine(0, 5, 3)
    lengths = replace(lengths, counted=np.linalg.norm(places[:, None] - anchors, axis=-1))
    fit = fit_lengths(lengths, [values_of(lengths, anchors)], np.ones(lengths.counted.shape, dtype=bool))
    np.testing.assert_allclose(fit.places_mm, places, atol=1e-4)
    assert not fit.determined and fit.marginals(_flat(fit)) is None


def test_bad_readings_are_left_out_and_named():
    lengths, _, _ = machine(6, count=5, missing_mm=20.0, common=True)
    bad = [[3, 1], [17, 4], [30, 0]]
    counted = lengths.counted.copy()
    for (row, reading), size in zip(bad, (30.0, -12.0, 400.0), strict=True):
        counted[row, reading] += size
    fit = fit_lengths(replace(lengths, counted=counted), starts(replace(lengths, counted=counted)))
    assert fit.bad.tolist() == bad
    clean = fit_lengths(lengths, starts(lengths), fit.used)
    np.testing.assert_allclose(fit.values, clean.values, atol=1e-4)


def test_a_row_of_three_lengths_does_not_tell_which_is_bad():
    lengths, _, _ = machine(7, count=3)
    counted = lengths.counted.copy()
    counted[11, 2] += 60.0
    fit = fit_lengths(replace(lengths, counted=counted), starts(replace(lengths, counted=counted)))
    assert fit.bad.tolist() == [[11, 0], [11, 1], [11, 2]]


def test_too_few_rows_and_hopeless_lengths_are_refused():
    lengths, _, _ = machine(9)
    with pytest.raises(FitError, match="4 lengths"):
        fit_lengths(lengths.rows(np.arange(1)), starts(lengths.rows(np.arange(1))))
    # each row is a trial of its own, and the search for bad readings takes the more the more there are
    few = lengths.rows(np.arange(12))
    noise = replace(few, counted=np.random.default_rng(0).uniform(500.0, 3000.0, few.counted.shape))
    fit = fit_lengths(noise, starts(noise))
    assert fit.noise_mm > 50.0


def test_marginal_likelihood_is_the_integral():
    """Against Student's density with a dense derivative by all unknowns."""
    lengths, _, _ = machine(11, rows=15, common=True)
    fit = fit_lengths(lengths, starts(lengths))
    found, _ = fit.marginals(_flat(fit))
    slopes, by_place = lengths.slopes(fit.values)
    whole = np.zeros((60, 2 * 15 + len(fit.values)))
    for row in range(15):
        whole[4 * row : 4 * row + 4, 2 * row : 2 * row + 2] = by_place[row]
    whole[:, 30:] = slopes.reshape(60, -1)
    left = fit.residual_mm.ravel()
    freedom = 60 - whole.shape[1]
    log = -0.5 * np.linalg.slogdet(whole.T @ whole)[1] - 0.5 * freedom * np.log(np.pi * (left @ left))
    assert found.log_evidence == pytest.approx(log + special.gammaln(0.5 * freedom), abs=1e-6)
    assert found.noise_scale == pytest.approx(1.0)


def test_evidence_counts_smooth_errors_as_no_proof():
    """A smooth error of the lengths lets F prefer a missing length that is not there; evidence names the error."""
    fits, found = [], []
    for common in (False, True):
        lengths, _, places = machine(12, rows=80, noise_mm=0.1, common=common)
        wave = np.sin(places[:, :1] / 250.0 + np.arange(4)) * np.cos(places[:, 1:] / 300.0 - np.arange(4))
        lengths = replace(lengths, counted=lengths.counted + 1.5 * wave)
        fits.append(fit_lengths(lengths, starts(lengths), np.ones(lengths.counted.shape, dtype=bool)))
        sd = np.append(np.full(5, np.inf), 100.0)[: 5 + common]
        names = [str(number) for number in range(len(sd))]
        found.append(fits[-1].marginals(Parameters((Block.of("machine", names, ["mm"] * len(sd), sd),))))
    (bare_alone, bare), (_, missing) = found
    assert bare.log_evidence > bare_alone.log_evidence + 50.0
    assert missing.log_evidence < bare.log_evidence + 1.0
    # of the missing length
    assert np.sqrt(missing.covariance[-1, -1]) > 1.2 * fits[1].standard_errors[-5]


def test_bad_readings_are_found_where_rows_have_one_to_spare():
    """Cauchy's loss fits any three of four belts: other rows decide that the fourth has the gross error."""
    lengths, anchors, _ = machine(13, noise_mm=0.2)
    counted = lengths.counted.copy()
    counted[[2, 9, 21], [0, 3, 1]] += [250.0, -90.0, 40.0]
    fit = fit_lengths(replace(lengths, counted=counted), starts(replace(lengths, counted=counted)))
    assert {2, 9, 21} == set(fit.bad[:, 0])
    np.testing.assert_allclose(lengths.machine(fit.values)[0], anchors, atol=3.0)
