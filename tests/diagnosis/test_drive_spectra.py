"""Waves and rough functions of the drives' angles in what a calibration leaves of a six-axis arm."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.drive_spectra import _likeliest_factor, amplitudes, jumps, likeliest, one_step, pursue
from rrru.diagnosis.options import OPTIONS
from rrru.effects.drive_error_function import ORDERS
from rrru.effects.library import find
from tests.diagnosis import arms
from tests.diagnosis.arms import NOISE_MM

_COUNT = 150


@pytest.fixture(scope="module")
def arm():
    """Problem, basis (m, b) of its calibration, effect of drives (m, 3, K), their values (m, K), of a perfect arm."""
    problem = arms.problem_of(arms.measure(count=_COUNT))
    linear = problem.linearise(calibrate(problem))
    basis, _ = np.linalg.qr(linear.base.reshape(linear.data.size, -1))
    return problem, basis, linear.drive, problem.motion.drive[problem.at]


def _made(arm, waves, generator, noise_mm=NOISE_MM):
    """What the calibration leaves of waves (drive, order, size, phase) and noise, (m,)."""
    _, basis, effect, drive = arm
    change = np.zeros_like(drive)
    for k, order, size, phase in waves:
        change[:, k] += size * np.sin(order * drive[:, k] + phase)
    data = np.einsum("nak,nk->na", effect, change).ravel()
    data = data + noise_mm * generator.standard_normal(len(data))
    return data - basis @ (basis.T @ data)


def _resolution(arm):
    """Difference of orders that each drive (K,) resolves."""
    return 2.0 * np.pi / np.ptp(arm[3], axis=0)


@pytest.mark.parametrize("drive", range(6))
def test_one_sharp_wave_is_found_on_its_drive_at_its_order(arm, drive):
    generator = np.random.default_rng(drive)
    for order in generator.uniform(2.0 * _resolution(arm)[drive], 60.0, 3):
        data = _made(arm, [(drive, order, 3e-4, generator.uniform(-3.0, 3.0))], generator)
        (first, *_), _ = pursue(data, arm[1], arm[2], arm[3])
        assert first[0] == drive and abs(first[1] - order) < 0.5 * _resolution(arm)[drive]


def test_three_sharp_waves_are_found_and_next_to_nothing_else(arm):
    """None is taken for two of the orders that are tried."""
    numbers = []
    for seed in range(6):
        generator = np.random.default_rng(seed)
        waves = [(k, generator.uniform(6.0, 60.0), 2e-4, generator.uniform(-3.0, 3.0)) for k in (0, 2, 4)]
        found, _ = pursue(_made(arm, waves, generator), arm[1], arm[2], arm[3])
        step = _resolution(arm)
        for k, order, *_ in waves:
            assert any(drive == k and abs(one - order) < 0.25 * step[k] for drive, one in found)
        numbers.append(len(found))
    assert max(numbers) <= 4 and sum(numbers) <= 20


def test_noise_alone_has_waves_as_rarely_as_their_price_says(arm):
    """A wave costs as much as all resolved ones together, and the m numbers: one campaign of about m / 3."""
    trials, found = 150, 0
    for seed in range(trials):
        waves, log_prior = pursue(_made(arm, [], np.random.default_rng(seed)), arm[1], arm[2], arm[3])
        found += bool(waves)
        assert bool(waves) == (log_prior < 0.0)
    assert found <= 3


def test_parameters_that_are_fitted_with_them_make_waves_no_more_frequent(arm):
    """Of 40 stops and 90 numbers that are fitted there is little left: chance takes a larger share of that."""
    rows = np.isin(arm[0].at, np.arange(1, 41))
    _, basis, effect, drive = arm
    generator, found = np.random.default_rng(0), 0
    calibration = basis.reshape(len(drive), 3, -1)[rows].reshape(3 * rows.sum(), -1)
    nuisance, _ = np.linalg.qr(np.concatenate([calibration, generator.normal(size=(3 * rows.sum(), 63))], axis=1))
    for _ in range(200):
        data = generator.standard_normal(3 * rows.sum())
        waves, _ = pursue(data - nuisance @ (nuisance.T @ data), nuisance, effect[rows], drive[rows])
        found += bool(waves)
    # three of 240 would be usual
    assert found <= 9


def test_waves_of_one_drive_keep_apart_whatever_is_looked_through(arm):
    """Something slow that is no wave, far above the noise: many waves represent it, none of them twice."""
    _, basis, effect, drive = arm
    slow = np.tanh(3.0 * drive) * np.abs(drive) * 1e-3
    data = np.einsum("nak,nk->na", effect, slow).ravel() + NOISE_MM * np.random.default_rng(0).normal(size=len(basis))
    found, _ = pursue(data - basis @ (basis.T @ data), basis, effect, drive)
    assert len(found) > 3
    for k, step in enumerate(_resolution(arm)):
        orders = np.sort([order for number, order in found if number == k])
        assert (np.diff(orders) > 0.1 * step).all() and (orders >= step).all() and (orders <= 64.0).all()
    names = find("transmission_orders", arms.ARM).with_waves(found).parameters.names
    assert len(set(names)) == 2 * len(found)


def test_the_price_of_a_choice_is_that_of_one_among_all_resolved(arm):
    """Minus the logarithm of how many sets of so many waves there are, 64 times the drives' turns each."""
    generator = np.random.default_rng(3)
    waves = [(k, 12.0 + 9.0 * k, 3e-4, 0.5) for k in range(3)]
    found, log_prior = pursue(_made(arm, waves, generator), arm[1], arm[2], arm[3])
    turns = np.ptp(arm[3], axis=0).sum() / (2.0 * np.pi)
    sets = (64.0 * turns) ** len(found) / np.prod(np.arange(1, len(found) + 1))
    assert log_prior == pytest.approx(-np.log(sets))


def test_what_the_calibration_takes_up_and_drives_that_stand_still_have_no_waves(arm):
    _, basis, effect, drive = arm
    still = np.tile(drive[:1], (len(drive), 1))
    data = _made(arm, [], np.random.default_rng(0))
    assert pursue(data, basis, effect, still) == ((), 0.0)
    barely = still + 1e-3 * np.random.default_rng(1).random(drive.shape)
    assert pursue(data, basis, effect, barely) == ((), 0.0)
    assert pursue(0.0 * data, basis, effect, drive) == ((), 0.0)


def test_a_drive_that_stands_still_hides_no_wave_of_another(arm):
    generator = np.random.default_rng(2)
    data = _made(arm, [(4, 12.3, 3e-4, 1.0)], generator)
    _, basis, effect, drive = arm
    still = np.where(np.arange(6) == 1, 0.2, drive)
    ((found, order), *_), _ = pursue(data, basis, effect, still)
    assert found == 4 and abs(order - 12.3) < 0.5 * _resolution(arm)[4]


def test_the_spectrum_that_made_the_data_is_the_likeliest():
    """Coefficients drawn from each spectrum, unlike sizes, in noise: most draws name it, all have what it adds."""
    effect = find("drive_error_function", arms.ARM)
    problem = replace(arms.problem_of(arms.measure(count=300)), library={effect.name: effect})
    linear = problem.linearise(calibrate(problem))
    basis, _ = np.linalg.qr(linear.base.reshape(linear.data.size, -1))
    whole, count = linear.columns[effect.name, 0].reshape(linear.data.size, -1), 1 + 2 * len(ORDERS)
    # low orders of two drives do, and are quick
    keep = np.concatenate([1 + np.arange(2 * 48), count + 1 + np.arange(2 * 48)])
    columns = whole[:, keep] - basis @ (basis.T @ whole[:, keep])
    spectra, hits, draws = [one[keep] for one in effect.coordinates.spectra], 0, 0
    roots, several = [[np.diag(own) for own in np.split(size, 2)] for size in spectra], [False] * len(spectra)
    for number, size in enumerate(spectra):
        for seed in range(4):
            generator = np.random.default_rng([number, seed])
            prior_scale = generator.uniform(0.7, 2.0)
            data = columns @ (prior_scale * size * generator.standard_normal(len(size)))
            data = data + NOISE_MM * generator.standard_normal(len(data))
            found, factor, noise, *_ = likeliest(
                data - basis @ (basis.T @ data), columns, (roots, several), basis.shape[1]
            )
            assert noise == pytest.approx(NOISE_MM, rel=0.1)
            power, true = (factor * spectra[found]) ** 2, (prior_scale * size) ** 2
            shows = true * (columns**2).sum(axis=0) > 3.0 * NOISE_MM**2
            assert power[shows].sum() == pytest.approx(true[shows].sum(), rel=0.75)
            assert found != number or factor == pytest.approx(prior_scale, rel=0.3)
            hits, draws = hits + (found == number), draws + 1
    assert draws == 44 and hits >= 30


def test_one_drive_alone_has_the_size_that_it_has():
    """A rough function of one of six drives: the size is not the mean over six."""
    effect = find("drive_error_function", arms.ARM)
    problem = arms.problem_of(arms.measure(count=200), "drive_error_function")
    linear = problem.linearise(calibrate(problem))
    basis, _ = np.linalg.qr(linear.base.reshape(linear.data.size, -1))
    found = problem.library[effect.name]
    columns, roots = linear.columns[effect.name, 0].reshape(linear.data.size, -1), found.coordinates.roots
    spectra, generator, factors = (roots, found.coordinates.of_one), np.random.default_rng(8), []
    for _ in range(8):
        root = roots[4][2]
        of_drive = columns[:, found.coordinates.legs == 3] @ (3.0 * root @ generator.standard_normal(root.shape[1]))
        data = of_drive + NOISE_MM * generator.standard_normal(len(of_drive))
        _, factor, *_ = likeliest(
            data - basis @ (basis.T @ data), columns - basis @ (basis.T @ columns), spectra, basis.shape[1]
        )
        factors.append(factor)
    assert np.median(factors) == pytest.approx(3.0, rel=0.3)


def test_one_step_has_the_likelihood_of_its_column_at_every_place():
    generator, count = np.random.default_rng(5), 14
    effect, drive = generator.standard_normal((count, 3, 2)), generator.uniform(0.0, 5.0, (count, 2))
    drive[3] = drive[4]
    basis, _ = np.linalg.qr(generator.standard_normal((3 * count, 4)))
    data = (effect[..., 0] * (drive[:, :1] > 2.0)).ravel() + 0.1 * generator.standard_normal(3 * count)
    data = data - basis @ (basis.T @ data)
    terms = []
    for k in range(2):
        at = np.unique(drive[:, k])
        for low, high in pairwise(at):
            column = (effect[..., k] * (drive[:, k] > 0.5 * (low + high))[:, None]).ravel()
            column = column - basis @ (basis.T @ column)
            value, *_ = _likeliest_factor(
                np.array([[column @ column]]), np.array([column @ data]), data @ data, 3 * count - 4
            )
            terms.append(value + np.log((high - low) / np.ptp(at) / 2.0))
    assert one_step(data, basis, effect, drive) == pytest.approx(np.logaddexp.reduce(terms), abs=1e-3)
    assert one_step(data, basis, effect, 0.0 * drive) == -np.inf


@pytest.mark.parametrize("noise", [0.0, 1e-12, 1e-8])
def test_one_step_of_exact_data_has_the_largest_signal_that_is_tried(noise):
    """A step at a place of its own explains all; its signal is 1,000 times the noise, as for a spectrum."""
    generator, count = np.random.default_rng(1), 14
    effect, drive = generator.standard_normal((count, 3, 1)), np.arange(count)[:, None] + 0.0
    basis, _ = np.linalg.qr(generator.standard_normal((3 * count, 4)))
    data = (effect[..., 0] * (drive > 6.5)).ravel() + noise * generator.standard_normal(3 * count)
    data, freedom = data - basis @ (basis.T @ data), 3 * count - 4
    signal = freedom * np.exp(2.0 * OPTIONS.max_log_signal_to_noise)
    explained = -0.5 * freedom * np.log(data @ data / (1.0 + signal) / freedom) - 0.5 * np.log1p(signal)
    assert one_step(data, basis, effect, drive) == pytest.approx(explained - np.log(count - 1.0), abs=1e-6)


def test_an_injected_wave_has_its_amplitude():
    """In exact readings with noise, the arm calibrated: one wave on each of two drives, and nothing elsewhere."""
    effect = find("transmission_orders", arms.ARM).with_waves(((1, 11.0), (3, 30.0)))
    sine, cosine = np.array([2.4e-4, -5e-4]), np.array([-1e-4, 3e-4])
    acting = arms.active("", np.stack([sine, cosine], axis=1).ravel(), {}, effect)
    problem = arms.problem_of(arms.measure((acting,)))
    state = calibrate(problem)
    for k, (drive, order) in enumerate(((1, 11.0), (3, 30.0))):
        size = np.hypot(sine[k], cosine[k])
        found = amplitudes(problem, state, np.array([order, order + 9.0]))[drive]
        assert found[0] == pytest.approx(size, rel=0.2) and found[1] < 0.4 * size
    quiet = arms.problem_of(arms.measure())
    for drive in range(6):
        assert (amplitudes(quiet, calibrate(quiet), np.arange(3.0, 60.0))[drive] < 4e-5).all()


def test_amplitudes_are_exact_where_nothing_else_acts():
    """Without noise, of a small wave: the calibration fitted with it does not change it."""
    effect = find("transmission_orders", arms.ARM).with_waves(((2, 4.5),))
    acting = arms.active("", [3e-5, -4e-5], {}, effect)
    problem = arms.problem_of(arms.measure((acting,), noise=(0.0, 0.0)))
    found = amplitudes(problem, calibrate(problem), np.array([4.5]))[2]
    np.testing.assert_allclose(found, 5e-5, rtol=2e-3)


def test_a_function_that_jumps_between_two_known_values_has_the_variance_of_all_places_of_the_jump():
    generator, known_at, known = np.random.default_rng(0), np.array([3.0, 0.0, 1.0]), np.array([5.0, 2.0, 2.0])
    value = np.linspace(0.0, 3.0, 31)
    places = generator.uniform(1.0, 3.0, (20000, 1))
    made = 2.0 + 3.0 * (value > places)
    before, after, share = jumps(value, known_at, known)
    np.testing.assert_allclose((after - before) ** 2 * share * (1.0 - share), made.var(axis=0), atol=0.05)
    assert (before == 2.0).all() and (after[:10] == 2.0).all() and (after[10:] == 5.0).all()
