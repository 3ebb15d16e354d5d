"""Where a least-squares search starts: near the nominal robot, or at drives and frames found first."""

from typing import Any

import numpy as np

from rrru.fit.identifiability import parameter_scale

# a median residual above this share of the robot's size is none that its geometry makes: zeros or frames are lost
_FAR = 2e-3
# residual from which on a reading counts less while these are found
_LOOSE_MM = 5.0


def start_of(residuals: Any) -> tuple[np.ndarray, int]:
    """Deviations (p,) to start from, and how many evaluations it took to find them.

    The nominal ones, but where the nominal robot is far off: then the robot's `stages` one after the other, such as
    frames, and with these the drives. All parameters at once would take steps along what is hardly seen for what
    large turns leave to the second order.
    """
    robot, evaluations = residuals.mechanism, 0
    found = robot.parameters.nominal
    left = np.linalg.norm(residuals.residual(found), axis=1)
    if not robot.stages or not np.median(left) > _FAR * robot.size_mm:
        return found, 0
    for stage in robot.stages:
        if stage.any():
            found, more = _along(residuals, found, np.diag(parameter_scale(robot))[:, stage])
            evaluations += more
    return found, evaluations


def _along(residuals: Any, origin: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, int]:
    """Deviations (p,) found from an origin along directions (p, k) alone, and how many evaluations that took."""
    from scipy import optimize

    solution = optimize.least_squares(
        lambda sizes: residuals.residual(origin + directions @ sizes).ravel(),
        np.zeros(directions.shape[1]),
        jac=lambda sizes: residuals.jacobian(origin + directions @ sizes).reshape(-1, len(origin)) @ directions,
        loss="soft_l1",
        f_scale=_LOOSE_MM,
    )
    return origin + directions @ solution.x, int(solution.nfev)
