"""Which effects cause the gap: calibrate, search the best set, fit it on the exact model, search again from there."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import chdtri

from rrru.arrays import BoolArray, FloatArray
from rrru.campaign import noise
from rrru.campaign.outliers import isolated
from rrru.diagnosis.aliases import EffectKey
from rrru.diagnosis.calibrate import calibrate, origin
from rrru.diagnosis.detectability import with_seen
from rrru.diagnosis.discrepancy_basis import JUMPS, UNKNOWN
from rrru.diagnosis.drive_spectra import with_orders, with_spectra
from rrru.diagnosis.evidence import ModelEvidence
from rrru.diagnosis.heldout import HeldOut
from rrru.diagnosis.hypothesis import Answer, Hypothesis
from rrru.diagnosis.model_fit import EffectModel, ModelFit, fit_model
from rrru.diagnosis.model_space import ModelSpace
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.posterior import Posterior
from rrru.diagnosis.prediction_errors import prediction_errors
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.settings import Prior
from rrru.diagnosis.state import LinearizedProblem, ModelState
from rrru.diagnosis.terms import EffectTerm, each_leg, shape_probabilities
from rrru.diagnosis.time_jumps import with_jumps
from rrru.diagnosis.whitened import DISCREPANCY_SCALES, spectrum
from rrru.effects.library import HOLDS
from rrru.effects.protocol import Coordinates
from rrru.errors import FitError
from rrru.estimation.noise_model import (
    MIN_FREE_MEANS,
    MIN_FREE_NUMBERS,
    BlockTests,
    alike,
    fit_noise,
    free_numbers,
    high_frequency_noises,
)

# what the configuration says of the noise
KNOWN, STATED, UNKNOWN_NOISE = "known", "stated", "unknown"
# source of a noise that poses say that were measured again
REPEATS = "repeats"


@dataclass(frozen=True)
class InferenceResult:
    """What the search has found.

    origin: where calibrations start; calibrated: of the calibration alone, under the noise that was found;
    fit: ModelFit of the hypothesis at its discrepancy level; evidence: on the last linearisation;
    posterior over all hypotheses; hypothesis, level: the best one and its discrepancy level; noise_from: "given",
    "repeats" or "fitted"; dropped: number of points left out as outliers.
    """

    problem: DiagnosisProblem
    origin: ModelState
    calibrated: ModelState
    fit: ModelFit
    evidence: ModelEvidence
    posterior: Posterior
    hypothesis: Hypothesis
    level: int
    noise_from: str = "given"
    dropped: int = 0

    @property
    def state(self) -> ModelState:
        """The ModelState of the fit."""
        return self.fit.state

    @cached_property
    def held_out(self) -> HeldOut:
        """Predictions of left-out points."""
        return HeldOut(self.problem, self.evidence)

    @property
    def log_likelihood(self) -> float:
        """Logarithm of the marginal likelihood of the readings under the noise, up to a constant of the readings."""
        return _log_likelihood(self.evidence, self.posterior)

    @property
    def lacks_fit(self) -> bool:
        """Whether stops in no order leave clearly more than the noise of repeated poses, whatever is fitted.

        No function of the discrepancy follows an error that differs from stop to stop, so that the evidence of none is
        larger than that of the calibration alone (lack of fit against pure error: Draper and Smith, Applied regression
        analysis, 1998).
        """
        problem = self.problem
        if self.noise_from != REPEATS or problem.along_paths:
            return False
        residual = problem.residual(self.state)
        freedom = max(residual.size - len(self.fit.estimate.parameters), 1)
        left_mm = float(np.sqrt((residual**2).sum() / freedom))
        return left_mm > OPTIONS.min_left_per_repeats * problem.noise_mm

    def with_posterior(self, posterior: Posterior) -> "InferenceResult":
        """The inference with another posterior and its best hypothesis; the fit stays."""
        hypothesis, level = posterior.best()
        return replace(self, posterior=posterior, hypothesis=hypothesis, level=level)


def with_characteristic_length(
    problem: DiagnosisProblem, noise_mm: float | None = None, noise_rad: float | None = None
) -> DiagnosisProblem:
    """The problem with orientations at the arm that gives them the positions' noise; what is not given is estimated.

    What no effect of the library makes passes for noise in an estimate of poses in no order, in positions as in
    orientations. The arm is therefore the ratio of two estimates, or of two given numbers.
    """
    if not (noise_mm and noise_rad):
        linear, columns = _few(problem, calibrate(problem))
        found, turned = high_frequency_noises(linear.data, columns, problem.series, problem.positions)
        if noise_rad:
            found = noise_mm or noise.quieter_repeats(problem.measurements[problem.used], found) or found
        noise_mm, noise_rad = found, noise_rad or turned / problem.characteristic_length_mm
    return replace(problem, characteristic_length_mm=noise_mm / noise_rad)


def with_world_scale(problem: DiagnosisProblem) -> DiagnosisProblem:
    """The problem with reflectors off the robot weighted by the ratio of the residuals of a fit of everything."""
    if not problem.on_world.any() or problem.on_world.all():
        return problem
    linear, columns = _few(problem, calibrate(problem))
    flat = columns.reshape(linear.data.size, -1)
    size = np.maximum(np.linalg.norm(flat, axis=0), 1e-300)
    fitted = flat / size @ np.linalg.lstsq(flat / size, linear.data.ravel(), rcond=1e-9)[0]
    squares = ((linear.data.ravel() - fitted).reshape(-1, 3) ** 2).sum(axis=1)
    others = problem.positions & ~problem.on_world
    scale = np.sqrt(squares[others].mean() / max(squares[problem.on_world].mean(), 1e-12))
    return replace(problem, beside_scale=float(scale))


def with_noise(
    problem: DiagnosisProblem, linear: LinearizedProblem, stated_mm: float | None, follow_means: bool = True
) -> tuple[DiagnosisProblem, str]:
    """The problem under the noise that a fit of all columns of a linearisation leaves, and the source of that noise.

    "fitted", see `rrru.estimation.noise_model`, or "repeats" where poses that were measured again say clearly less.
    follow_means: whether functions of the discrepancy are among the columns, which can follow the means of all series.
    """
    repeats, complete = noise.repeat_noise(problem.measurements[problem.used]), problem.complete(problem.library)
    if 3 * complete.sum() < linear.base.shape[-1] + MIN_FREE_NUMBERS:
        complete[:] = True
    known = bool(stated_mm) or repeats[1] >= noise.ENOUGH_REPEATS
    columns, prior_sd = _noise_columns(problem, linear, known) if follow_means else _least_columns(problem, linear)
    # an effect is no noise where its inputs are unknown
    data, columns, series = linear.data[complete], columns[complete], problem.series[complete]
    discrepancy = spectrum if problem.along_paths else None
    model = fit_noise(data, columns, series, stated_mm, repeats, discrepancy, prior_sd)
    over_noise = None if prior_sd is None else prior_sd / model.mean_mm
    stops = alike(data, columns, problem.stop[complete], problem.kind[complete], over_noise)
    model = replace(model, alike=stops)
    repeated = noise.quieter_repeats(problem.measurements[problem.used], model.mean_mm, model.correlation, model.offset)
    if repeated is not None:
        return problem.under(model.of_size(repeated)), REPEATS
    return problem.under(model), "fitted"


def _noise_columns(
    problem: DiagnosisProblem, linear: LinearizedProblem, known: bool
) -> tuple[FloatArray, FloatArray | None]:
    """Columns (m, 3, k) that may explain the readings while the noise is estimated, and their prior s.d. (k,).

    All of the library, with coefficients of which nothing is known: prior_sd is None. Where these leave too few
    numbers: the coefficients of rough functions, whose spectrum the readings have chosen, with the prior of that
    spectrum, all others with an infinite s.d. Then without effects of many coefficients, then each effect in the best
    shape alone, then without the functions of the discrepancy. known: whether the noise is known otherwise, so that no
    number needs to be left. Where it is not and the library explains everything, the residuals of the calibration are
    used.
    """
    blocks, searched = _blocks(problem, linear)
    for chosen, prior_sd in _fewer_blocks(problem, linear, blocks):
        columns = _with_base(linear, chosen)
        if _leaves_enough(problem, linear, columns, prior_sd):
            return _with_significant(problem, linear, (columns, prior_sd), searched)
    return (columns if known else linear.base), None


def _with_base(linear: LinearizedProblem, blocks: Mapping[EffectKey, FloatArray]) -> FloatArray:
    """Columns (m, 3, k) of the calibration, of blocks, and of the shapes that are fitted."""
    return np.concatenate([linear.base, *blocks.values(), *linear.shape_columns.values()], axis=-1)


def _least_columns(problem: DiagnosisProblem, linear: LinearizedProblem) -> tuple[FloatArray, FloatArray | None]:
    """As `_noise_columns`, of the last step of `_fewer_blocks`, but with rough functions; without jumps."""
    blocks, searched = _blocks(problem, linear)
    searched = {key: columns for key, columns in searched.items() if key[0] not in JUMPS}
    steps = list(_fewer_blocks(problem, linear, blocks))
    chosen, prior_sd = ([step for step in steps if step[1] is not None] or steps)[-1]
    columns = _with_base(linear, chosen)
    return _with_significant(problem, linear, (columns, prior_sd), searched)


def _blocks(
    problem: DiagnosisProblem, linear: LinearizedProblem
) -> tuple[dict[EffectKey, FloatArray], dict[EffectKey, FloatArray]]:
    """Blocks of columns by (effect, shape), and apart from them those of shapes and jumps found in these data."""
    blocks = {key: columns for key, columns in linear.columns.items() if key[0] in problem.library}
    found = [key for key in blocks if key[0] in JUMPS or _is_searched(problem.library[key[0]].coordinates, key[1])]
    searched = {key: blocks.pop(key) for key in found}
    return blocks, searched


def _leaves_enough(
    problem: DiagnosisProblem, linear: LinearizedProblem, columns: FloatArray, prior_sd: FloatArray | None = None
) -> bool:
    """Whether columns (m, 3, k) leave enough of the numbers for an estimate of the noise; prior_sd (k,), or None."""
    count = linear.data.size
    free = count - columns.shape[-1] if prior_sd is None else free_numbers(columns, prior_sd / problem.noise_mm)
    return _is_enough(linear, free)


def _is_enough(linear: LinearizedProblem, free: float) -> bool:
    """Whether so many degrees of freedom are enough for an estimate of the noise."""
    return bool(free >= max(MIN_FREE_NUMBERS, OPTIONS.min_free_share * linear.data.size))


def _is_searched(coordinates: Coordinates, shape: int) -> bool:
    """Whether a shape of an effect was found in these data, see `rrru.diagnosis.drive_spectra`."""
    return coordinates.searched is not None and 0 < coordinates.stated <= shape


def _with_significant(
    problem: DiagnosisProblem,
    linear: LinearizedProblem,
    chosen: tuple[FloatArray, FloatArray | None],
    searched: dict[EffectKey, FloatArray],
) -> tuple[FloatArray, FloatArray | None]:
    """Columns (m, 3, k) and their prior s.d., and those of each searched shape that explains more than noise does.

    The best of many orders or moments explains more of pure noise than its number of columns: with it the noise would
    be found too low. The F test is at a level that their prior probabilities share out (weighted Bonferroni:
    Genovese, Roeder and Wasserman, False discovery control with p-value weighting, Biometrika 93, 2006).
    """
    (columns, prior_sd), accepted = chosen, []
    if not searched:
        return chosen
    tests = BlockTests(linear.data, np.concatenate([columns, *searched.values()], axis=-1))
    present, first = np.arange(columns.shape[-1]), columns.shape[-1]
    for (name, shape), block in searched.items():
        own = np.arange(first, first + block.shape[-1])
        first += len(own)
        if prior_sd is None and not _is_enough(linear, linear.data.size - len(present) - len(own)):
            continue
        p_value, free = tests.of(present, own, None if prior_sd is None else prior_sd / problem.noise_mm)
        coordinates = problem.library[name].coordinates
        level = OPTIONS.max_searched_p * shape_probabilities(coordinates)[shape] * np.exp(coordinates.log_prior)
        if p_value < level and (prior_sd is None or _is_enough(linear, free)):
            accepted.append(block)
            present = np.concatenate([present, own])
            prior_sd = None if prior_sd is None else np.append(prior_sd, np.full(len(own), np.inf))
    return np.concatenate([columns, *accepted], axis=-1), prior_sd


def _fewer_blocks(
    problem: DiagnosisProblem, linear: LinearizedProblem, blocks: dict[EffectKey, FloatArray]
) -> Iterator[tuple[dict[EffectKey, FloatArray], FloatArray | None]]:
    """Blocks of columns by (effect, shape), in steps less free, and the prior s.d. (k,) of all columns with them.

    None for these where nothing is known of any coefficient.
    """
    library = problem.library
    yield blocks, None
    few = {key: columns for key, columns in blocks.items() if not library[key[0]].coordinates.broad}
    fitting = _best_shapes(linear, few)
    steps = few, fitting, {key: columns for key, columns in fitting.items() if key[0] not in UNKNOWN}
    rough, rough_sd = {}, []
    for key, columns in blocks.items():
        coordinates = library[key[0]].coordinates
        if coordinates.sized:
            err = np.isin(coordinates.legs, coordinates.sized)
            rough[key] = columns[..., err]
            rough_sd.append(coordinates.typical[err])
    for step in steps if rough else ():
        free = [columns.shape[-1] for columns in (linear.base, *step.values())]
        after = sum(columns.shape[-1] for columns in linear.shape_columns.values())
        sd = np.concatenate([np.full(sum(free), np.inf), *rough_sd, np.full(after, np.inf)])
        yield step | rough, sd
    for step in steps:
        yield step, None


def _best_shapes(linear: LinearizedProblem, blocks: dict[EffectKey, FloatArray]) -> dict[EffectKey, FloatArray]:
    """For each effect the block of columns with the smallest residuals together with the calibration."""
    basis, _ = np.linalg.qr(linear.base.reshape(linear.data.size, -1))
    best: dict[str, tuple[float, EffectKey]] = {}
    for key, columns in blocks.items():
        flat = columns.reshape(linear.data.size, -1)
        flat = flat - basis @ (basis.T @ flat)
        size = np.maximum(np.linalg.norm(flat, axis=0), 1e-300)
        coefficients = np.linalg.lstsq(flat / size, linear.data.ravel(), rcond=1e-9)[0]
        explained = float(((flat / size @ coefficients) ** 2).sum())
        if explained > (best[key[0]][0] if key[0] in best else -np.inf):
            best[key[0]] = explained, key
    return {key: blocks[key] for _, key in best.values()}


def _few(problem: DiagnosisProblem, calibrated: ModelState) -> tuple[LinearizedProblem, FloatArray]:
    """The linearisation about a calibration, and the columns (m, 3, k) of all effects with few coefficients.

    Where these would leave less than a third of the numbers free, those of each effect in the best shape alone. Where
    these would, too, the calibration's columns alone.
    """
    few = {name: effect for name, effect in problem.library.items() if not effect.coordinates.broad}
    linear = replace(problem, library=few).linearise(calibrated)
    for blocks in (linear.columns, _best_shapes(linear, linear.columns)):
        columns = np.concatenate([linear.base, *blocks.values()], axis=-1)
        if columns.shape[-1] <= 2 * len(problem):
            return linear, columns
    return linear, linear.base


def infer(problem: DiagnosisProblem, prior: Prior, stated: str = KNOWN) -> InferenceResult:
    """InferenceResult of a problem; stated: whether its noise is KNOWN, STATED within limits, or UNKNOWN_NOISE."""
    total = problem.count
    for cleaning in range(OPTIONS.max_outlier_rounds + 1):
        calibrated = calibrate(problem)
        if stated == UNKNOWN_NOISE:
            # isolated outliers would be taken for noise
            outliers = isolated(problem.residual(calibrated), problem.series, 0.0, problem.kind)
            # a reading that was approached from the other side than its neighbours is no outlier
            outliers &= problem.complete(problem.library)
            if outliers.any():
                problem = problem.without(outliers)
                calibrated = calibrate(problem)
        problem = problem.standing(calibrated)
        inference = _rounds(problem, calibrated, prior, stated)
        if stated != KNOWN:
            inference = _with_hidden_offsets(inference, prior, problem.noise_mm if stated == STATED else None)
        outliers = _outliers(inference)
        if cleaning == OPTIONS.max_outlier_rounds or not outliers.any():
            break
        problem = problem.without(outliers)
    return replace(inference, dropped=total - problem.count)


def _outliers(inference: InferenceResult) -> BoolArray:
    """Rows (m,) that stand alone under an inference, or are explained by an effect that they alone support.

    An effect of many coefficients supports a reading where the other stops predict it better with the effect than
    without it. Where something is unexplained a reading may follow that.
    """
    problem, effects = inference.problem, inference.hypothesis.effects
    found = isolated(problem.residual(inference.state), problem.series, problem.noise_mm, problem.kind)
    broad = {name for name in effects if problem.library[name].coordinates.broad}
    if found.any() or not broad or inference.level or not effects.isdisjoint(UNKNOWN):
        return found
    fitted = np.isin(problem.at, inference.fit.model.problem.at)
    predicted = prediction_errors(inference.fit)
    found[fitted] = isolated(predicted, problem.series[fitted], problem.noise_mm, problem.kind[fitted])
    if not found.any():
        return found
    apart = with_effects(inference, effects - broad)
    residual = apart.problem.residual(apart.state)
    found &= isolated(residual, problem.series, problem.noise_mm, problem.kind)
    found[fitted] &= (predicted**2).sum(axis=1) > OPTIONS.max_unsupported_share * (residual[fitted] ** 2).sum(axis=1)
    return found


def with_effects(inference: InferenceResult, effects: Collection[str]) -> InferenceResult:
    """The inference with hypothesis and fit of exactly the named effects; the posterior stays."""
    same = inference.hypothesis.effects == frozenset(effects)
    known = (inference.hypothesis, inference.level) if same else inference.posterior.best_of(frozenset(effects))
    if known is None:
        terms = tuple(term for term in inference.hypothesis.terms if term.effect in effects)
        found, prior_scales = np.full(len(DISCREPANCY_SCALES), -np.inf), np.ones((len(DISCREPANCY_SCALES), len(terms)))
        for index in inference.evidence.levels:
            found[index], prior_scales[index] = inference.evidence.over_all_strengths(terms, index)
        # what a discrepancy function explains with them is a discrepancy without it
        known = Hypothesis(terms, found, prior_scales), int(found.argmax())
    hypothesis, level = known
    starts = (inference.fit.state, inference.origin) if hypothesis.terms else (inference.calibrated,)
    fit = fit_hypothesis(inference.problem, inference.evidence, starts, (hypothesis, level), inference.fit)
    problem = inference.problem.with_approach(fit.state)
    return replace(inference, problem=problem, hypothesis=hypothesis, level=level, fit=fit)


def fit_hypothesis(
    problem: DiagnosisProblem,
    evidence: ModelEvidence,
    starts: Iterable[ModelState],
    chosen: Answer,
    known: ModelFit | None = None,
) -> ModelFit:
    """ModelFit of a hypothesis at a level (an index), under the priors that the evidence has chosen for it.

    It is fitted to the readings at which all its effects have what they need. Where one value for all legs is probable
    enough each leg still gets its own: that they are equal is not known, and the errors say so. chosen: both; known: a
    ModelFit that may be the one asked for.
    """
    hypothesis, level = chosen
    problem, terms = problem.at_complete(hypothesis.effects), tuple(map(each_leg, hypothesis.terms))
    scales = evidence.scales(terms, hypothesis.prior_scales[level])
    if known and known.level == level and known.model.same_as(EffectModel(problem, terms, scales)):
        return known
    return fit_model(problem, starts, terms, scales, level)


class _Linearization:
    """Problem, columns and noise at a state, with the harmonics, spectra and jumps that the residuals show there."""

    def __init__(self, stated: str, stated_mm: float) -> None:
        self._stated, self._stated_mm = stated, stated_mm
        self._source: str | None = None

    def at(
        self,
        problem: DiagnosisProblem,
        state: ModelState,
        terms: Sequence[EffectTerm] = (),
        noise_again: bool = False,
    ) -> tuple[DiagnosisProblem, LinearizedProblem, str]:
        """Problem with harmonics, jumps and noise, its linearisation at a state with terms, source of the noise.

        noise_again: whether the noise that was found about another state does not hold at this one.
        """
        linear = problem.linearise(state)
        problem, orders = with_orders(problem, linear, terms)
        problem, waves = with_spectra(problem, linear, terms)
        columns_of = {key: columns for key, columns in linear.columns.items() if key[0] in problem.library}
        problem, jumps = with_jumps(problem, linear, state, terms)
        if orders or waves:
            columns_of |= problem.linearise(state, [*orders, *waves]).columns
        linear = replace(linear, columns=columns_of | jumps)
        if self._stated == KNOWN:
            return problem, linear, "given"
        # many columns take long to be projected out, and leave the same residuals at every state of a linear model
        broad = any(effect.coordinates.broad for effect in problem.library.values())
        if self._source and broad and not noise_again:
            return problem, linear, self._source
        with_found, source = with_noise(problem, linear, self._stated_mm if self._stated == STATED else None)
        self._source = source
        return with_found, linear, source


def _is_nonlinear(problem: DiagnosisProblem, linear: LinearizedProblem, state: ModelState, fitted: ModelState) -> bool:
    """Whether the exact model at a fitted state without shapes differs from the linearisation about a state."""
    predicted = linear.data - linear.base @ (fitted.deviations - state.deviations)
    predicted = predicted - sum(linear.columns[key] @ numbers for key, numbers in fitted.effects.items())
    difference = np.sqrt(((problem.residual(fitted) - predicted) ** 2).mean())
    return bool(difference > OPTIONS.max_nonlinearity_per_noise * problem.noise_mm)


def _leaves_less_than_noise(problem: DiagnosisProblem, fit: ModelFit) -> bool:
    """Whether a fit leaves less than the noise does by chance: what a linearisation lacked was taken for noise.

    As where stops move drives by less than their backlash: no column of the library about a robot without backlash is
    like that.
    """
    residual = problem.residual(fit.state)
    freedom = residual.size - len(fit.estimate.parameters)
    least = chdtri(freedom, 1.0 - OPTIONS.max_noise_again_p) if freedom > 0 else 0.0
    return bool((residual**2).sum() < least * problem.noise_mm**2)


def _rounds(problem: DiagnosisProblem, calibrated: ModelState, prior: Prior, stated: str) -> InferenceResult:
    """Search and fit in turn until a hypothesis is the best one again."""
    linearization, seen, start = _Linearization(stated, problem.noise_mm), set(), origin(problem)
    problem, linear, source = linearization.at(problem, calibrated)
    problem, linear = with_seen(problem, linear)
    fit = fit_model(problem, [calibrated])
    calibrated = state = fit.state
    evidence = problem.evidence(linear)
    small = np.sqrt((linear.data**2).mean()) < OPTIONS.max_small_gap_per_noise * problem.noise_mm
    terms: tuple[EffectTerm, ...] = ()
    for _ in range(OPTIONS.max_search_rounds):
        space = ModelSpace(evidence.on_library(), prior)
        first, confirmed = space.climb(terms), False
        posterior = space.posterior([first])
        while True:
            hypothesis, level = posterior.best()
            shaped = any(len(problem.library[term.effect].coordinates.shapes) > 1 for term in hypothesis.terms)
            discrepant = not hypothesis.effects.isdisjoint(UNKNOWN)
            # where a discrepancy function wins, a second linearisation at its fit is needed only if the model is
            # nonlinear on the way there, or the shape of an effect is still to be fitted
            settled = discrepant and small and not shaped
            # try the effect models before the discrepancy basis
            named = posterior.best_of(hypothesis.effects - set(UNKNOWN)) if discrepant and (small or shaped) else None
            tried, its_level = named or (hypothesis, level)
            ended = frozenset(hypothesis.terms) in seen or not hypothesis.terms
            ended |= settled and (tried is hypothesis or not tried.terms)
            if confirmed or not ended:
                break
            # an answer is accepted once the whole search, and one from the other end, have found nothing better
            posterior, confirmed = space.confirmed(first), True
        terms = hypothesis.terms
        if ended:
            break
        seen.add(frozenset(hypothesis.terms))
        # values that a dropped effect has left in the others can trap a fit
        dropped = {name for name, _ in state.effects} - tried.effects
        found = fit_hypothesis(problem, evidence, (calibrated if dropped else state, start), (tried, its_level))
        if settled and not _is_nonlinear(problem, linear, calibrated, found.state):
            break
        try:
            moved = problem.standing(found.state).with_approach(found.state)
            linearized = linearization.at(moved, found.state, tried.terms, _leaves_less_than_noise(moved, found))
        except FitError:
            # the fitted model has no pose at a reading: the last linearisation is used
            break
        fit, state, (problem, linear, source) = found, found.state, linearized
        evidence = problem.evidence(linear)
    else:
        space = ModelSpace(evidence.on_library(), prior)
        first, confirmed = space.climb(terms), False
    if not confirmed:
        posterior = space.confirmed(first)
    hypothesis, level = posterior.best()
    result = InferenceResult(problem, start, calibrated, fit, evidence, posterior, hypothesis, level, source)
    # estimate and hypothesis are of one set, whether the rounds have converged or cycle
    result = with_effects(result, hypothesis.effects)
    for name in sorted(hypothesis.effects):
        if not result.hypothesis.effects.isdisjoint(HOLDS.get(name, ())):
            result = _about_another_mode(result, prior, result.hypothesis.effects - {name})
    named = result.posterior.best_where(bool)
    if named and not result.hypothesis.effects.isdisjoint(UNKNOWN):
        result = _about_another_mode(result, prior, named[0].effects)
    return result


def _log_likelihood(evidence: ModelEvidence, posterior: Posterior) -> float:
    """`InferenceResult.log_likelihood` of a posterior over sets of terms."""
    readings = evidence.on_library()
    return posterior.total - 3.0 * len(readings) * float(np.log(readings.noise.mean_mm))


def _with_hidden_offsets(inference: InferenceResult, prior: Prior, stated_mm: float | None) -> InferenceResult:
    """The inference, or the one with offsets between the runs where these are more probable.

    Functions of the time and of the place can follow the means of all series, as where each of eight paths was driven
    once. A fit of all of them leaves offsets no room. Their size is then found with fewer functions, and the evidence
    of both noises is compared, that of the offset as of a further parameter (Schwarz, Annals of Statistics 6, 1978).
    """
    problem, series = inference.problem, len(np.unique(inference.problem.series))
    found_free = problem.noise is not None and len(problem.noise.offset_posterior) > 1
    if inference.noise_from == REPEATS or found_free or 3.0 * series <= MIN_FREE_MEANS:
        return inference
    other, source = with_noise(problem, inference.evidence.linear, stated_mm, follow_means=False)
    if source == REPEATS or other.noise is None or not other.noise.offset_probability > OPTIONS.min_offset_probability:
        return inference
    least = inference.log_likelihood + 0.5 * np.log(3.0 * series)
    evidence = other.evidence(inference.evidence.linear)
    space = ModelSpace(evidence.on_library(), prior)
    climbed = space.posterior([space.climb(inference.hypothesis.terms)])
    # a search about another state is worth its time where the same columns show a chance
    if _log_likelihood(evidence, climbed) < least - OPTIONS.max_climb_below_nats:
        return inference
    found = replace(_rounds(other, inference.calibrated, prior, KNOWN), noise_from=source)
    return found if found.log_likelihood > least else inference


def _about_another_mode(inference: InferenceResult, prior: Prior, effects: Collection[str]) -> InferenceResult:
    """The inference, or the one about the fit of some effects alone, if higher.

    An effect and one that holds it as a special case, or a function of the discrepancy, can make up for a linearisation
    that is wrong for the effect alone, as where a stop moves a drive by less than its backlash, and a linearisation
    about both then keeps both. The evidence is an expansion about a mode of the posterior (Tierney and Kadane, Accurate
    approximations for posterior moments and marginal densities, Journal of the American Statistical Association 81,
    1986): of several modes the highest one counts.
    """
    other = with_effects(inference, effects)
    try:
        problem = other.problem.standing(other.state).with_approach(other.state)
        evidence = problem.evidence(problem.linearise(other.state))
    except FitError:
        return inference
    space = ModelSpace(evidence.on_library(), prior)
    first = space.climb(other.hypothesis.terms)
    # a whole search is worth its time only where a climb from either answer ends higher
    climbs = [first, space.climb(inference.hypothesis.terms)]
    if space.posterior(climbs).height <= inference.posterior.height:
        return inference
    posterior = space.confirmed(first)
    found = replace(other, problem=problem, evidence=evidence).with_posterior(posterior)
    return with_effects(found, found.hypothesis.effects)
