"""The network against slow, obvious and independent ones, and against what it must be able to learn."""

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from rrru.compensation.rbf import answers, fit, grow, make_folds, validation_mse


@pytest.fixture
def curve():
    """Points (60, 3) on a rising circle and a smooth target (60, 2)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 60)
    points = np.column_stack([80.0 * np.cos(angle), 80.0 * np.sin(angle), 6.0 * angle])
    return points, np.column_stack([np.sin(2.0 * angle), 0.3 * np.cos(angle) + 0.01 * points[:, 2]])


def _slow_mse(points, targets, centres, spread_mm, at, wanted):
    """Mean squared error of the least-squares network with a threshold, solved anew."""
    design = np.column_stack([answers(points, centres, spread_mm), np.ones(len(points))])
    weights = np.linalg.lstsq(design, targets, rcond=None)[0]
    return ((np.column_stack([answers(at, centres, spread_mm), np.ones(len(at))]) @ weights - wanted) ** 2).mean()


def test_a_neuron_answers_one_at_its_centre_and_one_half_at_its_spread():
    points = np.array([[0.0, 0.0, 0.0], [3.6, 0.0, 0.0], [0.0, 0.0, -7.2]])
    np.testing.assert_allclose(answers(points, points[:1], 3.6)[:, 0], [1.0, 0.5, 1.0 / 16.0], rtol=1e-12)


def test_every_neuron_is_the_one_that_lowers_the_error_most(curve):
    """Against trying out all candidates with a least-squares solution each."""
    points, targets = curve
    growth = grow(points, targets, 30.0, 6)
    for count in range(1, 7):
        before = points[growth.order[: count - 1]]
        tried = [_slow_mse(points, targets, np.vstack([before, one]), 30.0, points, targets) for one in points]
        assert growth.train_mse[count] == pytest.approx(min(tried), rel=1e-6)
        assert tried[growth.order[count - 1]] == pytest.approx(min(tried), rel=1e-6)
    assert growth.train_mse[0] == pytest.approx(targets.var(axis=0).mean(), rel=1e-12)


def test_the_followed_error_is_that_of_the_network_with_so_many_neurons(curve):
    points, targets = curve
    train = np.arange(60) % 4 != 0
    growth = grow(points[train], targets[train], 25.0, 12, 1e-6, points[~train], targets[~train])
    for count in (0, 1, 5, 12):
        network = fit(points[train], targets[train], 25.0, growth.order[:count])
        for rows, expected in ((train, growth.train_mse[count]), (~train, growth.check_mse[count])):
            assert ((network(points[rows]) - targets[rows]) ** 2).mean() == pytest.approx(expected, rel=1e-6)


def test_with_all_neurons_it_is_the_gaussian_interpolator_of_scipy(curve):
    """The threshold replaces one neuron; without it there is one sum of Gaussians through all points, which scipy
    finds by itself.
    """
    points, targets = curve
    spread = 8.0
    order = grow(points, targets, spread, len(points)).order
    network = fit(points, targets, spread, order)
    rest = targets - network.threshold
    reference = RBFInterpolator(points, rest, kernel="gaussian", epsilon=np.sqrt(np.log(2.0)) / spread, degree=-1)
    between = 0.5 * (points[1:] + points[:-1])
    assert len(order) == len(points) - 1
    np.testing.assert_allclose(network(between), reference(between) + network.threshold, atol=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_a_network_of_the_same_kind_is_recovered(curve, seed):
    points, _ = curve
    generator = np.random.default_rng(seed)
    centres, weights = points[[5, 25, 45]], generator.standard_normal((3, 2))
    targets = answers(points, centres, 20.0) @ weights + np.array([2.0, -1.0])
    growth = grow(points, targets, 20.0, 60, 1e-8)
    network = fit(points, targets, 20.0, growth.order)
    anywhere = 60.0 * generator.standard_normal((40, 3))
    true = answers(anywhere, centres, 20.0) @ weights + np.array([2.0, -1.0])
    exact = fit(points, targets, 20.0, np.array([5, 25, 45]))
    np.testing.assert_allclose(exact(anywhere), true, atol=1e-10)
    np.testing.assert_allclose(network(points), targets, atol=1e-5)


def test_what_is_hardly_new_is_refused_and_weights_stay_small(curve):
    """A spread as wide as the curve: with rounding as the only limit the weights are huge, and so is the answer off the
    curve.
    """
    points, targets = curve
    noisy = targets + 0.01 * np.random.default_rng(1).standard_normal(targets.shape)
    free, held = (fit(points, noisy, 150.0, grow(points, noisy, 150.0, 60, share).order) for share in (1e-12, 1e-4))
    assert np.abs(held.weights).max() < 1e-2 * np.abs(free.weights).max()
    off = points * np.array([1.2, 1.2, 1.0])
    assert np.abs(held(off)).max() < np.abs(free(off)).max()


def test_cross_validation_holds_every_point_back_once(curve):
    points, targets = curve
    folds = make_folds(60, 5, np.random.default_rng(3))
    assert np.bincount(folds).tolist() == [12] * 5
    errors = np.empty((60, 2))
    for fold in range(5):
        out = folds == fold
        order = grow(points[~out], targets[~out], 20.0, 4).order
        errors[out] = fit(points[~out], targets[~out], 20.0, order)(points[out]) - targets[out]
    assert validation_mse(points, targets, 20.0, 4, folds)[4] == pytest.approx((errors**2).mean(), rel=1e-8)


def test_a_network_that_runs_out_of_neurons_keeps_its_last_error():
    points = np.repeat(np.eye(3), 4, axis=0) * 10.0
    targets = points[:, :1].copy()
    assert len(grow(points, targets, 5.0, 10).order) == 2
    curve = validation_mse(points, targets, 5.0, 10, np.tile([0, 1], 6))
    assert (curve[3:] == curve[2]).all() and curve[2] < 1e-20
