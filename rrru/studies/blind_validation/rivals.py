"""Other methods to find the cause of a gap, compared with the diagnosis on the same measurements and stated noise.

Bayes' information criterion of linear signatures (G. Schwarz, Annals of Statistics 6, 1978), the lasso with that
criterion (H. Zou, T. Hastie, R. Tibshirani, Annals of Statistics 35, 2007) over resampled points, a spike and slab on
linear signatures by Gibbs sampling (E. George, R. McCulloch, JASA 88, 1993), and a Gaussian process for whatever is
left (M. C. Kennedy, A. O'Hagan, J. R. Stat. Soc. B 63, 2001), which names nothing.
"""

import json
import warnings
from collections import Counter
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from time import perf_counter

import numpy as np
import pandas as pd
from scipy.linalg import solve_triangular

from rrru.calibration.calibrate import calibrate
from rrru.calibration.campaign_fit import select
from rrru.campaign import measurements as rows
from rrru.diagnosis.diagnose import diagnose, with_wide_bounds
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import ModelState
from rrru.diagnosis.terms import EACH, signatures, variants
from rrru.seeds import stream
from rrru.studies.blind_validation.verdicts import NONE, UNEXPLAINED, in_order

_RESAMPLINGS, _FOLDS = 50, 5
# Gibbs sweeps over all effects, number of first ones that are dropped; prior probability that an effect acts; prior
# standard deviations of its coefficients on columns of unit length, in units of the noise
_SWEEPS, _DROPPED, _PRIOR_PROBABILITY = 1500, 300, 0.1
_SLABS = np.geomspace(3.0, 1000.0, 6)
# relative singular value below which a column of a set does not count
_RANK_TOLERANCE = 1e-5
# a column with a smaller fraction after projection onto the complement of the calibration is not visible
_MIN_VISIBLE_SHARE = 1e-6
# the hyperparameters of the Gaussian process are fitted to every k-th point: to this number of points, up to twice it
_HYPERPARAMETER_POINTS = 250
_SCALAR_INPUTS = ("time_s", "speed_mm_s", "payload_kg")


@dataclass(frozen=True)
class Campaign:
    """Input of all methods for n points.

    data (3n,), base (3n, p): data and columns of the calibration, in units of the stated noise; columns: those (3n, k)
    of every EffectTerm that the diagnosis tries: effect, shape and legs.
    """

    problem: DiagnosisProblem
    data: np.ndarray
    base: np.ndarray
    columns: dict

    @classmethod
    def of(cls, measurements, known, library):
        """The campaign of a measurement table of a MeasuredRobot, linearised about its calibration."""
        mechanism = with_wide_bounds(known.mechanism)
        problem = make_diagnosis_problem(measurements, mechanism, known.masses, known.noise_mm, library)
        calibrated = ModelState(calibrate(select(measurements, mechanism, ["*"])).deviations, {})
        # the diagnosis searches the waves of effects with many coefficients; these have no fixed signatures
        effects = {name: effect for name, effect in problem.effects.items() if not effect.coordinates.broad}
        keys = [(name, k) for name, effect in effects.items() for k in range(len(effect.coordinates.shapes))]
        linear = problem.linearise(calibrated, keys)
        terms = [term for effect in effects.values() for term in variants(effect)]
        made = [linear.data, linear.base, *signatures(effects, linear, terms)]
        data, base, *columns = (one.reshape(3 * len(problem), -1) / problem.noise_mm for one in made)
        return cls(problem, data[:, 0], base, dict(zip(terms, columns, strict=True)))


def _unit(columns, base):
    """Columns (n, k) projected onto the complement of base (n, p), of unit length; zero where nothing remains."""
    basis, _ = np.linalg.qr(base)
    projected, whole = columns - basis @ (basis.T @ columns), np.linalg.norm(columns, axis=0)
    size = np.linalg.norm(projected, axis=0)
    visible = size > _MIN_VISIBLE_SHARE * whole
    return np.where(visible, projected / np.where(visible, size, 1.0), 0.0)


def _projected_data(campaign):
    """The data (3n,) of a campaign, projected onto the complement of the calibration's columns."""
    basis, _ = np.linalg.qr(campaign.base)
    return campaign.data - basis @ (basis.T @ campaign.data)


class _Reduced:
    """A campaign without what the calibration absorbs: gram (k, k), moment (k,) of all columns of unit length with the
    data, data (3n,), and the numbers of the columns of each term.
    """

    def __init__(self, campaign):
        self.data = _projected_data(campaign)
        unit = _unit(np.concatenate(list(campaign.columns.values()), axis=1), campaign.base)
        self.gram, self.moment = unit.T @ unit, unit.T @ self.data
        ends = np.cumsum([columns.shape[1] for columns in campaign.columns.values()])
        self.numbers = np.split(np.arange(ends[-1]), ends[:-1])


def bayes_information(campaign):
    """Probability by set of up to two effects: exp(-BIC / 2) of the best choice of their shapes and legs."""
    terms, reduced, best = list(campaign.columns), _Reduced(campaign), {NONE: 0.0}
    pairs = (pair for pair in combinations(range(len(terms)), 2) if terms[pair[0]].effect != terms[pair[1]].effect)
    for chosen in (*((k,) for k in range(len(terms))), *pairs):
        index = np.concatenate([reduced.numbers[k] for k in chosen])
        gain, rank = _explained(reduced.gram[np.ix_(index, index)], reduced.moment[index])
        effects = _label(terms[k].effect for k in chosen)
        best[effects] = max(0.5 * (gain - rank * np.log(len(reduced.data))), best.get(effects, -np.inf))
    weights = np.exp(np.array(list(best.values())) - max(best.values()))
    return dict(zip(best, (weights / weights.sum()).tolist(), strict=True))


def _explained(gram, moment):
    """Reduction of the sum of squares by columns, from their Gram matrix (k, k) and moments (k,), and their rank."""
    size, turned = np.linalg.eigh(gram)
    used = size > _RANK_TOLERANCE**2 * max(size[-1], 1e-300)
    return float(((turned[:, used].T @ moment) ** 2 / size[used]).sum()), int(used.sum())


def lasso(campaign, generator):
    """Fraction of resamplings of the points, by the set of effects with a nonzero coefficient of the lasso."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.linear_model import LassoLarsIC

    chosen = {term: columns for term, columns in campaign.columns.items() if term.legs == EACH}
    owner = np.repeat([term.effect for term in chosen], [columns.shape[1] for columns in chosen.values()])
    columns, points = np.concatenate(list(chosen.values()), axis=1), len(campaign.data) // 3
    found = Counter()
    for _ in range(_RESAMPLINGS):
        drawn = (3 * generator.integers(points, size=points)[:, None] + np.arange(3)).ravel()
        base = campaign.base[drawn]
        data = campaign.data[drawn] - base @ np.linalg.lstsq(base, campaign.data[drawn], rcond=None)[0]
        model = LassoLarsIC(criterion="bic", fit_intercept=False, noise_variance=1.0)
        with warnings.catch_warnings():
            # identical columns differ by rounding only
            warnings.simplefilter("ignore", ConvergenceWarning)
            model.fit(_unit(columns[drawn], base), data)
        found[_label(owner[model.coef_ != 0.0].tolist())] += 1
    return {effects: count / _RESAMPLINGS for effects, count in found.items()}


def spike_and_slab(campaign, generator):
    """Fraction of a Gibbs sampler's sweeps, by the set of effects with nonzero coefficients.

    Each effect acts with the same probability, in one of its shapes and choices of legs and with one of `_SLABS` for
    all its coefficients, with equal prior probabilities; coefficients are marginalised.
    """
    reduced, choices = _Reduced(campaign), {}

    @cache
    def marginal(*chosen):
        """`_marginal`, cached: most states of the sampler recur."""
        return _marginal(reduced, chosen)

    for number, term in enumerate(campaign.columns):
        choices.setdefault(term.effect, []).append(number)
    state, found = {}, Counter()
    for sweep in range(_SWEEPS):
        for effect, terms_of_effect in choices.items():
            others = [term for name, term in state.items() if name != effect]
            slab = state[effect][1] if effect in state else generator.choice(_SLABS)
            log = [marginal(*others, (number, slab)) for number in terms_of_effect]
            log_without = marginal(*others) + np.log(len(terms_of_effect) * (1.0 / _PRIOR_PROBABILITY - 1.0))
            log = np.array([log_without, *log])
            chosen = _drawn_index(log, generator)
            state.pop(effect, None)
            if chosen:
                term = terms_of_effect[chosen - 1]
                log = [marginal(*others, (term, slab)) for slab in _SLABS]
                state[effect] = term, _SLABS[_drawn_index(np.array(log), generator)]
        if sweep >= _DROPPED:
            found[_label(state)] += 1
    return {effects: count / (_SWEEPS - _DROPPED) for effects, count in found.items()}


def _drawn_index(log, generator):
    """A random index with the logarithms (n,) of its weights."""
    weights = np.exp(log - log.max())
    return int(generator.choice(len(weights), p=weights / weights.sum()))


def _marginal(reduced, chosen):
    """Log marginal likelihood ratio of chosen pairs (number of a term, slab) to no term, coefficients marginalised."""
    if not chosen:
        return 0.0
    index = np.concatenate([reduced.numbers[number] for number, _ in chosen])
    scale = np.concatenate([np.full(len(reduced.numbers[number]), slab) for number, slab in chosen])
    factor = np.linalg.cholesky(scale[:, None] * reduced.gram[np.ix_(index, index)] * scale + np.eye(len(index)))
    half = solve_triangular(factor, scale * reduced.moment[index], lower=True, check_finite=False)
    return 0.5 * half @ half - np.log(np.diag(factor)).sum()


def gaussian_process(campaign):
    """Fraction of the gap predicted on held-out runs by a Gaussian process of place, direction, time, speed, payload.

    NaN where no residual exceeds the noise.
    """
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel
    from sklearn.model_selection import GroupKFold

    points, residual = campaign.problem.points, _projected_data(campaign).reshape(-1, 3)
    inputs = np.column_stack(
        [rows.command(points), rows.direction(points), points[list(_SCALAR_INPUTS)].to_numpy(dtype=float)]
    )
    inputs = inputs[:, np.ptp(inputs, axis=0) > 0.0]
    inputs = (inputs - inputs.mean(axis=0)) / inputs.std(axis=0)
    subset = slice(None, None, max(len(inputs) // _HYPERPARAMETER_POINTS, 1))
    kernel = ConstantKernel(1.0, (1e-3, 1e5)) * RBF(np.ones(inputs.shape[1]), (1e-1, 1e3))
    with warnings.catch_warnings():
        # a length scale at its bound is valid: that input does not matter
        warnings.simplefilter("ignore")
        kernel = GaussianProcessRegressor(kernel, alpha=1.0).fit(inputs[subset], residual[subset]).kernel_
    after = np.empty_like(residual)
    runs = points["run"].to_numpy()
    for training, held_out in GroupKFold(min(_FOLDS, len(np.unique(runs)))).split(inputs, groups=runs):
        model = GaussianProcessRegressor(kernel, alpha=1.0, optimizer=None).fit(inputs[training], residual[training])
        after[held_out] = residual[held_out] - model.predict(inputs[held_out])
    gaps = [max((one**2).sum(axis=1).mean() - 3.0, 0.0) for one in (residual, after)]
    return float(1.0 - gaps[1] / gaps[0]) if gaps[0] > 0.0 else np.nan


def _label(effects):
    """Names of effects, each once, in the order of a verdict."""
    return in_order("+".join(set(effects))) or NONE


def beliefs(measurements, known, settings):
    """Frame `withheld_beliefs` of a measurement table of a MeasuredRobot, by GapSettings."""
    found = []
    for method, answer in _METHODS.items():
        start = perf_counter()
        effects, probabilities, share = answer(measurements, known, settings)
        said = {"effects": effects, "probabilities": json.dumps(probabilities) if probabilities else ""}
        found.append({"method": method, **said, "share_closed": share, "seconds": perf_counter() - start})
    return pd.DataFrame(found).assign(robot=known.campaign)


def _by_diagnosis(measurements, known, settings):
    """Verdict, probability by set of effects with all unexplained sets as one, and explained fraction."""
    result = diagnose(measurements, known, settings, details=False)
    probabilities = {}
    for (effects, unexplained), probability in result.inference.posterior.sets.items():
        name = UNEXPLAINED if unexplained else in_order("+".join(effects)) or NONE
        probabilities[name] = probabilities.get(name, 0.0) + probability
    return result.verdict["effects"], probabilities, result.verdict["share_closed"]


def _by_probabilities(method, *labels):
    """The same of a method that gives the probability of each set; labels: of its random stream, if it has one.

    The most probable set, ties broken by name, with all probabilities and no explained fraction.
    """

    def answer(measurements, known, settings):
        generators = [stream(settings.seed, label, known.campaign) for label in labels]
        probabilities = method(_campaign(measurements, known, settings), *generators)
        return max(sorted(probabilities), key=probabilities.get), probabilities, np.nan

    return answer


def _campaign(measurements, known, settings):
    """The Campaign of a measurement table of a MeasuredRobot, by GapSettings."""
    return Campaign.of(measurements, known, settings.library(known.mechanism))


_METHODS = {
    "diagnosis": _by_diagnosis,
    "bic": _by_probabilities(bayes_information),
    "lasso": _by_probabilities(lasso, "lasso"),
    "spike_and_slab": _by_probabilities(spike_and_slab, "spike_and_slab"),
    "gaussian_process": lambda *given: ("", {}, gaussian_process(_campaign(*given))),
}
