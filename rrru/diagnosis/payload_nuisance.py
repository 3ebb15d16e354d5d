"""Nuisance parameters of payload and tilt: a mass that was not stated, a base that is not level.

A compliant part deflects under loads that are linear in the mass m at the platform and in the tilt w of the base
(`rrru.kinematics.dynamics.load_slopes`). The errors of both are fitted together with everything else, wherever a
compliant effect acts:

    dm ~ N(0, (share m)^2),    w_x, w_y ~ N(0, tilt^2)

Payload and tilt are common to all effects and no effects themselves: without compliance they change nothing. Evidence
is averaged over four cases: the mass is as stated or not, and the base is level or not.

The columns of payload and tilt are a linearisation about the coefficients found under weak priors. `nuisance_evidence`
has the exact product. The error of the log evidence, averaged over prior scales, was computed for a 3-RRRU and a
six-axis arm. It is 0.25 nats at most where the compliant effect acts, and 1.2 nats where another one acts or none.

ASSUME even odds of each. Masses come from a scale or a drawing, good to 3 %, or are guessed within 30 % of what hangs
at the platform. Where no mass is stated there, the error is a tenth of all that moves, as an arm is made to carry. The
base is level within a tenth of a degree, or it is tilted by a degree.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np

from rrru.arrays import FloatArray, IntArray
from rrru.diagnosis.aliases import Grams, WeightStep
from rrru.diagnosis.evidence_kernels import log_sum_exp
from rrru.diagnosis.marginal_problem import (
    MarginalProblem,
    gained,
    gained_about_zero,
    posterior_covariance,
    posterior_mean,
)
from rrru.diagnosis.options import OPTIONS
from rrru.effects.protocol import Motion
from rrru.kinematics.dynamics import Masses, carried_kg, level_axes
from rrru.kinematics.point_masses import PLATFORM
from rrru.kinematics.robot import Robot

# name of payload and tilt in tables of effects, and name of the mass among them
WEIGHT, _EXTRA = "weight", "extra_kg"
# probabilities that a mass, or a tilt, is as stated and that it is not, each with its ratio of standard deviations
_CASES = (
    (OPTIONS.stated_nuisance_probability, OPTIONS.stated_nuisance_sd_ratio),
    (1.0 - OPTIONS.stated_nuisance_probability, 1.0),
)


def weight_names(robot: Robot) -> tuple[str, ...]:
    """Names of the nuisance parameters: mass at the platform, tilts of the base about the level axes."""
    return (_EXTRA, *(f"lean_{'xyz'[axis]}" for axis in level_axes(robot)))


def nuisance_priors(motion: Motion, masses: Masses) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Standard deviations and bounds (low, high) by name of the errors of payload and tilt along a Motion.

    All zero where no part has mass.
    """
    robot, point_masses = motion.robot, motion.robot.point_masses
    platform_kg = sum(point_mass.mass_kg for point_mass in point_masses if point_mass.joint == PLATFORM)
    stated_kg = platform_kg + carried_kg(robot, masses, np.nan_to_num(motion.payload_kg))
    extra = OPTIONS.payload_sd_per_stated_mass * float(stated_kg.max(initial=0.0))
    extra = extra or OPTIONS.payload_sd_per_robot_mass * sum(point_mass.mass_kg for point_mass in point_masses)
    nuisance_sd = extra, *(2 * [OPTIONS.tilt_sd_rad if extra else 0.0])
    bounds = [(-OPTIONS.nuisance_bound_sd * sd, OPTIONS.nuisance_bound_sd * sd) for sd in nuisance_sd]
    least_kg = float(stated_kg.min(initial=np.inf) if len(stated_kg) else 0.0)
    bounds[0] = -OPTIONS.max_missing_mass_share * least_kg, bounds[0][1]
    names = weight_names(robot)
    return dict(zip(names, nuisance_sd, strict=True)), dict(zip(names, bounds, strict=True))


def as_found(problem: MarginalProblem, prior_scales: FloatArray) -> FloatArray:
    """Coefficients (k,) of a MarginalProblem of one level at prior_scales (1, terms)."""
    return posterior_mean(problem, problem.scale(prior_scales)[0])


def with_nuisance(
    problem: MarginalProblem,
    count: int,
    blocks: Mapping[int, tuple[FloatArray, IntArray]],
    steps: Sequence[WeightStep],
    found: FloatArray,
    grams: Grams,
) -> MarginalProblem:
    """The MarginalProblem of so many terms with the errors of payload and tilt as further coefficients.

    blocks: by number of a compliant term the matrix (c, k) from its k coefficients to coordinates, and the numbers
    (q, c) of the columns of its changes by a step of each of q nuisance parameters; steps: of the nuisance
    parameters, see `rrru.diagnosis.state.LinearizedProblem`; found (k,): the coefficients that such a step changes,
    the same at all levels; grams: as in `MarginalProblem.of`.
    """
    means = np.array([step[-1] for step in steps])
    acting = {k: matrix @ found[problem.owner == k] for k, (matrix, _) in blocks.items()}
    index = np.concatenate([numbers.ravel() for _, numbers in blocks.values()])
    mix, row = np.zeros((len(index), len(means))), 0
    for coordinates in acting.values():
        for number in range(len(means)):
            mix[row : row + len(coordinates), number] = coordinates
            row += len(coordinates)
    more = {
        "size": np.ones(len(means)),
        "largest": np.full(len(means), np.inf),
        "positive": np.zeros(len(means), dtype=bool),
        "about": means,
        "owner": np.full(len(means), count),
        "index": index,
    }
    joined = {name: np.concatenate([getattr(problem, name), values]) for name, values in more.items()}
    at_least, squares = np.zeros(count), (found / problem.size) ** 2
    for k in blocks:
        at_least[k] = np.sqrt(squares[problem.owner == k].mean())
    whole = replace(problem, mix=mix, weights=tuple(step[0] != _EXTRA for step in steps), at_least=at_least, **joined)
    return whole.on(*grams(joined["index"]))


def gained_over_cases(problem: MarginalProblem, prior_scales: FloatArray) -> FloatArray:
    """`gained` of a MarginalProblem at prior_scales (m, terms), averaged over the cases of payload and tilt."""
    if not problem.weights:
        return gained(problem, problem.scale(prior_scales))
    # where the nuisance parameters are not free they stay as stated, no more probable than under the least prior scales
    # that leave them free
    least = np.maximum(prior_scales, OPTIONS.min_prior_scale_per_size * problem.at_least)
    result = _over_cases(problem, problem.scale(least))
    narrow = (least > prior_scales).any(axis=1)
    if narrow.any():
        as_it_is = problem.scale(np.concatenate([prior_scales[narrow], least[narrow]]))
        # under a prior too narrow for the coefficients the nuisance columns, as large as these, would replace them
        as_it_is[:, -len(problem.weights) :] = OPTIONS.fixed_nuisance_sd_ratio
        fixed, at_least = np.split(gained_about_zero(problem, as_it_is), 2, axis=1)
        result[:, narrow] = fixed + np.minimum(result[:, narrow] - at_least, 0.0)
    return result


def mean_over_cases(problem: MarginalProblem, prior_scales: FloatArray) -> FloatArray:
    """Mean (k,) of the coefficients of a MarginalProblem of one level at prior_scales (1, terms).

    It is the mean of the mixture over the cases of payload and tilt, which are always free: the prior scales are raised
    until they are.
    """
    share, scales = _mixture(problem, prior_scales)
    return share @ [posterior_mean(problem, scale) for scale in scales]


def over_cases(problem: MarginalProblem, prior_scales: FloatArray) -> tuple[FloatArray, FloatArray]:
    """`mean_over_cases` and the covariance (k, k), without the constraint on positive coefficients."""
    share, scales = _mixture(problem, prior_scales)
    means = np.array([posterior_mean(problem, scale) for scale in scales])
    spreads = np.array([posterior_covariance(problem, scale) for scale in scales])
    mean = share @ means
    apart = means - mean
    return mean, np.einsum("c,cij->ij", share, spreads) + np.einsum("c,ci,cj->ij", share, apart, apart)


def _mixture(problem: MarginalProblem, prior_scales: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Posterior probabilities (c,) of the cases of free payload and tilt, and prior deviations (c, k) in each."""
    if not problem.weights:
        return np.ones(1), problem.scale(prior_scales)
    log, scales = _in_cases(problem, problem.scale(np.maximum(prior_scales, problem.at_least)))
    log = log + gained(problem, scales)[0]
    return np.exp(log - np.logaddexp.reduce(log)), scales


def _over_cases(problem: MarginalProblem, scale: FloatArray) -> FloatArray:
    """`gained` (levels, m) at prior deviations (m, k) with free payload and tilt, averaged over their cases."""
    log, scales = _in_cases(problem, scale)
    return log_sum_exp(gained(problem, scales).reshape(len(problem.gram), len(scale), len(log)) + log)


def _in_cases(problem: MarginalProblem, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Logarithms (c,) of the probabilities of all cases, and prior deviations (m c, k) of rows (m, k) in each."""
    log, shares = _cases(problem.weights)
    scales = np.repeat(scale[:, None], len(log), axis=1)
    scales[..., -shares.shape[1] :] *= shares
    return log, scales.reshape(-1, scale.shape[1])


def cases_of(names: Iterable[str]) -> tuple[FloatArray, FloatArray]:
    """Log probabilities (c,) of all cases, and standard deviations (c, q) of the parameters of these names."""
    return _cases(tuple(name != _EXTRA for name in names))


@cache
def _cases(weights: tuple[bool, ...]) -> tuple[FloatArray, FloatArray]:
    """Log probabilities (c,) of all cases of `MarginalProblem.weights`, and shares (c, q) of their sizes."""
    kinds = sorted(set(weights))
    combined = list(product(_CASES, repeat=len(kinds)))
    shares = [[case[kinds.index(kind)][1] for kind in weights] for case in combined]
    return np.array([sum(np.log(chance) for chance, _ in case) for case in combined]), np.array(shares)
