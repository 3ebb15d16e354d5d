"""Harmonics of the drive angles that a campaign shows: the search for the ratio of a gear that is not stated.

For an order N the residual is fitted by the sine and cosine of N times every drive's value, together with the
calibration and the known effects. The reduction of the sum of squares, over orders, is a periodogram (Lomb,
Least-squares frequency analysis of unequally spaced data, Astrophysics and Space Science 39, 1976). Drives with a range
of s rad resolve orders that differ by 2 pi / s, and none below that.
"""

from dataclasses import replace

import numpy as np

from rrru.diagnosis.discrepancy_basis import UNKNOWN
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.terms import signatures
from rrru.effects.harmonic import drives_of


def resolution(drive):
    """Difference of the orders that drives (n, K) in rad can resolve."""
    return 2.0 * np.pi / float(np.ptp(drive, axis=0).max())


def periodogram(data, drive_effect, drive, nuisance, orders):
    """Reduction (g,) of the sum of squares of data (m, 3) by harmonics of each order (g,).

    drive_effect (m, 3, K): derivative by the drives' values; drive (m, K): these in rad; nuisance (m, 3, b):
    columns that are fitted together with the harmonics.
    """
    basis, _ = np.linalg.qr(nuisance.reshape(data.size, -1))
    left = data.ravel() - basis @ (basis.T @ data.ravel())
    gains = np.empty(len(orders))
    for row, order in enumerate(orders):
        waves = [drive_effect * part(order * drive)[:, None] for part in (np.sin, np.cos)]
        columns = np.concatenate(waves, axis=-1).reshape(data.size, -1)
        taken, moment, whole = basis.T @ columns, columns.T @ left, columns.T @ columns
        size, turned = np.linalg.eigh(whole - taken.T @ taken)
        # a harmonic that the calibration absorbs does not count
        visible = size > OPTIONS.min_remaining_wave_share * np.trace(whole) / len(size)
        gains[row] = ((turned[:, visible].T @ moment) ** 2 / size[visible]).sum()
    return gains


def with_orders(case, linear, terms):
    """The case whose searched effects have the orders that stand out as more shapes, and keys of these (effect, shape).

    linear: about the state of a hypothesis, whose terms are fitted together with the harmonics.
    """
    library, added = dict(case.library), []
    # a rough function of the drives' values contains all harmonics
    broad = any(case.library[term.effect].coordinates.broad for term in terms)
    for name, effect in case.library.items():
        if effect.coordinates.searched is not None and not broad:
            # a discrepancy function would absorb what is searched for
            others = [term for term in terms if term.effect != name and term.effect not in UNKNOWN]
            library[name] = _found(case, linear, effect, others)
            new = range(len(effect.coordinates.shapes), len(library[name].coordinates.shapes))
            added += [(name, shape) for shape in new]
    return replace(case, library=library), added


def _found(case, linear, effect, others):
    """An effect with the orders that stand out added to its shapes."""
    coordinates, search = effect.coordinates, effect.coordinates.searched
    drives = drives_of(case.mechanism, search.unit)
    drive, step = case.motion.drive[:, drives][case.at], resolution(case.motion.drive[:, drives][case.used])
    nuisance = np.concatenate([linear.base, *signatures(case.library, linear, others)], axis=-1)
    orders = np.arange(step, search.highest, step / OPTIONS.orders_per_resolution)
    if len(orders) < 3 or nuisance.shape[-1] > linear.data.size // 2:
        return effect
    gains = periodogram(linear.data, linear.drive[..., drives], drive, nuisance, orders)
    peaks = 1 + np.flatnonzero((gains[1:-1] > gains[:-2]) & (gains[1:-1] > gains[2:]))
    shapes = list(coordinates.shapes)
    for peak in peaks[np.argsort(-gains[peaks])][: OPTIONS.max_periodogram_peaks]:
        order = _vertex(orders, gains, peak)
        present = [search.order(shape[search.name]) for shape in shapes]
        new = min(abs(order - one) for one in present) > OPTIONS.min_order_distance_ratio * step
        if new and len(shapes) < OPTIONS.max_effect_shapes:
            shapes.append(shapes[0] | {search.name: search.value(order)})
    stated, resolved = coordinates.stated or len(coordinates.shapes), len(orders) / OPTIONS.orders_per_resolution
    probability, order_sd = OPTIONS.stated_order_probability, OPTIONS.order_sd_ratio * step
    weights = [probability / stated] * stated + [(1.0 - probability) / resolved] * (len(shapes) - stated)
    found = replace(coordinates, shapes=tuple(shapes), weights=tuple(weights), stated=stated, doubt=order_sd)
    return replace(effect, coordinates=found)


def _vertex(orders, gains, peak):
    """The order at the top of the parabola through a peak and its neighbours."""
    before, at, after = gains[peak - 1 : peak + 2]
    curvature = before - 2.0 * at + after
    return float(orders[peak] + (0.5 * (before - after) / curvature if curvature else 0.0) * (orders[1] - orders[0]))
