"""Residuals of the calibration of a printer: suspicious reading and possible causes.

Leave-one-out: the printer is fitted without one reading. The difference of this reading from the prediction, over its
standard error, follows Student's t with the degrees of freedom of the others if all readings are sound (Cook and
Weisberg, Residuals and Influence in Regression, 1982, 2.2). Causes: `cause_tests` gives p. A cause that passes is found
only if it is not confounded with another one and if it also passes without any single reading. Otherwise it is not
decidable.
"""

from dataclasses import dataclass, replace

import numpy as np

from rrru.calibration.calibrate import calibrate
from rrru.studies.printers.cause_tests import BAD_READING, CauseTests

FOUND, NOT_FOUND, NOT_DECIDABLE = "found", "not found", "not decidable"
ONE_READING = "not decidable (rests on one reading)"


@dataclass(frozen=True)
class LeftOut:
    """Leave-one-out residual of every reading.

    difference_mm (n,): reading minus prediction from the others. ratio (n,): that over its standard error, for the
    firmware's ratio of noises. p (n,): of so large a ratio anywhere among the readings; see `cause_tests`. The last two
    are NaN without degrees of freedom.
    """

    difference_mm: np.ndarray
    ratio: np.ndarray
    p: np.ndarray

    @property
    def suspect(self):
        """Number of the most suspicious reading, from 0; None without degrees of freedom."""
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
    """One possible cause of the residuals of a calibration.

    freedom_used: number of its parameters. explained_share: explained fraction of the residual sum of squares, for the
    firmware's ratio of noises. p: that noise explains as much; NaN without degrees of freedom. estimate,
    standard_error: in `unit`, NaN except for causes with one parameter. confounded_with: other causes. limit: upper
    limit of p.
    """

    cause: str
    freedom_used: int
    explained_share: float
    p: float
    estimate: float
    standard_error: float
    unit: str
    confounded_with: tuple
    verdict: str
    limit: float


@dataclass(frozen=True)
class Level:
    """Significance level of the causes.

    level: probability of a false alarm over the causes of all `pieces` of evidence; confounded_from: least fraction of
    a cause's explained part that a confounded cause explains too.
    """

    level: float
    confounded_from: float
    pieces: int = 1

    def limit(self, tests, name, more=0):
        """Upper limit of p: the level over the number of causes (Bonferroni), plus `more` further tests.

        Causes of the machine are tested over all pieces of evidence together, so that the level is also divided by
        their number. A bad reading concerns its own file only.
        """
        return self.level / (1 + more + len(tests.columns)) / (1 if name == BAD_READING else self.pieces)


def causes(result, left, level):
    """Possible causes of the residuals of a PrinterFit, a tuple: a bad reading, and those that act on all readings.

    left: its LeftOut; level: `Level`. A bad reading with a smaller p than every other cause is removed before these are
    tested. Otherwise it is tested together with the cause of the smallest p.
    """
    tests = CauseTests(result)
    first, others = _bad_reading(tests, left, level), _acting_on_all(tests, level)
    leader = min(others, key=lambda one: np.nan_to_num(one.p, nan=1.0))
    if first.p < first.limit and leader.p < first.p:
        p = float(np.min(tests.p(BAD_READING, with_columns=tests.columns[leader.cause][0])))
        first = replace(first, p=p, verdict=_verdict(p, first.confounded_with, first.limit))
    elif first.p < first.limit:
        others = _acting_on_all(CauseTests(without(result, left.suspect)), level)
    # a cause confounded with a visible one cannot be ruled out either
    undecided = [cause for cause in (first, *others) if cause.verdict in (NOT_DECIDABLE, ONE_READING)]
    rivals = {name for cause in undecided for name in cause.confounded_with}
    return tuple(
        replace(cause, verdict=NOT_DECIDABLE) if cause.cause in rivals else cause for cause in (first, *others)
    )


def diagnosis(answers):
    """The overall answer: causes, "none found", or "not decidable" with the possible causes."""
    if any(np.isnan(one.p) for one in answers):
        return NOT_DECIDABLE
    bad = [one.cause for one in answers if one.cause == BAD_READING and one.verdict == FOUND]
    others = [one for one in answers if one.verdict != NOT_FOUND and one.cause not in bad]
    names = ", ".join(
        one.cause + one.verdict.removeprefix(NOT_DECIDABLE) * (one.verdict == ONE_READING) for one in others
    )
    certain = len(others) == 1 and others[0].verdict == FOUND
    return "; ".join([*bad, *([names if certain else f"{NOT_DECIDABLE}: {names}"] if others else [])]) or "none found"


def _verdict(p, confounded, limit, p_without_any=lambda: 0.0):
    """Verdict on a cause from its p and its limit; p_without_any(): the largest p with one reading left out."""
    if np.isnan(p) or (p < limit and confounded):
        return NOT_DECIDABLE
    if p >= limit:
        return NOT_FOUND
    return FOUND if p_without_any() < limit else ONE_READING


def _bad_reading(tests, left, level):
    """The cause that one reading is wrong: the most suspicious one."""
    suspect = left.suspect
    confounded = tests.confounded_causes(BAD_READING, level.confounded_from, suspect or 0)
    share = p = estimate = error = np.nan
    if suspect is not None:
        share = tests.explained_share(BAD_READING, suspect)
        p, estimate = left.p[suspect], left.difference_mm[suspect]
        error = estimate / left.ratio[suspect]
    limit = level.limit(tests, BAD_READING)
    verdict = _verdict(p, confounded, limit)
    return Cause(BAD_READING, 1, share, p, estimate, error, "mm", confounded, verdict, limit)


def _acting_on_all(tests, level):
    """The causes that act on all readings, a list."""
    answers = []
    for name, (_, unit) in tests.columns.items():
        p, confounded = float(tests.p(name)), tests.confounded_causes(name, level.confounded_from)
        limit = level.limit(tests, name)
        verdict = _verdict(p, confounded, limit, lambda name=name: tests.p_without_any(name))
        rank, share = tests.added[name].rank, tests.explained_share(name)
        answers.append(Cause(name, rank, share, p, *tests.estimate(name), unit, confounded, verdict, limit))
    return answers
