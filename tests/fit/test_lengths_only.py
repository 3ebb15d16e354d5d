"""Lengths alone: derivatives, the full problem as the slow way, known truths, bad readings, and what evidence says."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import optimize, special

from rrru.errors import FitError
from rrru.fit.lengths_evidence import evidence
from rrru.fit.lengths_model import LengthModel, frame_basis, framed
from rrru.fit.lengths_only import fit_lengths
from rrru.fit.lengths_search import search
from rrru.fit.lengths_start import anchors_of, places_of, starts


def _machine(seed, count=4, dimensions=2, rows=40, noise_mm=0.3, missing_mm=0.0, common=False):
    """A model of random belts, its starts, and the true anchors."""
    generator = np.random.default_rng(seed)
    if dimensions == 2:
        turn = 2.0 * np.pi * (np.arange(count) + generator.uniform(-0.2, 0.2, count)) / count
        anchors = 1300.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    else:
        anchors = generator.normal(size=(count, 3))
        anchors *= 1500.0 / np.linalg.norm(anchors, axis=1, keepdims=True)
    places = generator.uniform(-500.0, 500.0, (rows, dimensions))
    heights = generator.uniform(20.0, 100.0, count) * (dimensions == 2)
    anchors, places = framed(anchors, places)
    lengths = np.sqrt(((places[:, None] - anchors) ** 2).sum(axis=-1) + heights**2) - missing_mm
    counted = lengths + noise_mm * generator.normal(size=lengths.shape)
    full = count * dimensions + 2 * count
    columns = list(np.eye(full)[np.flatnonzero(frame_basis(count, dimensions))])
    if common:
        columns.append(np.concatenate([np.zeros(full - 2 * count), np.ones(count), np.zeros(count)]))
    names = tuple(f"number_{k}" for k in range(len(columns)))
    origin = np.append(np.zeros(full - count), np.ones(count))
    return LengthModel(counted, np.eye(count), heights, origin, np.array(columns).T, names), anchors, places


def _starts(model):
    inverse = np.linalg.pinv(model.basis)
    for anchors, places, missing in starts(model.counted, model.heights_mm, model.dimensions):
        full = np.concatenate([anchors.ravel(), np.full(len(anchors), missing), np.ones(len(anchors))])
        yield inverse @ (full - model.origin), places


@pytest.mark.parametrize(("count", "dimensions"), [(3, 2), (4, 2), (7, 3)])
def test_slopes_are_finite_differences(count, dimensions):
    model, _, places = _machine(1, count, dimensions, common=True)
    everything = np.eye(len(model.origin))
    routing = np.random.default_rng(2).integers(0, 3, (count, count)).astype(float)
    model = replace(model, basis=everything, routing=routing, names=tuple(map(str, range(len(everything)))))
    theta = np.random.default_rng(3).normal(0.0, 300.0, len(everything))
    by_theta, by_place = model.slopes(theta, places)
    step = 1e-4
    for k in range(len(theta)):
        up, down = (model.residual(theta + sign * step * everything[k], places) for sign in (1.0, -1.0))
        np.testing.assert_allclose(by_theta[..., k], (up - down) / (2.0 * step), rtol=1e-5, atol=1e-5)
    for axis in range(dimensions):
        shift = step * np.eye(dimensions)[axis]
        up, down = (model.residual(theta, places + sign * shift) for sign in (1.0, -1.0))
        np.testing.assert_allclose(by_place[..., axis], (up - down) / (2.0 * step), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize(("count", "dimensions"), [(3, 2), (4, 2), (5, 2), (6, 3)])
def test_closed_form_start_is_the_machine_where_nothing_is_missing(count, dimensions):
    model, anchors, places = _machine(4, count, dimensions, noise_mm=0.0)
    squares = model.counted**2 - model.heights_mm**2
    found = anchors_of(squares, dimensions)
    result = framed(found, places_of(squares, found))
    sign = np.array([1.0, 1.0, np.sign(anchors[3, 2] * result[0][3, 2]) if dimensions == 3 else 1.0])[:dimensions]
    np.testing.assert_allclose(result[0] * sign, anchors, atol=1e-4)
    np.testing.assert_allclose(result[1] * sign, places, atol=1e-4)


def test_fit_is_that_of_all_unknowns_at_once():
    """Scipy on anchors, missing length and all places: same numbers, residuals and standard errors."""
    model, anchors, places = _machine(5, rows=25, missing_mm=40.0, common=True)
    fit = fit_lengths(model, _starts(model))
    numbers = len(fit.theta)

    def residual(unknowns):
        return model.residual(unknowns[:numbers], unknowns[numbers:].reshape(-1, 2)).ravel()

    begin = np.concatenate(
        [np.linalg.pinv(model.basis) @ np.concatenate([anchors.ravel(), np.zeros(8)]), places.ravel()]
    )
    slow = optimize.least_squares(residual, begin, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-12)
    np.testing.assert_allclose(fit.theta, slow.x[:numbers], atol=1e-3)
    np.testing.assert_allclose(fit.places.ravel(), slow.x[numbers:], atol=1e-3)
    freedom = model.counted.size - len(slow.x)
    assert fit.freedom == freedom
    covariance = np.linalg.inv(slow.jac.T @ slow.jac) * (slow.fun**2).sum() / freedom
    np.testing.assert_allclose(fit.covariance, covariance[:numbers, :numbers], rtol=1e-3)
    hat = np.diag(slow.jac @ np.linalg.solve(slow.jac.T @ slow.jac, slow.jac.T))
    np.testing.assert_allclose(fit.redundancy.ravel(), 1.0 - hat, atol=1e-4)


@pytest.mark.parametrize(("count", "dimensions"), [(3, 2), (4, 2), (5, 2), (8, 3)])
def test_missing_length_is_found_without_a_guess(count, dimensions):
    misses = []
    for seed in range(8):
        model, _, _ = _machine(seed, count, dimensions, missing_mm=90.0, common=True)
        fit = fit_lengths(model, _starts(model))
        assert fit.rms_mm < 0.4 and not len(fit.bad)
        misses.append((fit.theta[-1] - 90.0) / fit.standard_errors[-count - 1])
    assert np.abs(misses).max() < 4.0
    assert 0.3 < np.sqrt(np.mean(np.square(misses))) < 2.0


def test_anchors_in_a_plane_do_not_tell_their_shape_in_space():
    """Some maps of the plane fit with other heights of the places: with five anchors one number is open."""
    generator = np.random.default_rng(0)
    anchors = np.array([[0, 0, 0], [3000, 0, 0], [3000, 2000, 0], [0, 2000, 0], [1500, 2500, 0.0]])
    places = np.column_stack([generator.uniform(600.0, 1400.0, (60, 2)), generator.uniform(600.0, 1200.0, 60)])
    model, *_ = _machine(0, 5, 3)
    model = replace(model, counted=np.linalg.norm(places[:, None] - anchors, axis=-1))
    theta = np.linalg.pinv(model.basis) @ np.concatenate([anchors.ravel(), np.zeros(10)])
    fit = fit_lengths(model, [(theta, places)], np.ones(model.counted.shape))
    assert fit.identifiability.rank < len(theta)
    assert evidence(fit, np.full(len(theta), np.inf)) is None


def test_bad_readings_are_left_out_and_named():
    model, _, _ = _machine(6, count=5, missing_mm=20.0, common=True)
    bad = [[3, 1], [17, 4], [30, 0]]
    counted = model.counted.copy()
    for (row, reading), size in zip(bad, (30.0, -12.0, 400.0), strict=True):
        counted[row, reading] += size
    fit = fit_lengths(replace(model, counted=counted), _starts(replace(model, counted=counted)))
    assert fit.bad.tolist() == bad
    clean = fit_lengths(model, _starts(model), fit.weight)
    np.testing.assert_allclose(fit.theta, clean.theta, atol=1e-4)


def test_a_row_of_three_lengths_does_not_tell_which_is_bad():
    model, _, _ = _machine(7, count=3)
    counted = model.counted.copy()
    counted[11, 2] += 60.0
    fit = fit_lengths(replace(model, counted=counted), _starts(replace(model, counted=counted)))
    assert fit.bad.tolist() == [[11, 0], [11, 1], [11, 2]]


def test_rows_that_begin_mirrored_come_back():
    model, _, places = _machine(8)
    fit = fit_lengths(model, _starts(model))
    theta, mirrored = fit.theta, places.copy()
    mirrored[::7] = model.mirrored(theta, places)[0][::7]
    again = fit_lengths(model, [(theta, mirrored)])
    np.testing.assert_allclose(again.theta, fit.theta, atol=1e-4)


def test_too_few_rows_and_hopeless_lengths_are_refused():
    model, _, _ = _machine(9)
    with pytest.raises(FitError, match="4 lengths"):
        fit_lengths(model.rows(np.arange(1)), _starts(model.rows(np.arange(1))))
    noise = replace(model, counted=np.random.default_rng(0).uniform(500.0, 3000.0, model.counted.shape))
    fit = fit_lengths(noise, _starts(noise))
    assert fit.noise_mm > 50.0


def test_search_never_climbs():
    model, _, places = _machine(10)
    theta, weight = np.full(len(model.names), 700.0), np.ones(model.counted.shape)
    sums = []
    for most in (0, 1, 5, 50):
        found = search(model, theta, places, weight, most=most)
        sums.append((model.residual(*found) ** 2).sum())
    assert sums == sorted(sums, reverse=True)


def test_marginal_likelihood_is_the_integral():
    """Against Student's density with a dense covariance, for independent noise and for one smooth error."""
    model, _, _ = _machine(11, rows=15, common=True)
    fit = fit_lengths(model, _starts(model))
    found = evidence(fit, np.full(len(fit.theta), np.inf))
    by_theta, by_place = model.slopes(fit.theta, fit.places)
    whole = np.zeros((60, 2 * 15 + len(fit.theta)))
    for row in range(15):
        whole[4 * row : 4 * row + 4, 2 * row : 2 * row + 2] = by_place[row]
    whole[:, 30:] = by_theta.reshape(60, -1)
    left = fit.residual_mm.ravel()
    freedom = 60 - whole.shape[1]
    log = -0.5 * np.linalg.slogdet(whole.T @ whole)[1] - 0.5 * freedom * np.log(np.pi * (left @ left))
    assert found.independent == pytest.approx(log + special.gammaln(0.5 * freedom), abs=1e-6)


def test_evidence_counts_smooth_errors_as_no_proof():
    """A smooth error of the lengths lets F prefer a missing length that is not there; evidence names the error."""
    fits = []
    for common in (False, True):
        model, _, places = _machine(12, rows=80, noise_mm=0.1, common=common)
        wave = np.sin(places[:, :1] / 250.0 + np.arange(4)) * np.cos(places[:, 1:] / 300.0 - np.arange(4))
        model = replace(model, counted=model.counted + 1.5 * wave)
        fits.append(fit_lengths(model, _starts(model), np.ones(model.counted.shape)))
    bare, missing = (evidence(fit, np.append(np.full(5, np.inf), 100.0)[: len(fit.theta)]) for fit in fits)
    assert bare.smooth > bare.independent + 50.0
    assert missing.smooth < bare.smooth + 1.0
    assert missing.standard_errors[-5] > 1.2 * fits[1].standard_errors[-5]
