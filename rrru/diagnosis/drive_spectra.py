"""Errors of the drives by their angle: which harmonics a campaign shows, and how rough a function is.

Both are estimated from the residuals of the calibration and the known effects. Harmonics are found one after another
(matching pursuit): each has the drive and order that reduce the sum of squares most. The next one is added where it
reduces that by more than the cost of choosing it among all resolved ones. The spectrum of a function is the one of
highest likelihood, its size and the noise chosen with it. Its coefficients are then those of the functions that the
drive's measured range resolves, its principal components (Karhunen and Loeve).

The ratio of a gear that is not stated is searched for among all orders N of one harmonic: the residual is fitted by the
sine and cosine of N times every drive's value, together with the calibration and the known effects. The reduction of
the sum of squares, over orders, is a periodogram (Lomb, Least-squares frequency analysis of unequally spaced data,
Astrophysics and Space Science 39, 1976). Drives with a range of s rad resolve orders that differ by 2 pi / s. Slower
waves are tried down to half of that.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import block_diag, qr
from scipy.optimize import minimize_scalar
from scipy.special import gammaln

from rrru.arrays import BoolArray, FloatArray
from rrru.diagnosis.aliases import EffectKey
from rrru.diagnosis.discrepancy_basis import UNKNOWN
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import LinearizedProblem, ModelState
from rrru.diagnosis.terms import EffectTerm, known_basis, signatures
from rrru.effects.harmonic import drives_of, waves
from rrru.effects.protocol import Effect, Motion, Search

# places of a drive's measured range: on one turn a wave of order 128 has five and more
_PLACES = 721
# share of the largest function's power below which a function is rounding
_LEAST_POWER = 1e-10


def with_spectra(
    problem: DiagnosisProblem, linear: LinearizedProblem, terms: Sequence[EffectTerm]
) -> tuple[DiagnosisProblem, list[EffectKey]]:
    """The problem whose waves are found and whose spectra are chosen, of effects that no term holds; and keys of these.

    linear: about the state of a hypothesis, whose terms are fitted together with them.
    """
    library, held = dict(problem.library), {term.effect for term in terms}
    open_ones = [e for e in problem.effects.values() if (e.coordinates.roots or e.with_waves) and e.name not in held]
    if not open_ones:
        return problem, []
    # a rough function of the drives' values contains all harmonics: together with it none would be left
    basis = known_basis(library, linear, terms)
    data = _without(linear.data.reshape(-1, 1), basis)[:, 0]
    changed = []
    for effect in open_ones:
        if effect.with_waves is not None:
            found = pursue(data, basis, linear.drive, problem.motion.drive[problem.at])
            if found[0]:
                library[effect.name] = effect.with_waves(*found)
                changed.append((effect.name, 0))
            elif not len(effect.coordinates):
                # nothing stands out: there is nothing to test
                library.pop(effect.name)
            continue
        columns, roots = linear.columns[effect.name, 0].reshape(len(data), -1), effect.coordinates.roots
        of_one = effect.coordinates.of_one
        step = one_step(data, basis, linear.drive, problem.motion.drive[problem.at]) if any(of_one) else -np.inf
        likely = likeliest(data, _without(columns, basis), (roots, of_one), basis.shape[1], step)
        best, prior_scale, noise, err, steps = likely
        by_drive = _visible(columns, roots[best], prior_scale / noise)
        library[effect.name] = replace(_chosen(effect, by_drive, prior_scale, err), steps=steps)
        changed.append((effect.name, 0))
    return replace(problem, library=library), changed


def _without(columns: FloatArray, basis: FloatArray) -> FloatArray:
    """Columns (m, k) without what a basis (m, b) makes of them."""
    return columns - basis @ (basis.T @ columns)


def pursue(
    data: FloatArray, basis: FloatArray, drive_effect: FloatArray, drive: FloatArray
) -> tuple[tuple[tuple[int, float], ...], float]:
    """Pairs (drive, order) of the waves that stand out in data (m,), and the log prior of having chosen just these.

    basis (m, b): columns that are fitted together with them; drive_effect (n, 3, K): derivative by the actuator values;
    drive (n, K): these in rad.
    """
    reach = np.ptp(drive, axis=0)
    atoms = [(k, order) for k in range(drive.shape[1]) for order in _orders(reach[k])]
    if not atoms:
        return (), 0.0

    def columns(k: int, orders: FloatArray) -> FloatArray:
        """Columns (m, 2 orders) of waves of a drive that the calibration leaves."""
        return _without(_waves_of(drive_effect, drive, k, orders), basis)

    every = np.concatenate([columns(k, _orders(reach[k])) for k in range(drive.shape[1])], axis=1)
    # a harmonic that the calibration absorbs does not count
    least = OPTIONS.min_free_wave_length_ratio * np.linalg.norm(every, axis=0).max()
    unit = _unit(every, least)
    resolved = max(sum(OPTIONS.max_spectrum_order * span / (2.0 * np.pi) for span in reach), 1.0)
    price, freedom = np.log(resolved) + np.log(len(data)), max(len(data) - basis.shape[1], 0)
    # waves_found: an orthonormal basis of the harmonics found
    found: list[tuple[int, float]] = []
    waves_found, left = np.zeros((len(data), 0)), data
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


def _sharpest(
    left: FloatArray, found: FloatArray, wave: Callable[[float], FloatArray], middle: float, step: float
) -> float:
    """The order about the middle whose wave reduces the residuals (m,) of the others most.

    found (m, h): orthonormal basis of the harmonics found; wave: from orders to columns (m, 2).

    A wave between two orders of the grid, which lie a step apart, would else be taken for both of them.
    """
    shift, lowest = OPTIONS.max_order_shift_steps * step, OPTIONS.spectrum_orders_per_resolution * step
    bounds = max(middle - shift, lowest), min(middle + shift, OPTIONS.max_spectrum_order)

    def cost(order: float) -> float:
        return -float(((_orthogonal_to(found, wave(order)).T @ left) ** 2).sum())

    return float(minimize_scalar(cost, bounds=bounds, method="bounded").x)


def _orthogonal_to(found: FloatArray, columns: FloatArray) -> FloatArray:
    """An orthonormal basis (m, r) of what columns (m, c) add to orthonormal ones found (m, h)."""
    # twice, against rounding
    basis, size, _ = np.linalg.svd(_without(_without(columns, found), found), full_matrices=False)
    return basis[:, size > OPTIONS.min_new_wave_length]


def _unit(columns: FloatArray, least: float) -> FloatArray:
    """Columns (m, c) of unit length, those shorter than the least zero."""
    norm = np.linalg.norm(columns, axis=0)
    return columns / np.where(norm > least, norm, np.inf)


def amplitudes(problem: DiagnosisProblem, state: ModelState, orders: FloatArray) -> FloatArray:
    """Amplitudes (K, g) in rad of waves of orders (g,) of each drive that fit what a state leaves, one at a time.

    The calibration's parameters are fitted together with each; NaN where they absorb more than 99 % of a wave.
    """
    linear, drive = problem.linearise(ModelState(state.deviations, {}), []), problem.motion.drive[problem.at]
    basis, _ = np.linalg.qr(linear.base.reshape(linear.data.size, -1))
    left, result = problem.residual(state).ravel(), np.full((drive.shape[1], len(orders)), np.nan)
    for k, found in enumerate(result):
        whole = _waves_of(linear.drive, drive, k, orders)
        columns = _without(whole, basis)
        pairs, moments = columns.reshape(len(left), -1, 2), (columns.T @ left).reshape(-1, 2)
        grams = np.einsum("mgi,mgj->gij", pairs, pairs)
        squares = (whole**2).sum(axis=0).reshape(-1, 2).mean(axis=1)
        free = np.linalg.eigvalsh(grams)[:, 0] > OPTIONS.min_free_wave_share * squares
        found[free] = np.linalg.norm(np.linalg.solve(grams[free], moments[free, :, None])[:, :, 0], axis=1)
    return result


def _orders(reach: float) -> FloatArray:
    """Orders that a drive which swings through so many rad is searched for."""
    step = 2.0 * np.pi / reach if reach > 0.0 else np.inf
    if step >= OPTIONS.max_spectrum_order:
        return np.zeros(0)
    return np.arange(step, OPTIONS.max_spectrum_order, step / OPTIONS.spectrum_orders_per_resolution)


def _waves_of(drive_effect: FloatArray, drive: FloatArray, k: int, orders: FloatArray) -> FloatArray:
    """Columns (3 n, 2 orders) of the waves of one drive."""
    made = waves(drive[:, k], orders)
    return np.asarray((drive_effect[:, :, k, None] * made[:, None, :]).reshape(3 * len(drive), -1))


def resolved(effect: Effect, motion: Motion) -> Effect:
    """An effect of several spectra with coordinates that the drives' measured ranges resolve; else the effect itself.

    Functions that are smaller than rounding in the whole range are left out: the rest makes the same Gaussian process
    there.
    """
    spectra = effect.coordinates.spectra
    if not spectra or effect.along_drives is None:
        return effect
    by_drive = effect.along_drives(replace(motion, drive=over_range(motion.drive)))
    ends = np.cumsum([functions.shape[1] for functions in by_drive])[:-1]
    sizes = [np.split(size, ends) for size in spectra]
    mixtures, roots = [], []
    for k, functions in enumerate(by_drive):
        # the largest size that any spectrum gives a coefficient
        most = np.max([size[k] / size[k].max() for size in sizes], axis=0)
        scaled = functions * most
        power, turned = np.linalg.eigh(scaled.T @ scaled)
        seen = _canonical(turned[:, power > _LEAST_POWER * power[-1]])
        mixtures.append(most[:, None] * seen)
        roots.append([_root(seen.T * _rounded(size[k] / most) ** 2 @ seen) for size in sizes])
    changes = {"spectra": (), "roots": tuple(zip(*roots, strict=True))}
    return _mixed(effect, mixtures, changes)


def over_range(drive: FloatArray) -> FloatArray:
    """Values (_PLACES, K) that are even over the range of each drive's values (n, K)."""
    low, high = np.nanmin(drive, axis=0), np.nanmax(drive, axis=0)
    return np.asarray(low + np.linspace(0.0, 1.0, _PLACES)[:, None] * (high - low))


def jumps(value: FloatArray, known_at: FloatArray, known: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A function (n,) before and after each of the values (n,), at the next ones (m,) at which it is known, and the
    probability (n,) that it has changed there if it jumps in between.

    A function that changes by d at once, and at any place alike, has changed at the share u of the way with the
    probability u: its variance is d^2 u (1 - u).
    """
    at, number = np.unique(known_at, return_index=True)
    known, width = known[number], np.diff(at)
    left = np.clip(np.searchsorted(at, value, side="right") - 1, 0, len(width) - 1)
    share = np.clip((value - at[left]) / width[left], 0.0, 1.0)
    return known[left], known[left + 1], np.asarray(share)


def _rounded(sizes: FloatArray) -> FloatArray:
    """Sizes, zero where they are rounding: arithmetic of the smallest numbers is slow."""
    return np.where(sizes**2 > _LEAST_POWER**2 * (sizes**2).max(), sizes, 0.0)


def _root(covariance: FloatArray) -> FloatArray:
    """A matrix (c, r) with root @ root.T equal to a covariance (c, c) within rounding."""
    variance, turned = np.linalg.eigh(covariance)
    free = variance > _LEAST_POWER * variance[-1]
    return np.asarray(turned[:, free] * np.sqrt(variance[free]))


def _canonical(root: FloatArray) -> FloatArray:
    """The root (c, r) of a covariance that does not depend on rounding, as eigenvectors of equal values do."""
    # pivoted Cholesky factor; of pivots that are alike, the first one
    preferred = 1.0 - 1e-6 * np.arange(len(root)) / len(root)
    pivots = qr(root.T * preferred, mode="r", pivoting=True)[1]
    triangle = qr(root.T[:, pivots], mode="economic")[1]
    result = np.empty_like(root)
    result[pivots] = (triangle * np.where(np.diag(triangle) < 0.0, -1.0, 1.0)[:, None]).T
    return result


def _mixed(effect: Effect, by_drive: Sequence[FloatArray], changes: Mapping[str, Any]) -> Effect:
    """An effect with mixtures (c_k, r_k), by drive, of its coordinates; changes: of the Coordinates otherwise."""
    before, functions = effect.coordinates, effect.along_drives
    # an effect with spectra is linear in functions of the drives
    assert functions is not None
    mixture, count = block_diag(*by_drive), [its.shape[1] for its in by_drive]
    after = replace(
        before,
        typical=np.ones(len(mixture.T)),
        legs=np.repeat(np.unique(before.legs), count),
        positive=np.zeros(len(mixture.T), dtype=bool),
        to_values=lambda values, shape: before.to_values(mixture @ values, shape),
    )

    def along_drives(motion: Motion) -> list[FloatArray]:
        return [whole @ its for whole, its in zip(functions(motion), by_drive, strict=True)]

    return replace(effect, coordinates=replace(after, **changes), along_drives=along_drives)


def _visible(columns: FloatArray, by_drive: Sequence[FloatArray], size: float) -> list[FloatArray]:
    """Mixtures (c_k, r_k) of the columns (m, c) of each drive, independent ones that are not far below the noise.

    size: prior s.d. of a unit, in s.d. of the noise.
    """
    ends, result = np.cumsum([len(root) for root in by_drive])[:-1], []
    for own, root in zip(np.split(columns, ends, axis=1), by_drive, strict=True):
        made = own @ root
        power, turned = np.linalg.eigh(made.T @ made)
        shows = np.maximum(power, 0.0) * size**2 > OPTIONS.min_function_power_per_noise
        shows[-1] = True
        result.append(_canonical(root @ turned[:, shows]))
    return result


def _chosen(effect: Effect, by_drive: Sequence[FloatArray], prior_scale: float, err: BoolArray) -> Effect:
    """An effect of one spectrum, whose coordinates are mixtures (c_k, r_k) by drive of one prior s.d.

    err (K,): the drives that err where the spectrum is likeliest.
    """
    coordinates = effect.coordinates
    unit = max(np.abs(its).max() for its in by_drive)
    typical = np.full(sum(its.shape[1] for its in by_drive), prior_scale * unit)
    # the prior pays for the choice among several by the data
    log_prior = coordinates.log_prior - np.log(len(coordinates.roots))
    sized = tuple(np.unique(coordinates.legs)[err].tolist())
    changes = {"typical": typical, "roots": (), "sized": sized, "log_prior": log_prior}
    return _mixed(effect, [its / unit for its in by_drive], changes)


def likeliest(
    data: FloatArray,
    columns: FloatArray,
    spectra: tuple[tuple[tuple[FloatArray, ...], ...], tuple[bool, ...]],
    fitted: int,
    step: float = -np.inf,
) -> tuple[int, float, float, BoolArray, float]:
    """The likeliest spectrum of data (m,): its number, the factor of its sizes, the noise, which drives (K,) err, and
    the probability that the function has steps, those of a spectrum of one drive alone or one.

    columns (m, c); spectra: `roots` and `of_one` as of `Coordinates`. All drives together and each one alone are tried,
    whatever is likeliest counts. fitted: number of parameters fitted together with them; step: of `one_step`.
    """
    gram, moment, square = columns.T @ columns, columns.T @ data, float(data @ data)
    found = []
    for number, (by_drive, of_one) in enumerate(zip(*spectra, strict=True)):
        root = block_diag(*by_drive)
        scaled, along = root.T @ gram @ root, root.T @ moment
        drive = np.repeat(np.arange(len(by_drive)), [its.shape[1] for its in by_drive])
        alone = [drive == k for k in range(len(by_drive))]
        for its in alone if of_one or len(alone) == 1 else (drive >= 0, *alone):
            value, factor, noise = _likeliest_factor(scaled[np.ix_(its, its)], along[its], square, len(data) - fitted)
            # each drive is as probable as another
            value -= (not its.all()) * np.log(len(by_drive))
            found.append((value, number, factor, noise, np.unique(drive[its])))
    _, number, factor, noise, erring = max(found, key=lambda one: one[:2])
    values = np.array([*(value for value, *_ in found), step])
    weight = np.exp(values - values.max())
    steps = weight[[*(spectra[1][one] for _, one, *_ in found), True]].sum() / weight.sum()
    return number, factor, noise, np.isin(np.arange(len(spectra[0][number])), erring), float(steps)


def one_step(data: FloatArray, basis: FloatArray, drive_effect: FloatArray, drive: FloatArray) -> float:
    """Log likelihood of data (m,) under one step of one drive's error, up to the constant of `likeliest`.

    Every drive and place of its range is equally probable; size and noise are the likeliest for each. A step explains E
    of the sum of squares S of count numbers. Its likeliest signal is t = (count E - S) / (S - E) times the noise, up
    to the largest signal that is tried for a spectrum.
    basis (m, b): columns that are fitted together with it; drive_effect (n, 3, K): derivative by the actuator values;
    drive (n, K): these. No spectrum has a step as its typical function, since it is flat on both sides of it.
    """
    count, square, found = len(data) - basis.shape[1], float(data @ data), []
    # of exact data: without noise no likelihood would be finite
    highest = count * np.exp(2.0 * OPTIONS.max_log_signal_to_noise)
    for response, value in zip(np.moveaxis(drive_effect, 2, 0), drive.T, strict=True):
        order = np.argsort(value, kind="stable")
        (ends,) = np.nonzero(np.diff(value[order]))
        made = np.einsum("na,nab->nb", response, basis.reshape(*response.shape, -1))
        rows = np.column_stack([(response**2).sum(axis=1), (response * data.reshape(response.shape)).sum(axis=1), made])
        # sums over the readings beyond each place
        size, moment, *taken = (rows[order].sum(axis=0) - np.cumsum(rows[order], axis=0)[ends]).T
        free = size - np.sum(np.square(taken), axis=0)
        explained = np.where(free > OPTIONS.min_free_wave_share * size, moment**2 / np.maximum(free, 1e-300), 0.0)
        signal = np.clip((count * explained - square) / np.maximum(square - explained, 1e-300), 0.0, highest)
        noise = (square - explained * signal / (1.0 + signal)) / count
        width = np.diff(value[order])[ends] / max(np.ptp(value), 1e-300)
        found.append(np.log(width) - 0.5 * count * np.log(noise) - 0.5 * np.log1p(signal))
    return float(np.logaddexp.reduce(np.concatenate(found)) - np.log(len(found)))


def _likeliest_factor(gram: FloatArray, moment: FloatArray, square: float, count: int) -> tuple[float, float, float]:
    """Highest log likelihood over the factor of all coefficients, that factor, and the s.d. of the noise with it.

    square: sum of squares with so many degrees of freedom; gram (c, c), moment (c,): of columns of unit coefficients.
    For each ratio of factor and noise the likeliest noise is known.
    """
    value, turned = np.linalg.eigh(gram)
    value, power = np.maximum(value, 0.0), (turned.T @ moment) ** 2

    def noise(log_ratio: float) -> float:
        """Likeliest variance of the noise."""
        return float((square - (power / (np.exp(-2.0 * log_ratio) + value)).sum()) / count)

    def cost(log_ratio: float) -> float:
        """Minus the log likelihood up to a constant."""
        return float(0.5 * count * np.log(noise(log_ratio)) + 0.5 * np.log1p(np.exp(2.0 * log_ratio) * value).sum())

    # a ratio of 1 over the root of the mean square is that of as much signal as noise
    middle = 0.5 * np.log(count / max(value.sum(), 1e-300))
    lowest, highest = OPTIONS.min_log_signal_to_noise, OPTIONS.max_log_signal_to_noise
    tried = middle + np.linspace(lowest, highest, OPTIONS.tried_signal_to_noise)
    best = tried[np.argmin([cost(one) for one in tried])]
    width = tried[1] - tried[0]
    fine = minimize_scalar(cost, bounds=(best - width, best + width), method="bounded")
    noise_sd = np.sqrt(noise(fine.x))
    return -float(fine.fun), float(np.exp(fine.x) * noise_sd), float(noise_sd)


def resolution(drive: FloatArray) -> float:
    """Difference of the orders that drives (n, K) in rad can resolve."""
    return 2.0 * np.pi / float(np.ptp(drive, axis=0).max())


def periodogram(
    data: FloatArray, drive_effect: FloatArray, drive: FloatArray, nuisance: FloatArray, orders: FloatArray
) -> FloatArray:
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


def with_orders(
    problem: DiagnosisProblem, linear: LinearizedProblem, terms: Sequence[EffectTerm]
) -> tuple[DiagnosisProblem, list[EffectKey]]:
    """The problem whose searched effects have the outstanding orders as more shapes, and keys of these (effect, shape).

    linear: about the state of a hypothesis, whose terms are fitted together with the harmonics.
    """
    library, added = dict(problem.library), []
    # a rough function of the drives' values contains all harmonics
    broad = any(problem.library[term.effect].coordinates.broad for term in terms)
    for name, effect in problem.effects.items():
        if (search := effect.coordinates.searched) is not None and not broad:
            # a discrepancy function would absorb what is searched for
            others = [term for term in terms if term.effect != name and term.effect not in UNKNOWN]
            library[name] = _found(problem, linear, (effect, search), others)
            new = range(len(effect.coordinates.shapes), len(library[name].coordinates.shapes))
            added += [(name, shape) for shape in new]
    return replace(problem, library=library), added


def _found(
    problem: DiagnosisProblem, linear: LinearizedProblem, searched: tuple[Effect, Search], others: Sequence[EffectTerm]
) -> Effect:
    """An effect with the orders that stand out added to its shapes; searched: the effect, and what its Search is."""
    effect, search = searched
    coordinates = effect.coordinates
    drives = drives_of(problem.mechanism, search.unit)
    drive, step = problem.motion.drive[:, drives][problem.at], resolution(problem.motion.drive[:, drives][problem.used])
    nuisance = np.concatenate([linear.base, *signatures(problem.library, linear, others)], axis=-1)
    orders = searched_orders(search, step)
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
            shapes.append(dict(shapes[0]) | {search.name: search.value(order)})
    stated, resolved = coordinates.stated or len(coordinates.shapes), len(orders) / OPTIONS.orders_per_resolution
    probability, order_sd = OPTIONS.stated_order_probability, OPTIONS.order_sd_ratio * step
    weights = [probability / stated] * stated + [(1.0 - probability) / resolved] * (len(shapes) - stated)
    found = replace(coordinates, shapes=tuple(shapes), weights=tuple(weights), stated=stated, doubt=order_sd)
    return replace(effect, coordinates=found)


def searched_orders(search: Search, step: float) -> FloatArray:
    """Orders (g,) that are tried for a Search, of drives that resolve orders a step apart."""
    fine, lowest = step / OPTIONS.orders_per_resolution, max(OPTIONS.lowest_order_ratio * step, search.lowest)
    steps = np.arange(np.ceil((lowest - step) / fine), np.ceil((search.highest - step) / fine))
    return np.asarray(step + fine * steps, dtype=float)


def _vertex(orders: FloatArray, gains: FloatArray, peak: int) -> float:
    """The order at the top of the parabola through a peak and its neighbours."""
    before, at, after = gains[peak - 1 : peak + 2]
    curvature = before - 2.0 * at + after
    return float(orders[peak] + (0.5 * (before - after) / curvature if curvature else 0.0) * (orders[1] - orders[0]))
