"""The moment at which something moves once and stays, as where an instrument is bumped or a reflector slips.

For every moment between two stops the residual of the calibration and the known effects is fitted by what is zero
before and the same after it. The moment that reduces the sum of squares most is taken: that of the highest likelihood
(D. Hinkley, Inference about the change-point in a sequence of random variables, Biometrika 57, 1970). All moments are
equally probable before. The instrument or the base moves as a rigid body, the zeros of the drives move, or targets do.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from rrru.arrays import FloatArray
from rrru.diagnosis.aliases import EffectKey
from rrru.diagnosis.discrepancy_basis import JUMPS, Unknown, jump_at, target_sites
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import LinearizedProblem, ModelState
from rrru.diagnosis.terms import EffectTerm, known_basis
from rrru.kinematics.legs import WORLD


def with_jumps(
    problem: DiagnosisProblem, linear: LinearizedProblem, state: ModelState, terms: Sequence[EffectTerm]
) -> tuple[DiagnosisProblem, dict[EffectKey, FloatArray]]:
    """The problem with jumps at their most likely moments in its library, and their columns (m, 3, c).

    linear: about the state of a hypothesis, whose terms are fitted together with each jump; none where the readings
    have too few times.
    """
    time = problem.motion.time_s[problem.at]
    if not np.isfinite(time).all():
        return problem, {}
    basis = known_basis(problem.library, linear, terms)
    left = linear.data.ravel() - basis @ (basis.T @ linear.data.ravel())
    by_row = basis.reshape(*linear.data.shape, -1)
    library, columns = dict(problem.library), {}
    for name, response in _responses(problem, state):
        moments, gains = moment_gains(left.reshape(linear.data.shape), by_row, response, time)
        if not len(moments):
            continue
        moment, log_prior = float(moments[gains.argmax()]), -float(np.log(len(moments)))
        library[name] = jump_at(name, problem.mechanism, moment, log_prior)
        columns[name, 0] = response * (time > moment)[:, None, None]
    return replace(problem, library=library), columns


def jumps(problem: DiagnosisProblem, state: ModelState) -> Iterator[tuple[Unknown, FloatArray]]:
    """Each jump in a problem's library, and the derivative (m, 3, c) of the readings by its coefficients."""
    found = {name: one for name, one in problem.library.items() if name in JUMPS and isinstance(one, Unknown)}
    for name, response in _responses(problem, state) if found else ():
        if name in found:
            yield found[name], response


def moment_gains(
    left: FloatArray, basis: FloatArray, response: FloatArray, time: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Moments (g,) in s between stops, and the reductions (g,) of the sum of squares by a jump at each.

    left (m, 3): residual beyond an orthonormal basis (m, 3, b); response (m, 3, c): derivative by the jump; time (m,)
    in s. Moments that few stops precede or follow are left out: a jump of a few is outliers.
    """
    stops, of_row = np.unique(time, return_inverse=True)
    least = OPTIONS.points_per_stretch
    if len(stops) < 2 * least:
        return np.zeros(0), np.zeros(0)
    order = np.argsort(of_row, kind="stable")
    first = np.searchsorted(of_row[order], np.arange(len(stops)))
    length = np.sqrt((response**2).sum(axis=(0, 1)))
    left, basis, response = left[order], basis[order], response[order] / np.where(length > 0.0, length, 1.0)

    def after(products: FloatArray) -> FloatArray:
        """Sums (g, ..) of products (m, ..) over the stops after each moment."""
        by_stop = np.add.reduceat(products, first, axis=0)
        return np.cumsum(by_stop[::-1], axis=0)[::-1][least : len(stops) - least + 1]

    moment = after(np.einsum("nac,na->nc", response, left))
    whole = after(np.einsum("nac,nad->ncd", response, response))
    taken = after(np.einsum("nab,nac->nbc", basis, response))
    size, turned = np.linalg.eigh(whole - np.einsum("gbc,gbd->gcd", taken, taken))
    # what the calibration absorbs of a jump does not count
    unit = np.trace(whole, axis1=1, axis2=2)[:, None] / whole.shape[-1]
    visible = size > OPTIONS.min_remaining_wave_share * unit
    along = np.einsum("gcd,gc->gd", turned, moment)
    gains = np.where(visible, along**2 / np.where(visible, size, 1.0), 0.0).sum(axis=1)
    middle = 0.5 * (stops[1:] + stops[:-1])
    return middle[least - 1 : len(stops) - least], gains


def _responses(problem: DiagnosisProblem, state: ModelState) -> Iterator[tuple[str, FloatArray]]:
    """Names in JUMPS and the derivative (m, 3, c) of the readings by each jump's coefficients."""
    at = problem.map_of(ModelState(state.deviations, {}))
    of_world, of_drives, of_targets = JUMPS
    yield of_world, problem.of_rows(at.effect(WORLD))
    yield of_drives, problem.of_rows(at.drive_effect)
    if sites := target_sites(problem.mechanism):
        yield of_targets, np.concatenate([problem.of_rows(at.effect(site))[..., :3] for site in sites], axis=-1)
