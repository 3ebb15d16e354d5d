"""The rule on outliers: its scales against simulation, neighbours in a run against a slow reference."""

import numpy as np
import pytest

from rrru.campaign import outliers


def test_robust_sds_are_those_of_normal_noise_whatever_a_tenth_of_it_is():
    generator = np.random.default_rng(1)
    noise = 0.3 * generator.normal(size=(200_000, 3))
    distances = {
        outliers.NORMAL_MEDIAN: noise[:, 0],
        outliers.MEDIAN_OF_LENGTH: np.linalg.norm(noise, axis=1),
    }
    for median, off in distances.items():
        assert outliers.robust_sd(off, median) == pytest.approx(0.3, rel=0.01)
        assert outliers.robust_sd(np.where(np.arange(len(off)) % 10, off, 1e6), median) < 0.36
        assert outliers.robust_sd(off, median, 0.4) == 0.4


def slow_isolated(residual, run, floor, kind):
    """The same point by point."""
    jump, worst = np.zeros(len(run)), np.zeros(len(run), dtype=bool)
    rows = {label: np.flatnonzero(run == label).tolist() for label in set(run.tolist())}
    around = [[] for _ in run]
    for own in (own for own in rows.values() if len(own) >= 5):
        for at, row in enumerate(own):
            # beyond an end of the run it is reflected
            around[row] = [own[len(own) - 1 - abs(len(own) - 1 - abs(at + step))] for step in (-2, -1, 1, 2)]
            jump[row] = np.abs(residual[row] - np.median(residual[around[row]], axis=0)).max()
        for row in own:
            worst[row] = all(jump[row] >= jump[other] for other in around[row])
    scale = {one: max(np.median(jump[kind == one]) / 1.55, 1.2 * floor) for one in set(kind.tolist())}
    found = np.array([bool(worst[k] and jump[k] > 8.0 * scale[kind[k]]) for k in range(len(run))])
    return found if found.mean() <= 0.1 else np.zeros(len(run), dtype=bool)


@pytest.mark.parametrize("seed", range(30))
def test_isolated_points_are_those_of_a_slow_reference(seed):
    generator = np.random.default_rng(seed)
    count = int(generator.integers(12, 80))
    run, kind = generator.integers(0, 5, count), generator.integers(0, 2, count)
    residual, spikes = 0.02 * generator.normal(size=(count, 3)), generator.random(count) < 0.05
    residual[spikes] += generator.normal(size=(int(spikes.sum()), 3))
    for floor in (0.0, 0.02):
        found = outliers.isolated(residual, run, floor, kind)
        np.testing.assert_array_equal(found, slow_isolated(residual, run, floor, kind))


def test_normal_noise_is_hardly_ever_an_outlier():
    """200 runs of 60 points."""
    generator = np.random.default_rng(2)
    flagged = sum(outliers.isolated(generator.normal(size=(60, 3)), np.ones(60), 0.0).sum() for _ in range(200))
    assert flagged == 0
