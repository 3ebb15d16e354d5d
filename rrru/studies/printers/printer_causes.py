"""What the calibration of a printer leaves: which reading is suspicious, which causes could be behind it.

Left-out readings: the printer is fitted without one reading, and this reading's distance from what the others foretell,
over its standard error, follows Student's t with the others' freedom if all is well (Cook and Weisberg, Residuals and
Influence in Regression, 1982, 2.2). Causes: `cause_tests` gives p. A cause that passes is found only if no other cause
could explain what it explains, and if it passes without any single reading too; else it is not decidable.
"""

from dataclasses import dataclass, replace

import numpy as np

from rrru.calibration.calibrate import calibrate
from rrru.studies.printers.cause_tests import BAD_READING, CauseTests

FOUND, NOT_FOUND, NOT_DECIDABLE = "found", "not found", "not decidable"
ONE_READING = "not decidable (rests on one reading)"


@dataclass(frozen=True)
class LeftOut:
    """Every reading against the fit of the others.

    difference_mm (n,): reading less what they foretell. ratio (n,): that over its standard error, under the firmware's
    ratio of noises. p (n,): of so large a ratio anywhere among the readings; see `cause_tests`. The last two are NaN
    where the others leave no freedom.
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
        fit = calibrate(residuals.without(reading))
        difference[reading] = residuals.measured_mm[reading] - residuals.predicted_mm(fit.deviations)[reading]
        if freedom > 0 and fit.identifiability.rank == len(fit.deviations):
            row = residuals.jacobian(fit.deviations)[reading, 0]
            variance = 1.0 + row @ fit.identifiability.covariance(1.0) @ row
            ratio[reading] = weight * difference[reading] / (fit.noise_mm * np.sqrt(variance))
    return LeftOut(difference, ratio, CauseTests(result).p(BAD_READING))


def without(result, reading):
    """The PrinterFit of all readings but one."""
    return replace(result, fit=calibrate(result.residuals.without(reading)))


@dataclass(frozen=True)
class Cause:
    """One possible cause of what a calibration leaves.

    freedom_used: numbers that it adds. explained_share: of the sum of squares left, under the firmware's ratio of
    noises. p: that noise would explain as much; NaN without freedom. estimate, standard_error: in `unit`, NaN but for
    causes with one number. imitated_by: causes that hold what it explains. limit: that p has to be below.
    """

    cause: str
    freedom_used: int
    explained_share: float
    p: float
    estimate: float
    standard_error: float
    unit: str
    imitated_by: tuple
    verdict: str
    limit: float


@dataclass(frozen=True)
class Level:
    """How surely a cause has to show.

    level: probability of a false alarm over the causes of all `pieces` of evidence; imitated_from: share of what a
    cause explains, from which on another that holds it imitates it.
    """

    level: float
    imitated_from: float
    pieces: int = 1

    def limit(self, tests, name, more=0):
        """P below which a cause passes: the level over the number of causes (Bonferroni), and of more beside them.

        A cause of the machine is asked for over all pieces of evidence together, so that the level is divided by their
        number too; a bad reading is a matter of its own file.
        """
        return self.level / (1 + more + len(tests.columns)) / (1 if name == BAD_READING else self.pieces)


def causes(result, left, level):
    """Possible causes of what a PrinterFit leaves, a tuple: a bad reading, and those that act on all of them.

    left: its LeftOut; level: `Level`. A bad reading that is more striking than every other cause is left out before
    these are looked at; one that is less striking has to stand out beside the most striking of them.
    """
    tests = CauseTests(result)
    first, others = _bad_reading(tests, left, level), _acting_on_all(tests, level)
    leader = min(others, key=lambda one: np.nan_to_num(one.p, nan=1.0))
    if first.p < first.limit and leader.p < first.p:
        p = float(np.min(tests.p(BAD_READING, beside=tests.columns[leader.cause][0])))
        first = replace(first, p=p, verdict=_verdict(p, first.imitated_by, first.limit))
    elif first.p < first.limit:
        others = _acting_on_all(CauseTests(without(result, left.suspect)), level)
    # what imitates a cause that is seen cannot be ruled out either
    seen = [one for one in (first, *others) if one.verdict in (NOT_DECIDABLE, ONE_READING)]
    rivals = {name for one in seen for name in one.imitated_by}
    return tuple(replace(one, verdict=NOT_DECIDABLE) if one.cause in rivals else one for one in (first, *others))


def diagnosis(answers):
    """What the causes say together: causes, "none found", or "not decidable" with those that it could be."""
    if any(np.isnan(one.p) for one in answers):
        return NOT_DECIDABLE
    bad = [one.cause for one in answers if one.cause == BAD_READING and one.verdict == FOUND]
    rest = [one for one in answers if one.verdict != NOT_FOUND and one.cause not in bad]
    names = ", ".join(
        one.cause + one.verdict.removeprefix(NOT_DECIDABLE) * (one.verdict == ONE_READING) for one in rest
    )
    certain = len(rest) == 1 and rest[0].verdict == FOUND
    return "; ".join([*bad, *([names if certain else f"{NOT_DECIDABLE}: {names}"] if rest else [])]) or "none found"


def _verdict(p, imitators, limit, p_without_any=lambda: 0.0):
    """Verdict on a cause from its p and the limit for it; p_without_any(): the largest with one reading left out."""
    if np.isnan(p) or (p < limit and imitators):
        return NOT_DECIDABLE
    if p >= limit:
        return NOT_FOUND
    return FOUND if p_without_any() < limit else ONE_READING


def _bad_reading(tests, left, level):
    """The cause that one reading is wrong: the most suspicious one."""
    suspect = left.suspect
    imitators = tests.imitators(BAD_READING, level.imitated_from, suspect or 0)
    share = p = estimate = error = np.nan
    if suspect is not None:
        share = tests.explained_share(BAD_READING, suspect)
        p, estimate = left.p[suspect], left.difference_mm[suspect]
        error = estimate / left.ratio[suspect]
    limit = level.limit(tests, BAD_READING)
    verdict = _verdict(p, imitators, limit)
    return Cause(BAD_READING, 1, share, p, estimate, error, "mm", imitators, verdict, limit)


def _acting_on_all(tests, level):
    """The causes that act on all readings, a list."""
    answers = []
    for name, (_, unit) in tests.columns.items():
        p, imitators = float(tests.p(name)), tests.imitators(name, level.imitated_from)
        limit = level.limit(tests, name)
        verdict = _verdict(p, imitators, limit, lambda name=name: tests.p_without_any(name))
        rank, share = tests.added[name].rank, tests.explained_share(name)
        answers.append(Cause(name, rank, share, p, *tests.estimate(name), unit, imitators, verdict, limit))
    return answers
