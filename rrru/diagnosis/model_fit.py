"""The calibrated model with effects, fitted to the readings of a problem: all parameters at once, under one objective.

    y = h(b, c, s, w) + delta + e,    b geometric errors, c coefficients of effect terms, s their shape parameters,
                                      w errors of the stated payload and tilt

`rrru.estimation` solves it: the exact model, the noise and the discrepancy of the hypothesis, the priors of all blocks.
Lengths in mm, angles in rad.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rrru.arrays import FloatArray
from rrru.cache import last_cached
from rrru.diagnosis.aliases import EffectKey
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.payload_nuisance import WEIGHT
from rrru.diagnosis.problem import GEOMETRY, DiagnosisProblem
from rrru.diagnosis.state import ModelState
from rrru.diagnosis.terms import EACH, EffectTerm, spread
from rrru.diagnosis.whitened import discrepancy_scales, spectrum
from rrru.effects.protocol import Contribution, is_compliant
from rrru.errors import FitError
from rrru.estimation.estimate import Estimate
from rrru.estimation.explain import explain_end
from rrru.estimation.noise_model import NoiseModel, Whitening
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem
from rrru.estimation.solver import SolverOptions, solve
from rrru.kinematics.parameter_jacobian import TwistMap

_SOLVER_OPTIONS = SolverOptions(step_tolerance=OPTIONS.step_tolerance_per_standard_error)
# relative reduction of a prior's standard deviation below which the readings do not inform a parameter; rounding
_MIN_SD_REDUCTION = 1e-9
_OPTIONS_OF_MANY = SolverOptions(OPTIONS.max_iterations_of_many, OPTIONS.step_tolerance_of_many)


@dataclass(frozen=True, eq=False)
class EffectModel:
    """A problem's model with effect terms, as the solver's Observations; its parameter vector holds blocks by name.

    terms: the effect terms; scales (k,): prior standard deviations of their coefficients one after the other; signed:
    coefficients keep the sign that their effect allows, and shape parameters are fitted. shapes: prior means of the
    shape parameters, by effect.
    """

    problem: DiagnosisProblem
    terms: tuple[EffectTerm, ...]
    scales: FloatArray
    signed: bool = True

    def same_as(self, other: "EffectModel") -> bool:
        """Whether this is the same model of the same problem under the same priors as another EffectModel."""
        same = self.terms == other.terms and self.signed == other.signed and self.problem.fits_as(other.problem)
        return same and np.array_equal(self.scales, other.scales)

    @cached_property
    def _matrices(self) -> list[FloatArray]:
        """Matrix (c, k) of each term from its coefficients to the effect's coordinates."""
        return [spread(self.problem.library[term.effect].coordinates, term.legs) for term in self.terms]

    @cached_property
    def shapes(self) -> dict[str, dict[str, float]]:
        """Prior means of the shape parameters, by effect."""
        return {t.effect: dict(self.problem.library[t.effect].coordinates.shapes[t.shape]) for t in self.terms}

    @cached_property
    def _shape_names(self) -> list[tuple[str, str, float]]:
        """(effect, parameter, standard deviation) of every shape parameter that is fitted."""
        shape_sd = [
            (name, key, abs(self.problem.effects[name].doubted(key, value) - value))
            for name, shape in self.shapes.items()
            for key, value in shape.items()
        ]
        return [named for named in shape_sd if named[2] > 0.0] if self.signed else []

    @cached_property
    def _weight_names(self) -> list[str]:
        """Names of the errors of payload and tilt, none where no term is compliant."""
        compliant = any(is_compliant(self.problem.library[term.effect]) for term in self.terms)
        return [name for name, sd in self.problem.nuisance_sd.items() if sd] if compliant and self.signed else []

    @cached_property
    def parameters(self) -> Parameters:
        """The Parameters: geometry, one block a term, "shape" and "weight"."""
        blocks, start = [self.problem.geometry], 0
        for term, matrix in zip(self.terms, self._matrices, strict=True):
            of_term = slice(start, start + matrix.shape[1])
            start = of_term.stop
            positive = matrix.T @ self.problem.library[term.effect].coordinates.positive > 0
            low = np.where(positive & self.signed, 0.0, -np.inf)
            names = [f"{term.effect}_{k}" for k in range(matrix.shape[1])]
            blocks.append(Block.of(term.effect, names, [""] * len(names), self.scales[of_term], bounds=(low, np.inf)))
        if self._shape_names:
            limits = [self.problem.effects[name].parameters[key] for name, key, _ in self._shape_names]
            names, units = [f"{name}.{key}" for name, key, _ in self._shape_names], [one.unit for one in limits]
            mean = [self.shapes[name][key] for name, key, _ in self._shape_names]
            bounds = [one.low for one in limits], [one.high for one in limits]
            blocks.append(Block.of("shape", names, units, [sd for *_, sd in self._shape_names], mean, bounds))
        if self._weight_names:
            nuisance_sd = np.array([self.problem.nuisance_sd[name] for name in self._weight_names])
            low, high = np.transpose([self.problem.bounds[name] for name in self._weight_names])
            units = ["kg" if name.endswith("kg") else "rad" for name in self._weight_names]
            narrow_sd = OPTIONS.stated_nuisance_sd_ratio * nuisance_sd
            blocks.append(Block.of(WEIGHT, self._weight_names, units, narrow_sd, 0.0, (low, high), wide_sd=nuisance_sd))
        return Parameters(tuple(blocks))

    def vector(self, state: ModelState) -> FloatArray:
        """Parameter vector (p,) of a ModelState; effects that it does not hold have coefficients of zero."""
        values, places = self.parameters.mean.copy(), self.parameters.slices
        values[places[GEOMETRY]] = state.deviations
        for term, matrix in zip(self.terms, self._matrices, strict=True):
            coordinates = state.effects.get((term.effect, term.shape))
            if coordinates is not None:
                values[places[term.effect]] = np.linalg.lstsq(matrix, coordinates, rcond=None)[0]
        for k, (name, key, _) in enumerate(self._shape_names):
            if any(effect == name for effect, _ in state.effects):
                values[places["shape"]][k] = state.shape_values.get(name, self.shapes[name])[key]
        for k, name in enumerate(self._weight_names):
            values[places[WEIGHT]][k] = state.weight.get(name, 0.0)
        return self.parameters.clipped(values)

    @last_cached
    def state(self, values: FloatArray) -> ModelState:
        """The ModelState of a parameter vector (p,)."""
        places = self.parameters.slices
        pairs = zip(self.terms, self._matrices, strict=True)
        effects = {(t.effect, t.shape): matrix @ values[places[t.effect]] for t, matrix in pairs}
        shapes = {name: dict(shape) for name, shape in self.shapes.items()}
        for k, (name, key, _) in enumerate(self._shape_names):
            shapes[name][key] = float(values[places["shape"]][k])
        if self._weight_names:
            found = zip(self._weight_names, values[places[WEIGHT]].tolist(), strict=True)
            shapes[WEIGHT] = dict.fromkeys(self.problem.nuisance_sd, 0.0) | dict(found)
        return ModelState(values[places[GEOMETRY]], effects, shapes)

    def residual(self, values: FloatArray) -> FloatArray:
        """Readings minus the exact model (m, 3) at parameter values (p,)."""
        return self.problem.residual(self.state(values))

    @last_cached
    def jacobian(self, values: FloatArray) -> FloatArray:
        """Derivative (m, 3, p) of the residual by the parameters."""
        problem, state = self.problem, self.state(values)
        at = problem.map_of(state)
        blocks = [problem.of_rows(at.columns(problem.mechanism.directions))]
        for term, matrix in zip(self.terms, self._matrices, strict=True):
            blocks.append(self._by_coefficients(at, state, term, matrix))
        for name, key, sd in self._shape_names:
            blocks.append(self._by_shape(at, state, name, key, sd))
        blocks += [self._by_weight(at, state, name) for name in self._weight_names]
        return -np.concatenate(blocks, axis=-1)

    def _by_coefficients(self, at: TwistMap, state: ModelState, term: EffectTerm, matrix: FloatArray) -> FloatArray:
        """Derivative (m, 3, k) of the model by a term's coefficients."""
        problem, key = self.problem, (term.effect, term.shape)
        effect, present = problem.library[term.effect], state.effects[key]
        if effect_functions := effect.along_drives:
            response = problem.of_rows(at.drive_effect)
            made = [
                f[problem.at][:, None, :] * response[:, :, k, None]
                for k, f in enumerate(effect_functions(problem.motion))
            ]
            together = np.concatenate(made, axis=-1)
            return together if term.legs == EACH else together @ matrix
        contribution = problem.contributions(state)[key]
        result = np.empty((len(problem), 3, matrix.shape[1]))
        for k, column in enumerate(matrix.T):
            typical = float(np.max(effect.coordinates.typical[column > 0.0]))
            size = float(np.abs(present[column > 0.0]).max())
            apart_from_zero = size > OPTIONS.min_coefficient_per_typical * typical
            step = OPTIONS.difference_step_ratio * max(size, typical) if apart_from_zero else typical
            moved = state.contribution(problem.library, key, problem.motion, present + step * column)
            result[..., k] = problem.of_rows(at.move((moved - contribution).twists)) / step
        return result

    def _by_shape(self, at: TwistMap, state: ModelState, name: str, key: str, sd: float) -> FloatArray:
        """Derivative (m, 3, 1) of the model by a shape parameter of an effect."""
        problem, effect = self.problem, next(pair for pair in state.effects if pair[0] == name)
        value, limits = state.shape_values[name][key], problem.effects[name].parameters[key]
        step = 1e-3 * sd
        if value + step > limits.high:
            step = -step
        shape = state.shape_values[name] | {key: value + step}
        moved = state.contribution(problem.library, effect, problem.motion, shape=shape)
        change = moved - problem.contributions(state)[effect]
        return problem.of_rows(at.move(change.twists))[..., None] / step

    def _by_weight(self, at: TwistMap, state: ModelState, name: str) -> FloatArray:
        """Derivative (m, 3, 1) of the model by an error of payload or tilt."""
        problem, step = self.problem, 1e-3 * self.problem.nuisance_sd[name]
        other = state.under(state.weight | {name: state.weight[name] + step})
        moved = {
            key: other.contribution(problem.library, key, problem.motion)
            if is_compliant(problem.library[key[0]])
            else present
            for key, present in problem.contributions(state).items()
        }
        change = sum(moved.values(), Contribution()) - problem.contribution(state)
        return problem.of_rows(at.move(change.twists))[..., None] / step


@dataclass(frozen=True, eq=False)
class ModelFit:
    """An EffectModel with its Estimate; level: of the discrepancy that it was fitted with, an index.

    bias: covariance (p, p) of the errors that a discrepancy makes in the parameters, None where the model is taken as
    complete. Predictions at poses like those of the readings do without it: what the discrepancy adds to them it takes
    from the parameters.
    """

    model: EffectModel
    estimate: Estimate
    level: int
    bias: FloatArray | None = None

    @cached_property
    def stated(self) -> Estimate:
        """The Estimate whose standard errors and intervals are those of the parameters themselves."""
        return self.estimate if self.bias is None else self.estimate.biased(self.bias)

    @cached_property
    def state(self) -> ModelState:
        """The ModelState of the estimated values; without fitted shapes where no term has any."""
        state = self.model.state(self.estimate.values)
        return state if self.model.terms else ModelState(state.deviations, {})

    @property
    def terms(self) -> tuple[EffectTerm, ...]:
        """The effect terms."""
        return self.model.terms

    def effect_covariance(self, term: EffectTerm) -> tuple[list[str], FloatArray]:
        """Names of the q fitted shape parameters of a term's effect, and the covariance (k + q, k + q).

        The covariance is of the term's k coefficients, and after them of these q parameters. A parameter on which no
        reading depends, such as the travel of slides where only a turning drive winds up, is not fitted.
        """
        chosen, shapes = self._places_of(term)
        return shapes, self.stated.covariance[np.ix_(chosen, chosen)]

    def effect_numbers(self, term: EffectTerm) -> tuple[FloatArray, FloatArray]:
        """Values (k + q,) of a term's coefficients and its effect's fitted shape parameters, intervals (k + q, 2)."""
        chosen, _ = self._places_of(term)
        return self.estimate.values[chosen], self.stated.intervals[chosen]

    def _places_of(self, term: EffectTerm) -> tuple[list[int], list[str]]:
        """Places of a term's coefficients and its effect's fitted shape parameters, and the names of these."""
        parameters, prefix = self.estimate.parameters, f"{term.effect}."
        coefficients = np.arange(len(parameters))[parameters.slices[term.effect]]
        sd = np.sqrt(np.diag(self.estimate.covariance))
        informed = sd < (1.0 - _MIN_SD_REDUCTION) * parameters.sd
        shapes = [k for k, name in enumerate(parameters.names) if name.startswith(prefix) and informed[k]]
        return [*coefficients, *shapes], [parameters.names[k].removeprefix(prefix) for k in shapes]

    @property
    def weight(self) -> list[tuple[str, str, float, float]]:
        """Errors of payload and tilt, each (name, unit, value, standard error), empty where none was fitted."""
        places = self.estimate.parameters.slices
        if WEIGHT not in places:
            return []
        (block,) = (block for block in self.estimate.parameters.blocks if block.name == WEIGHT)
        errors = self.stated.block_errors(WEIGHT)
        return list(zip(block.names, block.units, self.estimate.block(WEIGHT).tolist(), errors.tolist(), strict=True))

    def one_sigma_steps(self) -> tuple[FloatArray, dict[EffectKey, FloatArray]]:
        """Independent errors of one standard deviation each: geometry (q, p), coordinates (q, c) by key of effect."""
        places, count = self.estimate.parameters.slices, len(self.estimate.parameters)
        names = (GEOMETRY, *(term.effect for term in self.terms))
        chosen = np.concatenate([np.arange(count)[places[name]] for name in names])
        covariance = self.estimate.covariance[np.ix_(chosen, chosen)]
        size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        share, axes = np.linalg.eigh(covariance / np.outer(size, size))
        steps = np.zeros((len(chosen), count))
        steps[:, chosen] = (size[:, None] * axes * np.sqrt(np.maximum(share, 0.0))).T
        pairs = zip(self.terms, self.model._matrices, strict=True)
        return steps[:, places[GEOMETRY]], {(t.effect, t.shape): steps[:, places[t.effect]] @ m.T for t, m in pairs}


def whitening_of(problem: DiagnosisProblem, level: int) -> Whitening:
    """The Whitening of a problem's readings under its noise and the discrepancy of a level (an index)."""
    noise = (problem.noise or NoiseModel.white(problem.noise_mm)).counted
    size = discrepancy_scales(noise)[level] * noise.mean_mm
    discrepancy = (lambda waves: size**2 * spectrum(waves)) if size else None
    return noise.whitening(problem.series, discrepancy)


def fit_model(
    problem: DiagnosisProblem,
    starts: Iterable[ModelState],
    terms: Sequence[EffectTerm] = (),
    scales: npt.ArrayLike = (),
    level: int = 0,
    signed: bool = True,
) -> ModelFit:
    """ModelFit of a problem's used readings with effect terms, whose coefficients have prior deviations scales (k,).

    starts: states, tried in turn until a search from one goes straight to its end; where none does, the first that is
    as good as the best of all. A calibration that has absorbed an effect may be a local minimum. level: of the
    discrepancy, an index. The Estimate says whether the search converged; raises FitError where the model has no pose
    at any start, even without effects.
    """
    model = EffectModel(problem, tuple(terms), np.asarray(scales, dtype=float), signed)
    estimation = Problem(model, model.parameters, whitening_of(problem, level))
    many = len(model.parameters) > OPTIONS.max_parameters_of_several_starts
    fits: list[Estimate] = []
    for start in starts:
        # where the exact model has no pose at a start with effects, it has one without them
        candidates = [model.vector(start), model.vector(ModelState(start.deviations, {}))]
        candidate = next((v for v in candidates if np.isfinite(model.residual(v)).all()), candidates[-1])
        fits.append(solve(estimation, [candidate], _OPTIONS_OF_MANY if many else _SOLVER_OPTIONS, fits))
        if (fits[-1].end.straight and fits[-1].end.converged) or many:
            break
    enough = min(fit.end.cost for fit in fits) + OPTIONS.equal_fits_nats
    return ModelFit(model, next(fit for fit in fits if fit.end.cost <= enough), level)


def fit_named_effects(
    problem: DiagnosisProblem,
    names: Sequence[str],
    calibrated: ModelState,
    times_typical: float = OPTIONS.prior_sd_per_typical,
) -> ModelFit:
    """ModelFit of a problem with effects of these names, each in its first shape, chosen beforehand without a search.

    calibrated: state to start from; times_typical: of the prior's standard deviation over the typical size. Signs and
    bounds of the effect models are not imposed, so that a size that contradicts the model shows. Raises FitError where
    the search does not converge.
    """
    sizes = [times_typical * np.asarray(problem.library[name].coordinates.typical) for name in names]
    scales = np.concatenate([np.zeros(0), *sizes])
    fit = fit_model(problem, [calibrated], [EffectTerm(name) for name in names], scales, signed=False)
    if not fit.estimate.end.converged:
        raise FitError(explain_end(fit.estimate, f"the fit of {', '.join(names) or 'the geometry'}"), fit.estimate)
    return fit
