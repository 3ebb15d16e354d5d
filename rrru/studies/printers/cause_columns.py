"""Derivatives of a printer's readings by the parameters of each possible cause, about the answer."""

import numpy as np

# indices of Ptt3's parameters of a leg
_SLIDER, _ARM, _RISE, _SWING = 0, 1, 4, 5


def cause_columns(result):
    """Derivatives (n, k) of the readings of a PrinterFit by each cause, and the unit where k is 1, by name.

    Arms, towers that lean (three angles outwards, three sideways), and carriages' steps of other lengths, per tower.
    With distances: calipers with a wrong scale or offset, and a measured object that is stretched along x, shrunk along
    y, and skewed.
    """
    residuals = result.residuals
    n, m = len(residuals.height_mm), len(residuals.distance_mm)
    by_place, columns = _by_place(result), {}
    if not m:
        columns["arms"] = arm_columns(result), ""
    else:
        distances = np.concatenate([np.zeros(n), residuals.distance_mm])[:, None]
        places = residuals.places(result.fit.deviations)
        between = places[n : n + m] - places[n + m :]
        x, y, _ = between.T
        shape = np.stack([x**2 - y**2, 2.0 * x * y], axis=1) / np.linalg.norm(between, axis=1, keepdims=True)
        columns["caliper_scale"] = distances, "mm/mm"
        columns["caliper_offset"] = np.sign(distances), "mm"
        columns["object_shape"] = np.concatenate([np.zeros((n, 2)), shape]), ""
    columns["step_scale"] = np.einsum("rnl,nl->rl", by_place[..., _SLIDER], residuals.actuators), ""
    columns["tower_lean"] = lean_columns(result), ""
    return columns


def arm_columns(result):
    """Derivatives (n, 3) of the readings by the arms' lengths."""
    return _by_place(result)[..., _ARM].sum(axis=1)


def lean_columns(result):
    """Derivatives (n, 6) of the readings by leaning towers: three angles outwards, three sideways."""
    by_leg = _by_place(result).sum(axis=1)
    return np.concatenate([by_leg[..., _RISE], by_leg[..., _SWING]], axis=1)


def _by_place(result):
    """Derivatives (n, places, 3, 6) of the readings by the legs' parameters, at every place separately."""
    residuals, deviations = result.residuals, result.fit.deviations
    places = residuals.places(deviations)
    moved = residuals.mechanism.leg_jacobian(places, residuals.actuators, deviations)
    return np.einsum("rna,nalc->rnlc", residuals.gradient(places), moved)
