"""The search of a fit of lengths only: all unknowns at once, at a cost that is linear in the rows.

Levenberg and Marquardt's steps, the rows' own unknowns eliminated first by one small QR each (Golub and Pereyra,
Separable nonlinear least squares: the variable projection method and its applications, Inverse Problems 19, 2003).
"""

import numpy as np

from rrru.fit.lengths_model import LengthModel

_SEARCH = 200
# a start, or a mirrored place, is searched this far before it is compared with the others
SHORT = 25
# rows whose loss is so many times the median's may have ended at a mirrored place
_POOR = 9.0


def settled(
    model: LengthModel, theta: np.ndarray, places: np.ndarray, weight: np.ndarray, bend_mm: float
) -> tuple[np.ndarray, np.ndarray]:
    """The optimum from a start, rows that fit better at a mirrored place moved there and searched again."""
    theta, places = search(model, theta, places, weight, bend_mm)
    if not model.unknown:
        return theta, places
    losses = _cost(model.residual(theta, places) * weight, bend_mm).sum(axis=1)
    poor = np.flatnonzero(losses > _POOR * np.median(losses))
    if not len(poor):
        return theta, places
    rows, held, places = model.rows(poor), weight[poor], places.copy()
    for other in model.mirrored(theta, places[poor]):
        _, other = search(rows, theta, other, held, bend_mm, SHORT, rows_only=True)
        loss = _cost(rows.residual(theta, other) * held, bend_mm).sum(axis=1)
        better = loss < losses[poor] * (1.0 - 1e-6)
        places[poor[better]], losses[poor[better]] = other[better], loss[better]
    return search(model, theta, places, weight, bend_mm)


def _cost(residual: np.ndarray, bend_mm: float) -> np.ndarray:
    """Loss of every reading: the square, or Cauchy's where the bend is finite."""
    return residual**2 if np.isinf(bend_mm) else bend_mm**2 * np.log1p((residual / bend_mm) ** 2)


def search(
    model: LengthModel,
    theta: np.ndarray,
    places: np.ndarray,
    weight: np.ndarray,
    bend_mm: float = np.inf,
    most: int = _SEARCH,
    rows_only: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Theta (p,) and places (N, d) of least loss from a start, or of the places alone under `rows_only`."""
    damping, residual = 1e-3, model.residual(theta, places)
    loss = _cost(residual * weight, bend_mm)
    for _ in range(most):
        root = weight if np.isinf(bend_mm) else weight / np.sqrt(1.0 + (residual / bend_mm) ** 2)
        by_theta, by_place = model.slopes(theta, places)
        by_theta = by_theta[..., :0] if rows_only else by_theta * model.scale
        linear = root * residual, root[..., None] * by_theta, root[..., None] * by_place[..., : model.unknown]
        while True:
            change, moves = _step(*linear, damping)
            new = theta if rows_only else theta + model.scale * change, places + moves if model.unknown else places
            new_residual = model.residual(*new)
            new_loss = _cost(new_residual * weight, bend_mm)
            gain = float(loss.sum() - new_loss.sum())
            if gain >= 0.0 or damping > 1e10:
                break
            damping *= 10.0
        if not gain >= 0.0:
            break
        (theta, places), residual, loss = new, new_residual, new_loss
        damping = max(damping * 0.1, 1e-15)
        if gain <= 1e-13 * float(loss.sum()) + 1e-24 * loss.size:
            break
    return theta, places


def _step(
    residual: np.ndarray, by_theta: np.ndarray, by_place: np.ndarray, damping: float
) -> tuple[np.ndarray, np.ndarray]:
    """Damped Gauss-Newton change (p,) of theta and moves (N, d) of the places."""
    rows, _, unknown = by_place.shape
    numbers = by_theta.shape[-1]
    right = np.concatenate([by_theta, residual[..., None]], axis=-1)
    if unknown:
        brake = np.broadcast_to(np.sqrt(damping) * np.eye(unknown), (rows, unknown, unknown))
        basis, upper = np.linalg.qr(np.concatenate([by_place, brake], axis=1))
        padded = np.concatenate([right, np.zeros((rows, unknown, numbers + 1))], axis=1)
        held = basis.transpose(0, 2, 1) @ padded
        right = padded - basis @ held
    change = np.zeros(numbers)
    if numbers:
        flat = right.reshape(-1, numbers + 1)
        brake = np.diag(np.sqrt(damping) * np.maximum(np.linalg.norm(flat[:, :-1], axis=0), 1e-12))
        change, *_ = np.linalg.lstsq(np.vstack([flat[:, :-1], brake]), -np.append(flat[:, -1], np.zeros(numbers)))
    if not unknown:
        return change, np.zeros((rows, 0))
    return change, -np.linalg.solve(upper, held[..., :-1] @ change[:, None] + held[..., -1:])[..., 0]
