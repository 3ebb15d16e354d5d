"""Predictions of left-out readings against refits, and folds that leave every parameter determined."""

import numpy as np
import pytest

from rrru.estimation.cross_validation import (
    MIN_SHARE_IN_COMPLEMENT,
    choose_folds,
    complement_fits,
    complement_sums,
    least_share_in_complement,
)


def _columns(seed, rows=60, count=4):
    return np.random.default_rng(seed).normal(size=(rows, 3, count))


def test_complements_are_sums_of_the_others():
    sums = {k: np.random.default_rng(k).normal(size=(3, 3)) for k in (2, 5, 9, 11)}
    for number, found in complement_sums(sums).items():
        np.testing.assert_allclose(found, sum(one for k, one in sums.items() if k != number), rtol=1e-14)


@pytest.mark.parametrize("sd", [np.inf, 0.3])
def test_a_fit_of_the_complement_is_a_refit_without_the_fold(sd):
    generator, columns = np.random.default_rng(1), _columns(1, count=3)
    data = generator.normal(size=(60, 3))
    fold = np.arange(60) // 12
    precision = np.full(3, sd) ** -2.0
    together = np.concatenate([columns, data[..., None]], axis=-1)
    for number, fit in complement_fits(together, fold, precision, precision * 0.2).items():
        used = columns[fold != number].reshape(-1, 3)
        inverse = np.linalg.inv(used.T @ used + np.diag(precision))
        mean = inverse @ (used.T @ data[fold != number].ravel() + precision * 0.2)
        np.testing.assert_allclose(fit.mean, mean, rtol=1e-9)
        rows = generator.normal(size=(5, 3))
        half = fit.half(rows)
        np.testing.assert_allclose(half.T @ half, rows @ inverse @ rows.T, rtol=1e-9)


def test_folds_leave_every_parameter_in_the_complement():
    """Two targets measured in one run each: the place of each is seen in one run only."""
    columns = np.zeros((80, 3, 6))
    columns[:40, :, :3], columns[40:, :, 3:] = np.eye(3), np.eye(3)
    runs, stretches = np.repeat([0, 1], 40), np.arange(80) // 5 % 5
    assert least_share_in_complement(columns, runs) == pytest.approx(0.0, abs=1e-12)
    assert least_share_in_complement(columns, stretches) == pytest.approx(0.75, abs=0.06)
    np.testing.assert_array_equal(choose_folds([runs, stretches], columns), stretches)
    both = _columns(2, 80, 3)
    np.testing.assert_array_equal(choose_folds([runs, stretches], both), runs)


def test_what_no_reading_determines_does_not_count():
    columns = _columns(3)
    columns[..., 3] = columns[..., 0]
    fold = np.arange(60) % 5
    assert least_share_in_complement(columns, fold) > MIN_SHARE_IN_COMPLEMENT


def test_where_no_choice_determines_everything_the_best_is_taken():
    columns = np.zeros((6, 1, 2))
    columns[:, 0, 0], columns[0, 0, 1] = 1.0, 1.0
    first, second = np.array([0, 0, 0, 1, 1, 1]), np.arange(6) % 3
    assert any(choose_folds([first, second], columns) is one for one in (first, second))
    assert choose_folds([np.zeros(6, dtype=int), second], columns) is second
