"""The budget of a gap: shares of its mean square by effects, non-repeatability, offsets per run and discrepancy.

Mean squares are those of positions on the robot. Effects and the unexplained part are drawn from the posterior over
hypotheses and their coefficients, with the calibration's share taken out. Squares of parts and twice the products of
confounded effects, with the error of the calibration itself, are the gap: in every draw its shares add up to 1. What
was measured differs from that by the products of errors and noise ("sampling"), which are no error of the robot.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd
from scipy.special import gammaincinv, ndtr

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.diagnosis.discrepancy_basis import UNKNOWN
from rrru.diagnosis.evidence import ModelEvidence
from rrru.diagnosis.hypothesis import Answer, Hypothesis
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.model_fit import ModelFit
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.state import LeftByCalibration
from rrru.diagnosis.terms import signatures, spread
from rrru.estimation.noise_model import CONTRADICTED, NoiseModel

COLUMNS = ("part", "kind", "rms_mm", "share", "share_low", "share_high", "probability")
_UNEXPLAINED = "unexplained"


def budget(
    inference: InferenceResult, stated_mm: float | None, generator: np.random.Generator, draws: int
) -> pd.DataFrame:
    """Rows of `gap_budget` without the campaign; stated_mm: the instrument's noise per axis, None where unknown.

    Intervals have the errors that a discrepancy makes in the coefficients, see `ModelFit.bias`. In a mean square they
    would count twice, as the estimated coefficients have them already.
    """
    left = LeftByCalibration(inference.evidence.linear.calibration_basis, inference.problem.on_robot)
    posterior = inference.posterior
    drawn = _drawn(inference, left, generator, draws)
    instrument_mm2, noise = _noise_parts(inference, stated_mm, generator, draws)
    residual = inference.problem.residual(inference.calibrated)
    instrument = float(instrument_mm2.mean())
    # the residuals have the share of the noise that the calibration leaves
    measured = float((residual[inference.problem.on_robot] ** 2).sum(axis=1).mean()) - instrument * (1.0 - left.taken)
    calibration = instrument / 3.0 * left.error(generator, draws)
    biased = drawn if inference.fit.bias is None else _drawn(inference, left, generator, draws, biased=True)
    min_product = OPTIONS.min_covariance_share * max(measured, 1e-12)
    pairs = [pair for pair, products in drawn.products.items() if abs(products.mean()) > min_product]
    parts, wide = (
        {(name, "effect"): one.squares[name] for name in one.acting}
        | {(name, name): some for name, (some, _) in noise.items()}
        | {(_UNEXPLAINED, _UNEXPLAINED): one.squares[_UNEXPLAINED]}
        | {(" and ".join(pair), "covariance"): one.products[pair] for pair in pairs}
        for one in (drawn, biased)
    )
    sampling = np.array([measured - np.sum([*parts.values()], axis=0).mean()])
    rest = {("sampling", "sampling"): sampling, ("calibration", "calibration"): calibration}
    whole, wide_whole = (np.sum([*some.values(), calibration], axis=0) for some in (parts, wide))
    probability = {name: chance for name, (_, chance) in noise.items()}
    probability |= {name: posterior.marginal(name) for name in drawn.acting}
    probability[_UNEXPLAINED] = posterior.probability_unexplained
    rows = []
    for (part, kind), squares in (parts | rest).items():
        shares = (wide | rest)[part, kind] / np.where(wide_whole > 0.0, wide_whole, np.inf)
        chance = probability.get(part, np.nan)
        given = biased.acting[part] if kind == "effect" and chance >= OPTIONS.min_named_probability else None
        rows.append((part, kind, *_numbers(squares, float(whole.mean()), shares, given), chance))
    return pd.DataFrame(rows, columns=COLUMNS)


def _numbers(
    squares: FloatArray, total: float, shares: FloatArray, given: BoolArray | None = None
) -> tuple[float, float, float, float]:
    """Signed rms, share and its interval from draws (b,) of a mean square, which is negative where a product is.

    total: mean square of the whole gap; shares (b,): draws of the interval; given (b,): those that it is of, None for
    all. That of an effect that is probable enough for a name is that given that it acts: how probable that is has a
    column of its own.
    """
    mean = float(squares.mean())
    share = mean / total if total > 0.0 else 0.0
    counted = shares if given is None else shares[given]
    low, high = np.quantile(counted, OPTIONS.interval_quantiles) if len(counted) else (share, share)
    return float(np.sign(mean) * np.sqrt(abs(mean))), share, float(min(low, share)), float(max(high, share))


@dataclass(frozen=True)
class _Drawn:
    """Draws (b,) of mean squares by name, of effects and the unexplained part, in which of them each effect acts, and
    draws of twice the products of two parts.
    """

    squares: dict[str, FloatArray]
    acting: dict[str, BoolArray]
    products: dict[tuple[str, str], FloatArray]


def _drawn(
    inference: InferenceResult,
    left: LeftByCalibration,
    generator: np.random.Generator,
    draws: int,
    biased: bool = False,
) -> _Drawn:
    """The draws; biased: with the errors that a discrepancy makes in the coefficients."""
    problem, evidence, posterior = inference.problem, inference.evidence, inference.posterior
    linear, lacks_fit = evidence.linear, inference.lacks_fit
    data, count = left.residual(linear.data.reshape(-1, 1)), int(problem.on_robot.sum())
    weights = posterior.weights.ravel()
    counts = np.bincount(generator.choice(len(weights), draws, p=weights / weights.sum()), minlength=len(weights))
    names = [name for name in problem.effects if posterior.marginal(name) > OPTIONS.min_budget_probability]
    squares = {name: np.zeros(draws) for name in (*names, _UNEXPLAINED)}
    acting = {name: np.zeros(draws, dtype=bool) for name in names}
    products, first = {pair: np.zeros(draws) for pair in combinations(squares, 2)}, 0
    for number in np.flatnonzero(counts):
        row, level = map(int, np.unravel_index(number, posterior.weights.shape))
        some = slice(first, first + counts[number])
        first = some.stop
        answer = posterior.hypotheses[row], level
        parts = _parts(evidence, answer, left, generator, counts[number], inference.fit if biased else None)
        for name in set(parts) & set(squares):
            squares[name][some] = (parts[name] ** 2).sum(axis=0) / count
        for name in set(parts) & set(acting):
            acting[name][some] = True
        for pair in products:
            if set(pair) <= set(parts):
                products[pair][some] = 2.0 * (parts[pair[0]] * parts[pair[1]]).sum(axis=0) / count
        if posterior.unexplained[row, level] and (lacks_fit or _UNEXPLAINED not in parts):
            beyond = data - sum(parts.values(), np.zeros((len(data), counts[number])))
            noise = 3.0 * problem.noise_mm**2 * (1.0 - left.taken)
            squares[_UNEXPLAINED][some] += np.maximum((beyond**2).sum(axis=0) / count - noise, 0.0)
    return _Drawn(squares, acting, products)


def _parts(
    evidence: ModelEvidence,
    answer: Answer,
    left: LeftByCalibration,
    generator: np.random.Generator,
    count: int,
    biased: ModelFit | None = None,
) -> dict[str, FloatArray]:
    """By effect of a hypothesis its part of the gap (3n, count) beyond the calibration, at drawn coefficients.

    answer: a hypothesis and its discrepancy level; left: a LeftByCalibration; biased: a fit whose bias counts for terms
    that it has, None for a complete model. Discrepancy functions together are the unexplained part.
    """
    hypothesis, level = answer
    if not hypothesis.terms:
        return {}
    mean, covariance = evidence.coefficients(hypothesis.terms, hypothesis.prior_scales[level], level)
    if biased is not None and biased.bias is not None:
        own, of_fit = _coefficient_numbers(evidence, hypothesis, biased)
        covariance[np.ix_(own, own)] += biased.bias[np.ix_(of_fit, of_fit)]
    # coefficients have very different sizes: the eigenvalues are those of the correlation matrix
    unit = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    eigenvalues, eigenvectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    factor = unit[:, None] * eigenvectors * np.sqrt(np.maximum(eigenvalues, 0.0))
    drawn = mean[:, None] + factor @ generator.standard_normal((len(mean), count))
    result: dict[str, FloatArray] = {}
    start, linear = 0, evidence.linear
    made = signatures(evidence.library, linear, hypothesis.terms)
    for term, columns in zip(hypothesis.terms, made, strict=True):
        coordinates = evidence.library[term.effect].coordinates
        matrix = spread(coordinates, term.legs)
        values = drawn[start : start + matrix.shape[1]]
        values = np.where((matrix.T @ coordinates.positive > 0)[:, None], np.maximum(values, 0.0), values)
        part = columns.reshape(-1, columns.shape[-1]) @ values
        if (term.effect, term.shape) in linear.by_weight:
            slopes = linear.by_weight[term.effect, term.shape].reshape(len(part), -1, len(matrix))
            # to first order, as both were found
            acting = matrix @ evidence.found(hypothesis.terms)[start : start + matrix.shape[1]]
            part = part + np.einsum("nqc,c->nq", slopes, acting) @ drawn[len(mean) - slopes.shape[1] :]
        start += matrix.shape[1]
        name = _UNEXPLAINED if term.effect in UNKNOWN else term.effect
        result[name] = result.get(name, 0.0) + left.residual(part)
    return result


def _coefficient_numbers(evidence: ModelEvidence, hypothesis: Hypothesis, fit: ModelFit) -> tuple[IntArray, IntArray]:
    """Numbers (k,) of the coefficients of a hypothesis that a fit has, too, and those of the fit's parameters."""
    slices, count = fit.estimate.parameters.slices, len(fit.estimate.values)
    own, of_fit, start = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)], 0
    for term in hypothesis.terms:
        stop = start + spread(evidence.library[term.effect].coordinates, term.legs).shape[1]
        if term in fit.terms:
            own.append(np.arange(start, stop))
            of_fit.append(np.arange(count)[slices[term.effect]])
        start = stop
    return np.concatenate(own), np.concatenate(of_fit)


def _noise_parts(
    inference: InferenceResult, stated_mm: float | None, generator: np.random.Generator, draws: int
) -> tuple[FloatArray, dict[str, tuple[FloatArray, float]]]:
    """Draws (b,) of the instrument's mean square, and by name draws and probability of scatter and runs."""
    problem = inference.problem
    model = problem.noise or NoiseModel.white(problem.noise_mm)
    # degrees of freedom of one axis: the parameters are fitted to all three axes together
    freedom = max(len(problem) - inference.evidence.linear.calibration_basis.shape[1] / 3.0, 1.0)
    # a mean of so many squares is distributed as chi^2 over its degrees of freedom
    uniform = ndtr(generator.standard_normal((draws, 3)))
    axes = model.axis_mm**2 * gammaincinv(0.5 * freedom, uniform) / (0.5 * freedom)
    scatter, probability = np.zeros((draws, 3)), np.nan
    if stated_mm:
        beyond = model.axis_mm > CONTRADICTED * stated_mm
        scatter = np.where(beyond, np.maximum(axes - stated_mm**2, 0.0), 0.0)
        error = np.sqrt(0.5 / freedom)
        probability = ndtr((np.log(model.axis_mm / stated_mm) - np.log(CONTRADICTED)) / error).max()
    offset = model.drawn_offsets(generator, draws)
    return (axes - scatter).sum(axis=1), {
        "scatter": (scatter.sum(axis=1), probability),
        "runs": (axes.sum(axis=1) * offset, model.offset_probability),
    }
