"""Errors of the drives by their angle: which harmonics a campaign shows, and how rough a function is.

Both are estimated from the residuals of the calibration and the known effects. Harmonics are found one after another
(matching pursuit): each has the drive and order that reduce the sum of squares most. The next one is added where it
reduces that by more than the cost of choosing it among all resolved ones. The spectrum of a function is the one of
highest likelihood, its size and the noise chosen with it.
"""

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import gammaln

from rrru.diagnosis.discrepancy_basis import UNKNOWN
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.state import State
from rrru.diagnosis.terms import signatures
from rrru.effects.harmonic import waves


def with_spectra(case, linear, terms):
    """The case whose waves are found and whose spectra are chosen, of effects that no term holds; and keys of these.

    linear: about the state of a hypothesis, whose terms are fitted together with them.
    """
    library, held = dict(case.library), {term.effect for term in terms}
    open_ones = [e for e in library.values() if (e.coordinates.spectra or _is_pending(e)) and e.name not in held]
    if not open_ones:
        return case, []
    # a rough function of the drives' values contains all harmonics: together with it none would be left
    known = [term for term in terms if term.effect not in UNKNOWN and not library[term.effect].coordinates.broad]
    nuisance = np.concatenate([linear.base, *signatures(library, linear, known)], axis=-1)
    basis, _ = np.linalg.qr(nuisance.reshape(linear.data.size, -1))
    data = _without(linear.data.reshape(-1, 1), basis)[:, 0]
    changed = []
    for effect in open_ones:
        if _is_pending(effect):
            found = pursue(data, basis, linear.drive, case.motion.drive[case.at])
            if found[0]:
                library[effect.name] = effect.with_waves(*found)
                changed.append((effect.name, 0))
            elif not len(effect.coordinates):
                # nothing stands out: there is nothing to test
                library.pop(effect.name)
            continue
        columns = _without(linear.columns[effect.name, 0].reshape(len(data), -1), basis)
        best, prior_scale = likeliest(data, columns, effect.coordinates.spectra, basis.shape[1])
        typical = prior_scale * effect.coordinates.spectra[best]
        # the prior pays for the choice among several by the data
        log_prior = effect.coordinates.log_prior - np.log(len(effect.coordinates.spectra))
        chosen = replace(effect.coordinates, typical=typical, spectra=(), sized=True, log_prior=log_prior)
        library[effect.name] = replace(effect, coordinates=chosen)
    return replace(case, library=library), changed


def _is_pending(effect):
    """Whether an effect's waves are still to be found."""
    return effect.with_waves is not None


def _without(columns, basis):
    """Columns (m, k) without what a basis (m, b) makes of them."""
    return columns - basis @ (basis.T @ columns)


def pursue(data, basis, drive_effect, drive):
    """Pairs (drive, order) of the waves that stand out in data (m,), and the log prior of having chosen just these.

    basis (m, b): columns that are fitted together with them; drive_effect (n, 3, K): derivative by the actuator values;
    drive (n, K): these in rad.
    """
    reach = np.ptp(drive, axis=0)
    atoms = [(k, order) for k in range(drive.shape[1]) for order in _orders(reach[k])]
    if not atoms:
        return (), 0.0

    def columns(k, orders):
        """Columns (m, 2 orders) of waves of a drive that the calibration leaves."""
        return _without(_waves_of(drive_effect, drive, k, orders), basis)

    every = np.concatenate([columns(k, _orders(reach[k])) for k in range(drive.shape[1])], axis=1)
    # a harmonic that the calibration absorbs does not count
    least = OPTIONS.min_free_wave_length_ratio * np.linalg.norm(every, axis=0).max()
    unit = _unit(every, least)
    resolved = max(sum(OPTIONS.max_spectrum_order * span / (2.0 * np.pi) for span in reach), 1.0)
    price, freedom = np.log(resolved) + np.log(len(data)), max(len(data) - basis.shape[1], 0)
    # waves_found: an orthonormal basis of the harmonics found
    found, waves_found, left = [], np.zeros((len(data), 0)), data
    while len(found) < min(OPTIONS.max_spectrum_waves, len(data) // OPTIONS.min_numbers_per_spectrum_wave):
        gains = ((unit.T @ left) ** 2).reshape(-1, 2).sum(axis=1)
        if not gains.any():
            break
        k, middle = atoms[int(gains.argmax())]
        step = 2.0 * np.pi / reach[k] / OPTIONS.spectrum_orders_per_resolution
        wave = partial(lambda k, order: _unit(columns(k, np.array([order])), least), k)
        order = _sharpest(left, waves_found, wave, middle, step)
        added = _orthogonal_to(waves_found, wave(order))
        trial = _without(left, added)
        if 0.5 * freedom * np.log((left @ left) / (trial @ trial)) < price:
            break
        found.append((k, order))
        waves_found, left = np.concatenate([waves_found, added], axis=1), trial
        # what is nearer than that is the same wave
        same = [drive == k and abs(one - order) < step for drive, one in atoms]
        unit[:, np.repeat(same, 2)] = 0.0
    return tuple(found), float(gammaln(len(found) + 1) - len(found) * np.log(resolved))


def _sharpest(left, found, wave, middle, step):
    """The order about the middle whose wave reduces the residuals (m,) of the others most.

    found (m, h): orthonormal basis of the harmonics found; wave: from orders to columns (m, 2).

    A wave between two orders of the grid, which lie a step apart, would else be taken for both of them.
    """
    shift, lowest = OPTIONS.max_order_shift_steps * step, OPTIONS.spectrum_orders_per_resolution * step
    bounds = max(middle - shift, lowest), min(middle + shift, OPTIONS.max_spectrum_order)

    def cost(order):
        return -float(((_orthogonal_to(found, wave(order)).T @ left) ** 2).sum())

    return float(minimize_scalar(cost, bounds=bounds, method="bounded").x)


def _orthogonal_to(found, columns):
    """An orthonormal basis (m, r) of what columns (m, c) add to orthonormal ones found (m, h)."""
    # twice, against rounding
    basis, size, _ = np.linalg.svd(_without(_without(columns, found), found), full_matrices=False)
    return basis[:, size > OPTIONS.min_new_wave_length]


def _unit(columns, least):
    """Columns (m, c) of unit length, those shorter than the least zero."""
    norm = np.linalg.norm(columns, axis=0)
    return columns / np.where(norm > least, norm, np.inf)


def amplitudes(case, state, orders):
    """Amplitudes (K, g) in rad of waves of orders (g,) of each drive that fit what a state leaves, one at a time.

    The calibration's parameters are fitted together with each; NaN where they absorb more than 99 % of a wave.
    """
    linear, drive = case.linearise(State(state.deviations, {}), []), case.motion.drive[case.at]
    basis, _ = np.linalg.qr(linear.base.reshape(linear.data.size, -1))
    left, result = case.residual(state).ravel(), np.full((drive.shape[1], len(orders)), np.nan)
    for k, found in enumerate(result):
        whole = _waves_of(linear.drive, drive, k, orders)
        columns = _without(whole, basis)
        pairs, moments = columns.reshape(len(left), -1, 2), (columns.T @ left).reshape(-1, 2)
        grams = np.einsum("mgi,mgj->gij", pairs, pairs)
        squares = (whole**2).sum(axis=0).reshape(-1, 2).mean(axis=1)
        free = np.linalg.eigvalsh(grams)[:, 0] > OPTIONS.min_free_wave_share * squares
        found[free] = np.linalg.norm(np.linalg.solve(grams[free], moments[free, :, None])[:, :, 0], axis=1)
    return result


def _orders(reach):
    """Orders that a drive which swings through so many rad is searched for."""
    step = 2.0 * np.pi / reach if reach > 0.0 else np.inf
    if step >= OPTIONS.max_spectrum_order:
        return np.zeros(0)
    return np.arange(step, OPTIONS.max_spectrum_order, step / OPTIONS.spectrum_orders_per_resolution)


def _waves_of(drive_effect, drive, k, orders):
    """Columns (3 n, 2 orders) of the waves of one drive."""
    made = waves(drive[:, k], orders)
    return (drive_effect[:, :, k, None] * made[:, None, :]).reshape(3 * len(drive), -1)


def likeliest(data, columns, spectra, fitted):
    """Number of the spectrum of highest likelihood and the factor of its sizes: of data (m,) and columns (m, c).

    spectra: sizes (c,) of the coefficients up to a common factor; fitted: number of parameters fitted together with
    them.
    """
    gram, moment, square = columns.T @ columns, columns.T @ data, float(data @ data)
    found = [
        _likeliest_factor(size[:, None] * gram * size, size * moment, square, len(data) - fitted) for size in spectra
    ]
    best = int(np.argmax([value for value, _ in found]))
    return best, found[best][1]


def _likeliest_factor(gram, moment, square, count):
    """Highest log likelihood over the factor of all coefficients, and that factor.

    square: sum of squares with so many degrees of freedom; gram (c, c), moment (c,): of columns of unit coefficients.
    For each ratio of factor and noise the likeliest noise is known.
    """
    value, turned = np.linalg.eigh(gram)
    value, power = np.maximum(value, 0.0), (turned.T @ moment) ** 2

    def noise(log_ratio):
        """Likeliest variance of the noise."""
        return (square - (power / (np.exp(-2.0 * log_ratio) + value)).sum()) / count

    def cost(log_ratio):
        """Minus the log likelihood up to a constant."""
        return 0.5 * count * np.log(noise(log_ratio)) + 0.5 * np.log1p(np.exp(2.0 * log_ratio) * value).sum()

    # a ratio of 1 over the root of the mean square is that of as much signal as noise
    middle = 0.5 * np.log(count / max(value.sum(), 1e-300))
    lowest, highest = OPTIONS.min_log_signal_to_noise, OPTIONS.max_log_signal_to_noise
    tried = middle + np.linspace(lowest, highest, OPTIONS.tried_signal_to_noise)
    best = tried[np.argmin([cost(one) for one in tried])]
    width = tried[1] - tried[0]
    fine = minimize_scalar(cost, bounds=(best - width, best + width), method="bounded")
    return -float(fine.fun), float(np.exp(fine.x) * np.sqrt(noise(fine.x)))
