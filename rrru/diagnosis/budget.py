"""The budget of a gap: shares of its mean square by effects, non-repeatability, offsets per run and discrepancy.

Mean squares are those of positions on the robot. Effects and the unexplained part are drawn from the posterior over
hypotheses and their coefficients, with the calibration's share taken out. Squares of parts and twice the products of
confounded effects, with the error of the calibration itself, are the gap: in every draw its shares add up to 1. What
was measured differs from that by the products of errors and noise ("sampling"), which are no error of the robot.
"""

from itertools import combinations

import numpy as np
import pandas as pd
from scipy.special import ndtr

from rrru.arrays import BoolArray, FloatArray
from rrru.diagnosis.discrepancy_basis import UNKNOWN
from rrru.diagnosis.evidence import ModelEvidence
from rrru.diagnosis.hypothesis import Hypothesis
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.state import LeftByCalibration
from rrru.diagnosis.terms import signatures, spread
from rrru.estimation.noise_model import CONTRADICTED, NoiseModel

COLUMNS = ("part", "kind", "rms_mm", "share", "share_low", "share_high", "probability")
_UNEXPLAINED = "unexplained"


def budget(
    inference: InferenceResult, stated_mm: float | None, generator: np.random.Generator, draws: int
) -> pd.DataFrame:
    """Rows of `gap_budget` without the campaign; stated_mm: the instrument's noise per axis, None where unknown."""
    left = LeftByCalibration(inference.evidence.linear.calibration_basis, inference.problem.on_robot)
    squares, acting, products = _drawn(inference, left, generator, draws)
    instrument_mm2, noise = _noise_parts(inference, stated_mm, generator, draws)
    residual = inference.problem.residual(inference.calibrated)
    instrument = float(instrument_mm2.mean())
    # the residuals have the share of the noise that the calibration leaves
    measured = float((residual[inference.problem.on_robot] ** 2).sum(axis=1).mean()) - instrument * (1.0 - left.taken)
    posterior = inference.posterior
    unexplained = squares.pop(_UNEXPLAINED)
    rows = [(name, "effect", drawn, posterior.marginal(name)) for name, drawn in squares.items()]
    rows += [(name, name, *drawn) for name, drawn in noise.items()]
    rows.append((_UNEXPLAINED, _UNEXPLAINED, unexplained, posterior.probability_unexplained))
    least = OPTIONS.min_covariance_share * max(measured, 1e-12)
    large = {pair: drawn for pair, drawn in products.items() if abs(drawn.mean()) > least}
    rows += [(" and ".join(pair), "covariance", drawn, np.nan) for pair, drawn in large.items()]
    parts = np.sum([drawn for _, _, drawn, _ in rows], axis=0)
    calibration = instrument / 3.0 * left.error(generator, draws)
    rows.append(("sampling", "sampling", np.array([measured - parts.mean()]), np.nan))
    rows.append(("calibration", "calibration", calibration, np.nan))
    whole = parts + calibration
    given = {name: acts for name, acts in acting.items() if posterior.marginal(name) >= OPTIONS.min_named_probability}
    made = [_row(*row, whole, given.get(row[0]) if row[1] == "effect" else None) for row in rows]
    return pd.DataFrame(made, columns=COLUMNS)


def _row(
    part: str, kind: str, squares: FloatArray, probability: float, whole: FloatArray, given: BoolArray | None = None
) -> tuple[str, str, float, float, float, float, float]:
    """One row of draws (b,) of a mean square, which may be negative where it is a product, and of the gap (b,).

    given: draws (b,) that the interval is of, None for all. That of an effect that is probable enough for a name is
    that given that it acts: how probable that is has a column of its own.
    """
    mean, total = float(squares.mean()), float(whole.mean())
    shares = squares / np.where(whole > 0.0, whole, np.inf)
    counted = shares if given is None else shares[given]
    share = mean / total if total > 0.0 else 0.0
    low, high = np.quantile(counted, OPTIONS.interval_quantiles) if len(counted) else (share, share)
    rms = float(np.sign(mean) * np.sqrt(abs(mean)))
    return part, kind, rms, share, float(min(low, share)), float(max(high, share)), float(probability)


def _drawn(
    inference: InferenceResult, left: LeftByCalibration, generator: np.random.Generator, draws: int
) -> tuple[dict[str, FloatArray], dict[str, BoolArray], dict[tuple[str, str], FloatArray]]:
    """Draws (b,) of mean squares, of effects and of what is unexplained, by name, in which of them each acts, and draws
    of products of two of them.
    """
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
        parts = _parts(evidence, posterior.hypotheses[row], level, left, generator, counts[number])
        for name in set(parts) & set(squares):
            squares[name][some] = (parts[name] ** 2).sum(axis=0) / count
        for name in set(parts) & set(acting):
            acting[name][some] = True
        for pair in products:
            if set(pair) <= set(parts):
                products[pair][some] = 2.0 * (parts[pair[0]] * parts[pair[1]]).sum(axis=0) / count
        if posterior.unexplained[row, level] and (lacks_fit or _UNEXPLAINED not in parts):
            beyond = data - sum(parts.values(), np.zeros((len(data), counts[number])))
            spare = 3.0 * problem.noise_mm**2 * (1.0 - left.taken)
            squares[_UNEXPLAINED][some] += np.maximum((beyond**2).sum(axis=0) / count - spare, 0.0)
    return squares, acting, products


def _parts(
    evidence: ModelEvidence,
    hypothesis: Hypothesis,
    level: int,
    left: LeftByCalibration,
    generator: np.random.Generator,
    count: int,
) -> dict[str, FloatArray]:
    """By effect of a hypothesis its part of the gap (3n, count) beyond the calibration, at drawn coefficients.

    left: a LeftByCalibration. Those of discrepancy functions together are the unexplained part.
    """
    if not hypothesis.terms:
        return {}
    mean, covariance = evidence.coefficients(hypothesis.terms, hypothesis.prior_scales[level], level)
    # coefficients have very different sizes
    unit = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    size, turned = np.linalg.eigh(covariance / np.outer(unit, unit))
    shaken = unit[:, None] * turned * np.sqrt(np.maximum(size, 0.0))
    drawn = mean[:, None] + shaken @ generator.standard_normal((len(mean), count))
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


def _noise_parts(
    inference: InferenceResult, stated_mm: float | None, generator: np.random.Generator, draws: int
) -> tuple[FloatArray, dict[str, tuple[FloatArray, float]]]:
    """Draws (b,) of the instrument's mean square, and by name draws and probability of scatter and runs."""
    problem = inference.problem
    model = problem.noise or NoiseModel.white(problem.noise_mm)
    # of each axis: a parameter takes one of the numbers of all three
    freedom = max(len(problem) - inference.evidence.linear.calibration_basis.shape[1] / 3.0, 1.0)
    axes = model.axis_mm**2 * (1.0 + np.sqrt(2.0 / freedom) * generator.standard_normal((draws, 3)))
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
