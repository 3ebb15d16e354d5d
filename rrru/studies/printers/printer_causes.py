"""What the calibration of a printer leaves: which reading is suspicious, which causes could be behind it, and whether
that is decidable at all.

Left-out readings: the printer is fitted without one reading, and this reading's distance from what the others foretell,
over its standard error, follows Student's t with the others' freedom if all is well (Cook and Weisberg, Residuals and
Influence in Regression, 1982, 2.2). Causes: `printer_evidence` gives p. A cause that passes is found only if no other
cause could explain what it explains, and if it passes without any single reading too.
"""

from dataclasses import dataclass, replace

import numpy as np

from rrru.fit.least_squares import least_squares
from rrru.studies.printers.printer_evidence import BAD_READING, Evidence

FOUND, NOT_FOUND, NOT_DECIDABLE = "found", "not found", "not decidable"
ONE_READING = "not decidable (rests on one reading)"


@dataclass(frozen=True)
class LeftOut:
    """Every reading against the fit of the others.

    difference_mm (n,): reading less what they foretell. ratio (n,): that over its standard error, under the firmware's
    ratio of noises. p (n,): of so large a ratio anywhere among the readings, the largest over the ratios of noises. The
    last two are NaN where the others leave no freedom.
    """

    difference_mm: np.ndarray
    ratio: np.ndarray
    p: np.ndarray

    @property
    def suspect(self):
        """Number of the most suspicious reading, from 0; None where nothing tells."""
        return None if np.isnan(self.p).all() else int(np.lexsort((-np.abs(self.ratio), self.p))[0])


def left_out(result):
    """LeftOut of a PrinterFit, one exact refit per reading; raises FitError where one fails."""
    residuals, freedom = result.residuals, result.freedom - 1
    difference, ratio = np.empty(len(residuals)), np.full(len(residuals), np.nan)
    for reading, weight in enumerate(residuals.root_weight):
        fit = least_squares(residuals.without(reading))
        difference[reading] = residuals.measured_mm[reading] - residuals.predicted_mm(fit.deviations)[reading]
        if freedom > 0 and fit.identifiability.rank == len(fit.deviations):
            row = residuals.jacobian(fit.deviations)[reading, 0]
            variance = 1.0 + row @ fit.identifiability.covariance(1.0) @ row
            ratio[reading] = weight * difference[reading] / (fit.noise_mm * np.sqrt(variance))
    return LeftOut(difference, ratio, Evidence(result).reading_p())


def without(result, reading):
    """The PrinterFit of all readings but one."""
    residuals = result.residuals.without(reading)
    return replace(result, residuals=residuals, fit=least_squares(residuals))


@dataclass(frozen=True)
class Cause:
    """One possible cause of what a calibration leaves.

    freedom: that it uses up. share: of the sum of squares left, that it explains, under the firmware's ratio of noises.
    p: that noise would explain as much, the largest over the ratios; NaN without freedom. estimate, standard_error: in
    `unit`, NaN but for causes with one number. imitated_by: names of causes that hold what it explains.
    """

    name: str
    freedom: int
    share: float
    p: float
    estimate: float
    standard_error: float
    unit: str
    imitated_by: tuple
    verdict: str


def limit_of(result, level, pieces, name):
    """P below which a cause of a PrinterFit passes: the level over the number of its causes (Bonferroni).

    A cause of the machine is asked for over all pieces of evidence together, so that the level is divided by their
    number too; a bad reading is a matter of its own file.
    """
    return level / (1 + len(Evidence(result).columns)) / (1 if name == BAD_READING else pieces)


def causes(result, left, level, imitated_from, pieces=1):
    """Possible causes of what a PrinterFit leaves, a tuple: a bad reading, and those that act on all of them.

    left: its LeftOut. level: probability of a false alarm, over `pieces` of evidence, see `limit_of`. imitated_from:
    share of what a cause explains, from which on another that holds it imitates it. A bad reading that is more striking
    than every other cause is left out before these are looked at; one that is less striking has to stand out beside the
    most striking of them.
    """
    judge = _Judge(
        Evidence(result), *(limit_of(result, level, pieces, name) for name in (BAD_READING, "")), imitated_from
    )
    first, others = judge.bad_reading(left), judge.acting_on_all()
    leader = min(others, key=lambda one: np.nan_to_num(one.p, nan=1.0))
    if first.p < judge.reading_limit and leader.p < first.p:
        p = judge.evidence.reading_p(beside=judge.evidence.columns[leader.name][0])
        p = np.nan if np.isnan(p).all() else float(np.nanmin(p))
        first = replace(first, p=p, verdict=judge.verdict(p, first.imitated_by, judge.reading_limit))
    elif first.p < judge.reading_limit:
        others = replace(judge, evidence=Evidence(without(result, left.suspect))).acting_on_all()
    # what imitates a cause that is seen cannot be ruled out either
    rivals = {
        name for one in (first, *others) if one.verdict in (NOT_DECIDABLE, ONE_READING) for name in one.imitated_by
    }
    return tuple(replace(one, verdict=NOT_DECIDABLE) if one.name in rivals else one for one in (first, *others))


def diagnosis(answers):
    """What the causes say together: causes, "none found", or "not decidable" with those that it could be."""
    if any(np.isnan(one.p) for one in answers):
        return NOT_DECIDABLE
    bad = [one.name for one in answers if one.name == BAD_READING and one.verdict == FOUND]
    rest = [one for one in answers if one.verdict != NOT_FOUND and one.name not in bad]
    names = ", ".join(one.name + one.verdict.removeprefix(NOT_DECIDABLE) * (one.verdict == ONE_READING) for one in rest)
    certain = len(rest) == 1 and rest[0].verdict == FOUND
    return "; ".join([*bad, *([names if certain else f"{NOT_DECIDABLE}: {names}"] if rest else [])]) or "none found"


@dataclass(frozen=True)
class _Judge:
    """Evidence and the bars for it; see `causes`."""

    evidence: Evidence
    reading_limit: float
    limit: float
    imitated_from: float

    def verdict(self, p, imitators, limit, p_without_any=lambda: 0.0):
        """Verdict on a cause from its p and the limit for it; p_without_any: gives its largest p with a single reading
        left out.
        """
        if np.isnan(p) or (p < limit and imitators):
            return NOT_DECIDABLE
        if p >= limit:
            return NOT_FOUND
        return FOUND if p_without_any() < limit else ONE_READING

    def bad_reading(self, left):
        """The cause that one reading is wrong: the most suspicious one."""
        suspect = left.suspect
        imitators = self.evidence.imitators(BAD_READING, self.imitated_from, suspect or 0)
        share = p = estimate = error = np.nan
        if suspect is not None:
            share = self._share(self.evidence.bases[BAD_READING][0][suspect])
            p, estimate = left.p[suspect], left.difference_mm[suspect]
            error = estimate / left.ratio[suspect]
        return Cause(
            BAD_READING, 1, share, p, estimate, error, "mm", imitators, self.verdict(p, imitators, self.reading_limit)
        )

    def acting_on_all(self):
        """The causes that act on all readings."""
        return [self._acting_on_all(name, unit) for name, (_, unit) in self.evidence.columns.items()]

    def _acting_on_all(self, name, unit):
        """One of them."""
        basis, p = self.evidence.bases[name][0][0], float(self.evidence.p(name))
        imitators = self.evidence.imitators(name, self.imitated_from)
        verdict = self.verdict(p, imitators, self.limit, lambda: self.evidence.p_without_any(name))
        return Cause(
            name, basis.shape[1], self._share(basis), p, *self.evidence.estimate(name), unit, imitators, verdict
        )

    def _share(self, basis):
        """Share of the sum of squares left that a basis (n, r) holds, under the firmware's ratio."""
        left = self.evidence.weighings[0].left(self.evidence.readings_mm)
        return min(((left @ basis) ** 2).sum() / (left @ left), 1.0)
