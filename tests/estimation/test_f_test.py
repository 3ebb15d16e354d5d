"""The F test of added columns: against two fits, an integral on a grid, and how often noise passes."""

from itertools import product

import numpy as np
import pytest
from scipy import stats

from rrru.errors import FitError
from rrru.estimation.evidence import marginalize
from rrru.estimation.f_test import LinearizedModel, largest_p, mean_p
from rrru.estimation.observations.combined import WithColumns
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem, WhiteNoise
from rrru.estimation.solver import estimate_at


class LinearizedProblem:
    """Readings (n, 2) that depend linearly on the parameters."""

    def __init__(self, columns, readings):
        self.columns, self.readings = columns, readings

    def residual(self, values):
        """Readings less prediction."""
        return self.readings - self.columns @ values

    def jacobian(self, values):
        """Its derivative."""
        return -self.columns


def flat(count, name="geometry"):
    return Block.of(name, [f"{name}_{k}" for k in range(count)], ["mm"] * count, np.inf)


def estimate(seed, rows=6, parameters=3, sd=None):
    """An Estimate away from the optimum of 2 rows readings, some of a noise of their own."""
    generator = np.random.default_rng(seed)
    sd = generator.uniform(0.2, 3.0, (rows, 2)) if sd is None else sd
    observations = LinearizedProblem(
        generator.normal(size=(rows, 2, parameters)), sd * generator.normal(size=(rows, 2))
    )
    problem = Problem(observations, Parameters((flat(parameters),)), WhiteNoise(sd))
    return estimate_at(problem, generator.normal(size=parameters), "anywhere"), generator


def slow_fit(columns, readings, sd):
    """Sum of squares, rank and coefficients of a weighted fit."""
    white = (columns / sd[..., None]).reshape(readings.size, -1)
    found, _, rank, _ = np.linalg.lstsq(white, (readings / sd).ravel())
    return (((readings / sd).ravel() - white @ found) ** 2).sum(), rank, found


@pytest.mark.parametrize("seed", range(5))
def test_p_and_coefficients_are_those_of_two_fits(seed):
    """The third column is the sum of the others and adds nothing."""
    found, generator = estimate(seed)
    columns = generator.normal(size=(6, 2, 2))
    columns = np.concatenate([columns, columns.sum(axis=-1, keepdims=True)], axis=-1)
    sd, residual = found.problem.whiten.sd, found.residual
    small, rank, _ = slow_fit(found.jacobian, residual, sd)
    large, more, values = slow_fit(np.concatenate([found.jacobian, columns[..., :2]], axis=-1), residual, sd)
    added = LinearizedModel.of(found).add(columns)
    p = stats.f.sf((small - large) / 2.0 / (large / (12 - more)), 2, 12 - more)
    assert (added.rank, added.freedom, more - rank) == (2, 7, 2)
    assert added.test(residual)[0].item() == pytest.approx(p, rel=1e-9)
    assert added.unexplained().item() == pytest.approx(large, rel=1e-9)
    two = LinearizedModel.of(found).add(columns[..., :2])
    np.testing.assert_allclose(two.estimates()[0][0], values[3:], rtol=1e-9)
    white = (np.concatenate([found.jacobian, columns[..., :2]], axis=-1) / sd[..., None]).reshape(12, -1)
    errors = np.sqrt(np.diag(np.linalg.inv(white.T @ white)) * large / 7)
    np.testing.assert_allclose(two.estimates()[1][0], errors[3:], rtol=1e-9)


def test_columns_of_the_model_are_no_longer_tested():
    found, generator = estimate(7)
    columns = generator.normal(size=(6, 2, 3))
    model = LinearizedModel.of(found)
    both = model.with_columns(columns[..., :1]).add(columns[..., 1:])
    problem = Problem(WithColumns(found.problem.observations, columns[..., :1]), Parameters((flat(4),)))
    wider = estimate_at(problem, np.append(found.values, 0.0), "anywhere")
    same = LinearizedModel.of(wider, found.problem.whiten).add(columns[..., 1:])
    for one, other in zip(both.test(found.residual), same.test(found.residual), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
    assert model.with_columns(columns[..., :1]).add(columns[..., :1]).rank == 0
    assert np.isnan(model.with_columns(columns[..., :1]).add(columns[..., :1]).test(found.residual)[0])


def test_weights_of_the_mean_are_marginal_likelihoods():
    """Against the core's under flat priors, between noises of other proportions."""
    found, generator = estimate(3)
    columns, sds = generator.normal(size=(6, 2, 1)), [generator.uniform(0.3, 3.0, (6, 2)) for _ in range(3)]
    wide = WithColumns(found.problem.observations, columns)
    parameters = Parameters((flat(3), flat(1, "added")))
    models = [LinearizedModel.of(found, WhiteNoise(sd)) for sd in sds]
    tests = [one.add(columns).test(found.residual) for one in models]
    p, ours = (np.array(part)[:, 0] for part in zip(*tests, strict=True))
    core = [
        marginalize(
            estimate_at(Problem(wide, parameters, WhiteNoise(sd)), [*found.values, 0.0], ""), common=parameters.names
        ).log_evidence
        for sd in sds
    ]
    np.testing.assert_allclose(ours - ours[0], np.array(core) - core[0], atol=1e-9)
    weight = np.exp(ours - ours.max())
    assert mean_p(models, columns, found.residual).item() == pytest.approx((p @ weight) / weight.sum())
    assert largest_p(models, columns, found.residual).item() == p.max()


def test_marginal_likelihoods_are_integrals():
    """Over one parameter, one coefficient and the noise's size, on a grid."""
    found, generator = estimate(11, rows=4, parameters=1)
    columns, logs, sums = generator.normal(size=(4, 2, 1)), [], []
    line, sizes = np.linspace(-25.0, 25.0, 401), np.exp(np.linspace(-1.5, 3.0, 121))
    for low in (0.3, 1.0):
        sd = np.where(np.arange(4)[:, None] < 2, low, 1.0) * np.ones((4, 2))
        logs.append(LinearizedModel.of(found, WhiteNoise(sd)).add(columns).test(found.residual)[1].item())
        x, c = np.meshgrid(line, line, indexing="ij")
        off = found.residual[..., None, None] - found.jacobian[..., :1, None] * x - columns[..., :1, None] * c
        squares = ((off / sd[..., None, None]) ** 2).sum(axis=(0, 1))
        # the density 1 / s^2 of s^2 is 2 of the logarithm of s
        density = [np.exp(-0.5 * squares / size**2).sum() / size**8 / np.prod(sd) for size in sizes]
        sums.append(np.log(np.sum(density)))
    assert logs[1] - logs[0] == pytest.approx(sums[1] - sums[0], abs=1e-3)


def test_noise_passes_as_often_as_p_says_and_effects_as_often_as_the_power():
    found, generator = estimate(5)
    added, draws = LinearizedModel.of(found).add(generator.normal(size=(6, 2, 2))), 4000
    sd = found.problem.whiten.sd
    for limit, size in product((0.01, 0.1), (0.0, 2.5)):
        effect = size * added.basis[0, :, 0].reshape(6, 2) * sd
        readings = sd[..., None] * generator.normal(size=(6, 2, draws)) + effect[..., None]
        share = added.power(limit, effect, 1.0)
        assert size or share == pytest.approx(limit)
        passed = (added.test(readings)[0][0] < limit).mean()
        assert abs(passed - share) < 4.0 * np.sqrt(share * (1.0 - share) / draws)


def test_a_block_that_the_model_explains_explains_nothing_among_others():
    """A reading with a parameter of its own, among single readings."""
    found, _ = estimate(9, rows=3, parameters=1)
    one = np.zeros((3, 2, 1))
    one[1, 0] = 1.0
    singles = np.eye(6).reshape(3, 2, 1, 6)
    p = LinearizedModel.of(found).with_columns(one).add(singles).test(found.residual)[0]
    assert p[2] == pytest.approx(1.0) and (np.delete(p, 2) < 1.0).all()


def test_a_whitening_without_determinant_is_refused():
    found, _ = estimate(1, sd=np.ones((6, 2)))
    with pytest.raises(FitError, match="log_determinant"):
        LinearizedModel.of(found, WhiteNoise(0.5))
