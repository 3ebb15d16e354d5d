"""What the calibration of a printer leaves: which reading is suspicious, which causes could be behind it, and whether that is decidable at all.

Left-out readings: the printer is fitted without one reading, and this reading's distance from what the others foretell, over its standard
error, follows Student's t with the others' freedom if all is well (Cook and Weisberg, Residuals and Influence in Regression, 1982, 2.2).
Causes: each adds columns to the fit, and F compares what they explain with what they leave. Of a cause only that counts which the
calibration cannot absorb; where two causes have this in common, they imitate each other, and no reading tells which it is.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import optimize, stats

from rrru.calibrate.identifiability import RANK_TOLERANCE
from rrru.calibrate.least_squares import least_squares

FOUND, NOT_FOUND, NOT_DECIDABLE = "found", "not found", "not decidable"
BAD_READING = "bad_reading"
_POWER = 0.9


@dataclass(frozen=True)
class LeftOut:
    """Every reading against the fit of the others.

    difference_mm (n,): reading less what they foretell. ratio (n,): that over its standard error. p (n,): of so large a ratio anywhere among
    the readings (Bonferroni). The last two are NaN where the others leave no freedom.
    """

    difference_mm: np.ndarray
    ratio: np.ndarray
    p: np.ndarray

    @property
    def suspect(self):
        """Number of the reading that fits worst, from 0; None where nothing tells."""
        return None if np.isnan(self.p).all() else int(np.nanargmax(np.abs(self.ratio)))


def left_out(result):
    """LeftOut of a PrinterFit, one exact refit per reading; raises FitError where one fails."""
    residuals, freedom = result.residuals, result.freedom - 1
    difference, ratio = np.empty(len(residuals)), np.full(len(residuals), np.nan)
    for reading, weight in enumerate(residuals.root_weight):
        fit = least_squares(residuals.without(reading))
        difference[reading] = residuals.measured_mm[reading] - residuals.predicted_mm(fit.errors)[reading]
        if freedom > 0 and fit.identifiability.rank == len(fit.errors):
            row = residuals.jacobian(fit.errors)[reading, 0]
            variance = 1.0 + row @ fit.identifiability.covariance(1.0) @ row
            ratio[reading] = weight * difference[reading] / (fit.noise_mm * np.sqrt(variance))
    p = 2.0 * stats.t.sf(np.abs(ratio), freedom) if freedom > 0 else np.full(len(residuals), np.nan)
    return LeftOut(difference, ratio, np.minimum(p * len(residuals), 1.0))


def without(result, reading):
    """The PrinterFit of all readings but one."""
    residuals = result.residuals.without(reading)
    return replace(result, residuals=residuals, fit=least_squares(residuals))


@dataclass(frozen=True)
class Cause:
    """One possible cause of what a calibration leaves.

    freedom: that it uses up. share: of the sum of squares left, that it explains. p: that noise would explain as much; NaN without freedom.
    estimate, standard_error: in `unit`, NaN but for causes with one number. detectable_mm: rms over the readings, of what the calibration
    does not absorb of it, that would be found 9 times of 10. imitated_by: names of causes.
    """

    name: str
    freedom: int
    share: float
    p: float
    estimate: float
    standard_error: float
    unit: str
    detectable_mm: float
    imitated_by: tuple
    verdict: str


def causes(result, left, level, imitated_from):
    """Possible causes of what a PrinterFit leaves, a tuple: a bad reading, and those that act on all of them.

    left: its LeftOut. level: p below which something counts as found, divided by the number of causes (Bonferroni). imitated_from: share of a
    cause's columns from which on another one imitates it. A bad reading that is more striking than every other cause is left out before
    these are looked at; one that is less striking has to stand out beside the most striking of them.
    """
    limit = level / (1 + len(cause_columns(result)))
    remains = _Remains(result, limit, imitated_from)
    first, others = _bad_reading(remains, left), [_acting_on_all(remains, name) for name in remains.columns]
    leader = min(others, key=lambda one: np.nan_to_num(one.p, nan=1.0))
    if first.p < limit and leader.p < first.p:
        p = _worst_beside(remains, leader.name)
        first = replace(first, p=p, verdict=remains.verdict(p, first.imitated_by))
    elif first.p < limit:
        remains = _Remains(without(result, left.suspect), limit, imitated_from)
        others = [_acting_on_all(remains, name) for name in remains.columns]
    # what imitates a cause that is seen cannot be ruled out either
    rivals = {name for one in (first, *others) if one.verdict == NOT_DECIDABLE for name in one.imitated_by}
    return tuple(replace(one, verdict=NOT_DECIDABLE) if one.name in rivals else one for one in (first, *others))


def diagnosis(answers):
    """What the causes say together: causes, "none found", or "not decidable" with those that it could be."""
    if any(np.isnan(one.p) for one in answers):
        return NOT_DECIDABLE
    bad = [one.name for one in answers if one.name == BAD_READING and one.verdict == FOUND]
    rest = [one for one in answers if one.verdict != NOT_FOUND and one.name not in bad]
    names = ", ".join(one.name for one in rest)
    certain = len(rest) == 1 and rest[0].verdict == FOUND
    return "; ".join([*bad, *([names if certain else f"{NOT_DECIDABLE}: {names}"] if rest else [])]) or "none found"


def cause_columns(result):
    """Columns (n, k) that each cause adds to the fit, weighted, and the unit of its number where k is 1, by name."""
    residuals = result.residuals
    heights, weight = len(residuals.height_mm), residuals.root_weight[:, None]
    distances = np.concatenate([np.zeros(heights), residuals.distance_mm])[:, None]
    found = {}
    if len(residuals.distance_mm):
        found["caliper_scale"] = distances, "mm/mm"
        found["caliper_offset"] = np.sign(distances), "mm"
    arms, lean = _by_ends(residuals, result.fit.errors)
    if result.printer.errors == "heights":
        found["arms"] = weight * arms, ""
    found["tower_lean"] = weight * lean, ""
    return found


def _by_ends(residuals, errors):
    """Change of the readings per mm of each arm (n, 3), and per rad of each tower's lean outwards and sideways (n, 6)."""
    mechanism, actuators = residuals.mechanism, residuals.actuators
    places = mechanism.forward(actuators, errors)
    closure, _ = mechanism.closure_jacobians(places, actuators, errors)
    # motion of the platform per change of a closure, as readings: (n, 3 legs) over all places
    change = np.einsum("rna,nal->rnl", residuals.gradient(errors), np.linalg.inv(closure))
    legs = mechanism.legs(errors)
    arms = np.einsum("rnl,l->rl", change, 2.0 * legs[:, 1])
    height = actuators + legs[:, 0]
    # a tower that leans moves its carriage by its height
    moved = [np.einsum("nla,la->nl", closure, direction) * height for direction in (mechanism.radial, mechanism.tangent)]
    return arms, np.concatenate([np.einsum("rnl,nl->rl", change, one) for one in moved], axis=1)


@dataclass(frozen=True)
class _Remains:
    """What a PrinterFit leaves, and what it leaves of every cause; see `causes` for the bars."""

    result: object
    limit: float
    imitated_from: float

    @cached_property
    def residual(self):
        """Weighted residuals (n,)."""
        return self.result.fit.residual_mm[:, 0]

    @cached_property
    def columns(self):
        """See `cause_columns`."""
        return cause_columns(self.result)

    @cached_property
    def calibration(self):
        """Orthonormal basis (n, p) of what the calibration absorbs."""
        return np.linalg.qr(self.result.residuals.jacobian(self.result.fit.errors)[:, 0])[0]

    def of(self, columns):
        """Columns (n, k) less what the calibration absorbs of them."""
        return columns - self.calibration @ (self.calibration.T @ columns)

    def basis(self, columns):
        """Orthonormal basis (n, r) of what the calibration does not absorb of columns (n, k)."""
        basis, size, _ = np.linalg.svd(self.of(columns / np.linalg.norm(columns, axis=0)), full_matrices=False)
        return basis[:, size > RANK_TOLERANCE]

    @cached_property
    def bases(self):
        """Bases of every cause by name; of a bad reading one per reading."""
        single = [self.basis(one[:, None]) for one in np.eye(len(self.residual))]
        return {name: [self.basis(block)] for name, (block, _) in self.columns.items()} | {BAD_READING: single}

    def imitators(self, name, basis):
        """Names of the other causes that hold a basis (n, r) nearly whole."""
        held = {other: max(((one.T @ basis) ** 2).sum() for one in bases) for other, bases in self.bases.items() if other != name}
        return tuple(other for other, share in held.items() if basis.size and share >= self.imitated_from * basis.shape[1])

    def verdict(self, p, imitators):
        """Verdict on a cause from its p."""
        if np.isnan(p) or (p < self.limit and imitators):
            return NOT_DECIDABLE
        return FOUND if p < self.limit else NOT_FOUND

    def detectable_mm(self, count, limit):
        """Rms over the readings of what a cause with `count` columns has to leave to be found 9 times of 10; NaN without freedom."""
        left = self.result.freedom - count
        if not count or left < 1:
            return np.nan
        critical = stats.f.isf(limit, count, left)
        size = optimize.brentq(lambda size: stats.ncf.sf(critical, count, left, size**2) - _POWER, 1e-3, 1e4)
        return float(self.result.fit.noise_mm * size / np.sqrt(len(self.residual)))


def _bad_reading(remains, left):
    """The cause that one reading is wrong: the most suspicious one."""
    suspect = left.suspect
    basis = remains.bases[BAD_READING][suspect or 0]
    imitators = remains.imitators(BAD_READING, basis)
    share = p = estimate = error = np.nan
    if suspect is not None:
        share = ((basis.T @ remains.residual) ** 2).sum() / (remains.residual**2).sum()
        p, estimate = left.p[suspect], left.difference_mm[suspect]
        error = estimate / left.ratio[suspect]
    smallest = remains.detectable_mm(1, remains.limit / len(remains.residual))
    return Cause(BAD_READING, 1, share, p, estimate, error, "mm", smallest, imitators, remains.verdict(p, imitators))


def _worst_beside(remains, name):
    """Bonferroni's p of the worst reading where a cause that acts on all of them is fitted too, NaN without freedom (ibid., eq. 2.2.8)."""
    (basis,) = remains.bases[name]
    residual = remains.residual - basis @ (basis.T @ remains.residual)
    own = 1.0 - (remains.calibration**2).sum(axis=1) - (basis**2).sum(axis=1)
    freedom = remains.result.freedom - basis.shape[1] - 1
    if freedom < 1:
        return np.nan
    others = (residual @ residual - residual**2 / own) / freedom
    return min(2.0 * stats.t.sf(np.abs(residual / np.sqrt(others * own)).max(), freedom) * len(residual), 1.0)


def _acting_on_all(remains, name):
    """One cause that acts on all readings."""
    (columns, unit), (basis,) = remains.columns[name], remains.bases[name]
    residual, count = remains.residual, basis.shape[1]
    total, explained = (residual**2).sum(), ((basis.T @ residual) ** 2).sum()
    freedom = remains.result.freedom - count
    p = estimate = error = np.nan
    if count and freedom > 0:
        noise = (total - explained) / freedom
        p = stats.f.sf(explained / count / noise, count, freedom)
        if columns.shape[1] == 1:
            visible = remains.of(columns)[:, 0]
            estimate, error = visible @ residual / (visible @ visible), np.sqrt(noise / (visible @ visible))
    share, smallest, imitators = min(explained / total, 1.0), remains.detectable_mm(count, remains.limit), remains.imitators(name, basis)
    return Cause(name, count, share, p, estimate, error, unit, smallest, imitators, remains.verdict(p, imitators))
