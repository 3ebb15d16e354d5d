"""The solver: maximum a posteriori estimates of a `Problem` by damped Gauss-Newton steps.

Step, acceptance, convergence and covariance come from the same penalised, whitened objective

    F(x) = 1/2 sum rho(r_i^2) + 1/2 sum ((x_j - m_j) / s_j)^2,    r = W (y - h(x))

The steps are Levenberg's and Marquardt's, in units of the priors' standard deviations. A damped step keeps combinations
that the readings do not determine near the prior mean. A step that gains less than half of the prediction gets a
second-order correction (geodesic acceleration: Transtrum and Sethna, Improvements to the Levenberg-Marquardt algorithm,
arXiv:1201.5885, 2012) and, if need be, a step length by quadratic interpolation: so a search follows the curved valley
of two factors of one product, such as a compliance and a load. Parameters at a bound that the gradient presses against
are held (Kanzow, Yamashita and Fukushima, Journal of Computational and Applied Mathematics 172, 2004).

Where priors are mixtures there is a search for each case of them, whose probability is its evidence by Laplace's
approximation (Tierney and Kadane, Journal of the American Statistical Association 81, 1986). The parameters of these
priors get their mean over the cases. All others are searched for with these held: of a linear model their posterior
mean, and of a product of two factors a pair that fits the readings, which the mean of either factor is not.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

from rrru.arrays import BoolArray, FloatArray, IntArray
from rrru.errors import FitError
from rrru.estimation.estimate import Estimate, SearchEnd, triangle_of, with_prior
from rrru.estimation.problem import Problem


@dataclass(frozen=True)
class SolverOptions:
    """When a search ends.

    max_iterations: a well-scaled problem needs some ten, one with lost zero offsets or frames some fifty;
    step_tolerance: the search ends where a full step would change no parameter by more than this share of its standard
    error, far below the resolution of any reading; cost_tolerance: or where it would lower the objective by less than
    this share, about the rounding of a sum of squares; rounding: the search also ends where a step should lower the
    objective by less than this share and does not, since it is below the rounding of the model, such as that of closed
    loops; first_damping: of the first step, in units of the priors, small since starts are mostly near; max_damping:
    beyond it no step lowers the objective.
    """

    max_iterations: int = 200
    step_tolerance: float = 1e-7
    cost_tolerance: float = 1e-15
    rounding: float = 1e-10
    first_damping: float = 1e-8
    max_damping: float = 1e24


# damping that holds directions that neither readings nor priors determine
_LEAST_DAMPING = 1e-13
# gain, as a share of the linearised objective, below which the search for the parameters at bounds ends
_BOUNDED = 1e-14
# damping, times two, after the first step that does not lower the objective
_RETRY_DAMPING = 1e-3
# the damping decreases by this factor after a step that gains at least this share of the prediction
_DAMPING_DECREASE, _WELL_PREDICTED = 0.1, 0.5
# least step length, as a share of the step
_SHORTEST = 0.05
# distance, in standard errors, and its square as a difference of the objective, of two ends of searches that are one
_SAME_END = 0.1
# least posterior probability of a case of a mixture that counts
_LEAST_SHARE = 1e-6
_Function = Callable[[FloatArray], FloatArray]
# rho(z) and its derivative by z, the squared residual in units of the loss scale (as scipy names them)
_LOSSES: dict[str, tuple[_Function, _Function]] = {
    "linear": (lambda z: z, np.ones_like),
    "soft_l1": (lambda z: 2.0 * (np.sqrt(1.0 + z) - 1.0), lambda z: (1.0 + z) ** -0.5),
    "huber": (
        lambda z: np.where(z <= 1.0, z, 2.0 * np.sqrt(np.maximum(z, 1.0)) - 1.0),
        lambda z: np.where(z <= 1.0, 1.0, np.maximum(z, 1.0) ** -0.5),
    ),
    "cauchy": (np.log1p, lambda z: 1.0 / (1.0 + z)),
}
LOSSES = tuple(_LOSSES)


def solve(
    problem: Problem,
    starts: Iterable[npt.ArrayLike] | None = None,
    options: SolverOptions | None = None,
    known: Sequence[Estimate] = (),
) -> Estimate:
    """The Estimate of lowest objective that the searches from some starts (p,) end at, by default the prior means.

    known: Estimates of the same problem from other starts. Where the search of the first case of a mixture ends where
    that of one of these did, the further cases would do so, too, and this Estimate is the result. A search that does
    not converge is no error: the Estimate says so. Raises FitError where the model predicts nothing at any start, which
    is outside of what the robot can do.
    """
    options = options or SolverOptions()
    starts = [problem.parameters.mean] if starts is None else list(starts)
    if problem.parameters.mixed.any():
        return _solve_cases(problem, starts, options, known)
    return _best(problem, starts, options).estimate()


def _best(
    problem: Problem, starts: Iterable[npt.ArrayLike], options: SolverOptions, held: BoolArray | None = None
) -> "_Search":
    """The _Search of lowest objective of those from some starts (p,), with the evaluations of all.

    held (p,): parameters that keep their start value. Raises FitError where the model predicts nothing at any start.
    """
    found = []
    for start in starts:
        search = _Search(problem, options, problem.parameters.clipped(np.asarray(start, dtype=float)), held)
        if np.isfinite(search.cost):
            search.run()
            found.append(search)
    if not found:
        raise FitError("the model predicts no reading at the start values; start nearer to the real robot")
    best = min(found, key=lambda one: one.cost)
    best.evaluations = sum(one.evaluations for one in found)
    return best


def _solve_cases(
    problem: Problem, starts: Sequence[npt.ArrayLike], options: SolverOptions, known: Sequence[Estimate]
) -> Estimate:
    """The Estimate of a problem whose prior is a mixture, see the module; a case starts where the one before ended.

    The first case starts at the means of the mixtures: far from its own prior a factor of a product would take the
    other one along a curved valley.
    """
    mixed, found = problem.parameters.mixed, list[Estimate]()
    starts = [np.where(mixed, problem.parameters.mean, start) for start in starts]
    for parameters in problem.parameters.cases:
        search = _best(replace(problem, parameters=parameters), starts, options)
        found.append(search.estimate())
        starts = [search.values]
        if len(found) == 1 and (same := [one for one in known if _end_alike(one.first_case, found[0])]):
            return same[0]
    log = _log_evidences(found, mixed)
    share = np.exp(log - logsumexp(log))
    share[share < _LEAST_SHARE] = 0.0
    share /= share.sum()
    start = found[int(share.argmax())].values.copy()
    start[mixed] = share @ np.array([one.values[mixed] for one in found])
    search = _best(problem, [start], options, mixed)
    ends = [*(one.end for one in found), search.end]
    end = SearchEnd(
        all(one.converged for one in ends),
        all(one.straight for one in ends),
        next((one.message for one in ends if not one.converged), search.message),
        search.cost,
        sum(one.evaluations for one in ends),
    )
    at_bound = np.where(mixed, np.all([one.at_bound for one in found], axis=0), ~search.free)
    cases = [(share, one) for share, one in zip(share.tolist(), found, strict=True) if share]
    return replace(Estimate.over_cases(problem, search.values, at_bound, end, cases), first_case=found[0])


def _end_alike(one: Estimate | None, other: Estimate) -> bool:
    """Whether two converged searches of one problem have ended at the same minimum."""
    if one is None or not (one.end.converged and other.end.converged):
        return False
    # the error of a parameter at a bound is zero
    near = np.abs(one.values - other.values) <= _SAME_END * np.sqrt(np.diag(other.covariance))
    return bool(near.all() and abs(one.end.cost - other.end.cost) <= _SAME_END**2)


def _log_evidences(cases: Sequence[Estimate], mixed: BoolArray) -> FloatArray:
    """Log evidences (c,) of Estimates that differ by the priors of some parameters (p,), up to a common constant.

    The integral is over the parameters that no bound holds in any case.
    """
    known = np.all([~one.at_bound & np.isfinite(np.diag(one.covariance)) for one in cases], axis=0)
    sizes = np.sqrt(np.diag(cases[0].covariance))[known]
    result = []
    for one in cases:
        covariance = one.covariance[np.ix_(known, known)] / np.outer(sizes, sizes)
        prior = float(np.log(one.parameters.sd[mixed]).sum())
        result.append(0.5 * float(np.linalg.slogdet(covariance)[1]) - prior - one.end.cost)
    return np.array(result)


def estimate_at(problem: Problem, values: npt.ArrayLike, message: str, evaluations: int = 1) -> Estimate:
    """The Estimate linearised at values (p,), the result of another search with its message.

    Raises FitError where the model predicts nothing there.
    """
    search = _Search(problem, SolverOptions(), np.asarray(values, dtype=float))
    if not np.isfinite(search.cost):
        raise FitError(f"the model predicts no reading at the values of a search; its end: {message}")
    search.converged, search.message, search.evaluations = True, message, evaluations
    return search.estimate()


class _Search:
    """One search from one start (p,) within the bounds; parameters that are held (p,) keep their value."""

    def __init__(
        self, problem: Problem, options: SolverOptions, start: FloatArray, held: BoolArray | None = None
    ) -> None:
        self._problem, self._options = problem, options
        self._held = np.zeros(len(start), dtype=bool) if held is None else held
        self.values = start
        self.evaluations, self.converged, self.straight = 0, False, True
        self.message = "the largest number of iterations is reached"
        self.residual, self.cost = self._evaluate(self.values)

    def _evaluate(self, values: FloatArray) -> tuple[FloatArray, float]:
        """Whitened residual (n, a) and objective at values (p,), inf where the model predicts nothing."""
        self.evaluations += 1
        raw = self._problem.observations.residual(values)
        if not np.isfinite(raw).all():
            return raw, np.inf
        white = self._problem.whiten(raw)
        scale, (loss, _) = self._problem.loss_scale, _LOSSES[self._problem.loss]
        cost = 0.5 * scale**2 * float(loss((white / scale) ** 2).sum())
        return white, cost + self._problem.parameters.prior_cost(values)

    def _linearized(self) -> FloatArray:
        """Derivative and residual (n a, p + 1) of the whitened readings at the current values.

        Readings under a robust loss have the weight rho' (iteratively reweighted least squares).
        """
        problem, count = self._problem, len(self.values)
        columns = problem.whiten(problem.observations.jacobian(self.values)).reshape(-1, count)
        white = np.column_stack([columns, self.residual.ravel()])
        if problem.loss != "linear":
            squares = (self.residual.ravel() / problem.loss_scale) ** 2
            white = white * np.sqrt(_LOSSES[problem.loss][1](squares))[:, None]
        return white

    def _penalized(self, white: FloatArray) -> FloatArray:
        """Triangle (p + 1, p + 1) of whitened readings (n a, p + 1) and the priors."""
        parameters = self._problem.parameters
        root = np.sqrt(parameters.prior_precision)
        return with_prior(white, root, root * (self.values - parameters.mean))

    def run(self) -> None:
        """Search until the options say that it has ended."""
        options, damping, growth = self._options, self._options.first_damping, 2.0
        for _ in range(options.max_iterations):
            white = self._linearized()
            triangle = self._penalized(white)
            free = np.flatnonzero(self._free(triangle))
            linearized = _Linearized(
                triangle if len(free) == len(self.values) else triangle_of(triangle[:, [*free, len(self.values)]]),
                self._problem.parameters.sd[free],
                (self._problem.parameters.low - self.values)[free],
                (self._problem.parameters.high - self.values)[free],
            )
            least = max(0.25 * options.step_tolerance**2, options.cost_tolerance * self.cost)
            if linearized.step(_LEAST_DAMPING).gain <= least:
                self._end()
                return
            while True:
                step = linearized.step(damping)
                trial = self._best_trial(step, free, white)
                if trial.cost < self.cost:
                    break
                if step.gain <= max(least, options.rounding * self.cost):
                    self._end()
                    return
                damping, growth, self.straight = max(damping, _RETRY_DAMPING) * growth, 2.0 * growth, False
                if damping > options.max_damping:
                    self.message = "no step lowers the objective"
                    return
            if self.cost - trial.cost >= _WELL_PREDICTED * step.gain:
                damping *= _DAMPING_DECREASE
            growth = 2.0
            self.values, self.residual, self.cost = trial.values, trial.residual, trial.cost

    def _best_trial(self, step: "_Step", free: IntArray, white: FloatArray) -> "_Trial":
        """The best _Trial of a step of the free parameters (k,): of the step itself and, where it gains too little,
        with the second-order correction and with the interpolated length. white (n a, p + 1): of `_linearized`.
        """
        trial = self._along(step.change, free)
        gained, wanted = self.cost - trial.cost, _WELL_PREDICTED * step.gain
        if not gained < wanted or not np.isfinite(gained):
            return trial
        self.straight = False
        if self._problem.loss == "linear":
            whole = np.zeros(len(self.values))
            whole[free] = step.change
            beyond = trial.residual.ravel() - white[:, -1] - white[:, :-1] @ whole
            corrected = self._along(step.change + step.correction((white[:, :-1].T @ beyond)[free]), free)
            trial = min(trial, corrected, key=lambda one: one.cost)
            if self.cost - trial.cost >= wanted:
                return trial
        # where the parabola through both ends, with the slope at the first, is least
        share = 0.5 * step.slope / (step.slope - gained)
        if share > _SHORTEST:
            trial = min(trial, self._along(share * step.change, free), key=lambda one: one.cost)
        return trial

    def _along(self, change: FloatArray, free: IntArray) -> "_Trial":
        """The _Trial after a change (k,) of the free parameters, within the bounds."""
        values = self.values.copy()
        values[free] += change
        values = self._problem.parameters.clipped(values)
        return _Trial(values, *self._evaluate(values))

    def _end(self) -> None:
        """Note that the search is at a minimum."""
        self.converged, self.message = True, "converged"

    def _free(self, triangle: FloatArray) -> npt.NDArray[np.bool_]:
        """Parameters (p,) that are not at a bound which the gradient presses them against."""
        parameters, gradient = self._problem.parameters, triangle[:, :-1].T @ triangle[:, -1]
        at_low = (self.values <= parameters.low) & (gradient > 0.0)
        at_high = (self.values >= parameters.high) & (gradient < 0.0)
        return ~(at_low | at_high | self._held)

    @property
    def free(self) -> BoolArray:
        """Parameters (p,) that neither a bound nor the caller holds."""
        return self._free(self._penalized(self._linearized()))

    @property
    def end(self) -> SearchEnd:
        """How the search ended."""
        return SearchEnd(self.converged, self.straight, self.message, self.cost, self.evaluations)

    def estimate(self) -> Estimate:
        """The Estimate of where the search ended."""
        white = self._linearized()
        return Estimate.at(self._problem, self.values, white, self._free(self._penalized(white)), self.end)


@dataclass(frozen=True, eq=False)
class _Trial:
    """Values (p,), their whitened residual (n, a) and objective."""

    values: FloatArray
    residual: FloatArray
    cost: float


@dataclass(frozen=True, eq=False)
class _Step:
    """A damped step: change (k,); gain: by how much it lowers the linearised objective; slope: how fast this falls at
    its beginning. unit (f,) and triangle (f, f): of the damped problem of those of the parameters, inside (k,), that
    are not put at a bound.
    """

    change: FloatArray
    gain: float
    slope: float
    inside: BoolArray
    unit: FloatArray
    triangle: FloatArray

    def correction(self, pull: FloatArray) -> FloatArray:
        """Second-order correction (k,) for a residual d beyond the linear model; pull (k,): J^T d."""
        result = np.zeros(len(self.change))
        if not self.inside.any():
            return result
        halfway = solve_triangular(self.triangle, self.unit * pull[self.inside], trans="T")
        result[self.inside] = -self.unit * solve_triangular(self.triangle, halfway)
        return result


@dataclass(frozen=True, eq=False)
class _Linearized:
    """A linearised problem: triangle (k + 1, k + 1), priors' sd (k,), and bounds low, high (k,) of the step."""

    triangle: FloatArray
    sd: FloatArray
    low: FloatArray
    high: FloatArray

    def step(self, damping: float) -> _Step:
        """Damped Gauss-Newton _Step within the bounds: the least squares of the linearised problem between them.

        Parameters count in units of their priors, those of flat priors by the length of their column; damping: in these
        units, so that 1 shortens a step to about the priors' standard deviations. Where one would leave its bounds all
        are found by Stark's and Parker's bounded-variable least squares (Computational Statistics 10, 1995): it may
        belong inside of its bounds once others are held at theirs.
        """
        columns, target, count = self.triangle[:, :-1], self.triangle[:, -1], len(self.sd)
        length = np.linalg.norm(columns, axis=0)
        unit = np.where(np.isfinite(self.sd), self.sd, 1.0 / np.where(length > 0.0, length, 1.0))
        brake = np.column_stack([np.sqrt(damping) * np.eye(count), np.zeros(count)])
        whole = np.concatenate([np.column_stack([columns * unit, target]), brake])
        damped = triangle_of(whole)
        found, side = _between(damped, self.low / unit, self.high / unit)
        free = side == 0
        step = np.where(free, np.clip(unit * found, self.low, self.high), np.where(side < 0, self.low, self.high))
        if not free.all():
            damped = triangle_of(whole[:, [*np.flatnonzero(free), count]])
        moved = columns @ step
        slope = -float(target @ moved)
        return _Step(step, slope - 0.5 * float(moved @ moved), slope, free, unit[free], damped[:-1, :-1])


def _between(triangle: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, IntArray]:
    """Least squares (k,) of a triangle (k + 1, k + 1) of columns and residual between bounds, and the sides (k,).

    Side -1 is a parameter at its lower bound, 1 at its upper one, 0 inside. Bounds count for those parameters alone
    that leave them otherwise: the others are eliminated, which is faster where few of many parameters do.
    """
    count = len(low)
    found, side = -solve_triangular(triangle[:-1, :-1], triangle[:-1, -1]), np.zeros(count, dtype=int)
    bounded = np.zeros(count, dtype=bool)
    while (leaves := ~bounded & ((found < low) | (found > high))).any():
        # loaded where a bound is reached
        from scipy.optimize import lsq_linear

        bounded |= leaves
        inside, some = np.flatnonzero(~bounded), np.flatnonzero(bounded)
        ordered = np.asarray(np.linalg.qr(triangle[:, [*inside, *some, count]], mode="r"))
        first, last = slice(len(inside)), slice(len(inside), count)
        limits = low[some], high[some]
        best = lsq_linear(ordered[last, last], -ordered[last, -1], limits, "bvls", _BOUNDED, max_iter=20 * count)
        found[some], side[some] = best.x, best.active_mask
        rest = ordered[first, -1] + ordered[first, last] @ best.x
        found[inside] = -solve_triangular(ordered[first, first], rest)
    return found, side
