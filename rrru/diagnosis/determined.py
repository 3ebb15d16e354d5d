"""Whether a campaign's readings determine the calibration, with numbers to spare for the noise and for effects.

A linear model whose Jacobian (m, p) has the rank r leaves m - r degrees of freedom of m numbers read. Combinations of
parameters that the numbers do not determine stay at their prior and cost none.
"""

from dataclasses import replace

import numpy as np

from rrru.arrays import BoolArray, FloatArray
from rrru.diagnosis.approach_direction import has_direction
from rrru.diagnosis.calibrate import observations_of
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import RANK_TOLERANCE
from rrru.errors import FitError


def require_determined(problem: DiagnosisProblem, whose: str = "") -> DiagnosisProblem:
    """The problem without effects that lack what they need at too many readings.

    The others have to determine the calibration with `OPTIONS.min_spare_numbers` to spare. whose: first words of a
    message. Raises FitError where all readings together do not.
    """
    jacobian = observations_of(problem).jacobian(problem.mechanism.parameters.nominal)
    rank = _rank(jacobian)
    if why := _why_undetermined(problem, rank):
        raise FitError(f"{whose}{why}")
    few = {}
    for name in problem.known:
        rows = problem.complete([name])
        if rows.mean() < OPTIONS.min_complete_share or not _is_determined(jacobian[rows], rank):
            few[name] = _too_few(problem, name, rows, rank)
    if not few:
        return problem
    library = {name: effect for name, effect in problem.library.items() if name not in few}
    # a discrepancy function is no effect of the library and needs no reason
    reasons = {name: reason for name, reason in few.items() if name in problem.effects}
    known = {name: points for name, points in problem.known.items() if name not in few}
    return replace(problem, library=library, untestable=problem.untestable | reasons, known=known)


def poses_needed(problem: DiagnosisProblem) -> tuple[int, int, int]:
    """Rank of the calibration at a problem's poses, least number of poses for a diagnosis, number of poses read."""
    rank = _rank(observations_of(problem).jacobian(problem.mechanism.parameters.nominal))
    poses = len(np.unique(problem.stop))
    return rank, int(np.ceil((rank + OPTIONS.min_spare_numbers) * poses / (3 * len(problem)))), poses


def few_readings(problem: DiagnosisProblem) -> str | None:
    """A sentence on how little a diagnosis of few readings finds, None where they are many."""
    numbers, count = 3 * len(problem), len(problem.mechanism.parameters)
    if numbers >= OPTIONS.few_numbers_per_parameter * count:
        return None
    found = "an effect is found from about the size detectable_mm in gap_identifiability on"
    return f"few readings: {numbers} numbers for {count} parameters of the calibration; {found}"


def _is_determined(jacobian: FloatArray, rank: int) -> bool:
    """Whether readings with this Jacobian (m, 3, p) have the rank, and the least number of spare numbers."""
    return 3 * len(jacobian) >= rank + OPTIONS.min_spare_numbers and _rank(jacobian) == rank


def _rank(jacobian: FloatArray) -> int:
    """Numerical rank of a Jacobian (m, 3, p) whose columns are scaled to unit length."""
    flat = jacobian.reshape(-1, jacobian.shape[-1])
    size = np.maximum(np.linalg.norm(flat, axis=0), 1e-300)
    return int(np.linalg.matrix_rank(np.linalg.qr(flat / size, mode="r"), rtol=RANK_TOLERANCE))


def _why_undetermined(problem: DiagnosisProblem, rank: int) -> str:
    """Why readings of this rank are too few for a diagnosis and what to do, empty where they are not."""
    numbers, needed = 3 * len(problem), rank + OPTIONS.min_spare_numbers
    if numbers >= needed:
        return ""
    poses = len(np.unique(problem.stop))
    more = int(np.ceil((needed - numbers) * poses / numbers))
    read = f"{numbers} numbers read at {poses} poses are too few for a diagnosis of {rank} parameters"
    fewer = "or name a smaller set of parameters under `errors` of the campaign"
    return f"{read}; allowed: at least {needed}: measure {more} more poses {fewer}"


def _too_few(problem: DiagnosisProblem, name: str, rows: BoolArray, rank: int) -> str:
    """Why an effect whose needs are known at some rows (m,) only is not tested."""
    what = "what it needs"
    if has_direction(problem.library[name]):
        what = "the sense in which the drives arrive, unknown at starts of runs and next to reversals of a drive,"
    points, numbers = len(np.unique(problem.at[rows])), 3 * int(rows.sum())
    least = f"the calibration's {rank} parameters with {OPTIONS.min_spare_numbers} to spare"
    allowed = f"at least {OPTIONS.min_complete_share:.0%} of them whose numbers ({numbers}) determine {least}"
    return f"{what} is known at {points} of {problem.count} points; allowed: {allowed}"
