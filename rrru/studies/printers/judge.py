"""Results of one printer's readings: calibration, suspicious reading, causes, tilted effector.

And why its saved answer is not that of its readings: changes after the calibration.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import optimize

from rrru.errors import FitError
from rrru.studies.printers import steps
from rrru.studies.printers.cause_tests import CauseTests
from rrru.studies.printers.effector_tilt import TiltAnswer, tilt_answer
from rrru.studies.printers.firmware import own_jacobian, residuals_of, rounding, stop
from rrru.studies.printers.printer_causes import FOUND, LeftOut, Level, causes, diagnosis, left_out, without
from rrru.studies.printers.printer_fit import PrinterFit, fit_printer

_ENDSTOPS = ("endstop_a", "endstop_b", "endstop_c")
_UNKNOWN = "unknown: no number is that of the readings, even with other steps, other arms or one other reading"
_AFTER = "changed after the calibration"
REPRODUCED, FOREIGN, UNTRIED, FAILED = "reproduced", "does not belong", "not calibrated", "not fitted"


def reason(result):
    """Why the saved answer of a PrinterFit is not that of the readings, as far as they show; empty where it is."""
    return _joined(steps.describe(result.step_factors), _changed_numbers(result))


def _joined(*parts):
    """The non-empty sentences."""
    return "; ".join(filter(None, parts))


def _changed_numbers(result):
    """The changed numbers, arms or readings of the answer, in words."""
    differ = [name for name, same in zip(result.names, result.agrees, strict=True) if not same]
    if not differ:
        return ""
    offset, shift = "", (result.saved - result.fitted)[3:6]
    moved = 0.5 * (shift.min() + shift.max())
    if set(_ENDSTOPS) <= set(differ) and (np.abs(shift - moved) <= result.slack[3:6]).all():
        differ = [name for name in differ if name not in _ENDSTOPS]
        offset = _z_offset(moved)
    if not differ:
        return offset
    # an arm and a Z offset are two changes
    if len(differ) > 2 and (arms := _changed_arms(result)):
        return arms
    if len(differ) < len(result.names) - len(_ENDSTOPS) * bool(offset):
        others = "the other numbers are those of the readings"
        return _joined(f"overwritten after the calibration: {', '.join(differ)}; {others}", offset)
    return _changed_reading(result) or _UNKNOWN


def _z_offset(moved_mm):
    """The sentence on endstops with the same shift."""
    return f"a Z offset was applied after the calibration: all endstops differ by {moved_mm:+.3f} mm"


def _changed_arms(result):
    """By how much one arm, or all, were changed, if this explains the answer of heights, in words.

    A Z offset may have been applied in addition.
    """
    printer = result.printer
    for arms in (*np.eye(3), np.ones(3)) if printer.parameter_set == "heights" else ():

        def before(change, arms=arms):
            return replace(printer, arm_mm=printer.arm_mm + change[0] * arms, endstop_mm=printer.endstop_mm - change[1])

        change = _change_that_belongs(before, rounding(printer), result.stopping_step)
        if change is not None:
            now, then = (state.arm_mm[arms > 0.0] for state in (printer, before(change)))
            which = "all arms were" if len(now) == 3 else f"arm_{'abc'[int(arms.argmax())]} was"
            changed = f"the answer belongs to {then.mean():.3f} mm instead of {now[0]:.3f} mm: {which} {_AFTER}"
            return _joined(changed, _z_offset(change[1]) if abs(change[1]) > result.slack[3:6].max() else "")
    return ""


def _change_that_belongs(before, rounded, stopping_step):
    """The change (2,) with which a printer's saved numbers are those of its readings, None if there is none."""
    try:
        found = optimize.least_squares(lambda change: _off(before(change), rounded, stopping_step), np.zeros(2))
    except (FitError, ValueError):
        return None
    # if some change brings all p errors to at most 1, the least-squares change has a sum of squares of at most p
    return found.x if (found.fun**2).sum() <= len(found.fun) else None


def _changed_reading(result):
    """Which reading was changed, and from which value, if this explains the answer, in words."""
    residuals = result.residuals
    moves, off = _moves(residuals, rounding(result.printer), result.stopping_step)
    changes = -(off @ moves) / (moves**2).sum(axis=0)
    for reading in np.flatnonzero((np.abs(off[:, None] + moves * changes) <= 1.0).all(axis=0)):
        before = residuals.measured_mm[reading] + changes[reading] / residuals.root_weight[reading]
        name = result.reading_name(reading)
        return f"the answer belongs to {name} with {before:.3f} mm: this reading was {_AFTER}"
    return ""


def _moves(residuals, rounded, stopping_step):
    """Derivatives (p, n) of the best numbers by the readings, and errors (p,) of the saved ones, over tolerances."""
    start = residuals.mechanism.parameters.nominal
    jacobian = own_jacobian(residuals, start)
    slack = stop(jacobian, stopping_step) + rounded[: len(start)]
    moves = np.linalg.pinv(jacobian) / slack[:, None]
    return moves, moves @ residuals.residual(start)[:, 0]


def _off(printer, rounded, stopping_step):
    """Errors (p,) of the saved numbers over their tolerance, by one Gauss-Newton step; see `_moves`."""
    return _moves(residuals_of(printer), rounded, stopping_step)[1]


@dataclass(frozen=True)
class Judged:
    """A printer's fit, its leave-one-out residuals, its causes, and the tilt where the probe has an offset.

    reason: why its saved answer does not belong; empty where it does.
    """

    result: PrinterFit
    left: LeftOut
    causes: tuple
    tilt: TiltAnswer | None
    level: Level
    reason: str

    @property
    def verdict(self):
        """Whether the saved answer is that of the readings."""
        if not self.result.printer.calibrated:
            return UNTRIED
        return FOREIGN if self.reason else REPRODUCED

    @cached_property
    def suspect(self):
        """Number from 0 of the reading with p below the limit, None where there is none."""
        return self.left.suspect if self.causes[0].p < self.causes[0].limit else None

    @property
    def flagged(self):
        """Whether the verdict on the suspicious reading is a bad reading."""
        return self.suspect is not None and self.causes[0].verdict == FOUND

    @cached_property
    def without_suspect(self):
        """The PrinterFit of the other readings, None where none is suspicious."""
        return None if self.suspect is None else without(self.result, self.suspect)

    @property
    def cause(self):
        """The overall answer on the causes."""
        return diagnosis(self.causes)


def judge(printer, stopping_step, level):
    """The Judged printer; raises FitError naming it where it cannot be fitted."""
    result = fit_printer(printer, stopping_step, level.level)
    try:
        left = left_out(result)
        answers = causes(result, left, level)
        tilt = tilt_answer(result, level.limit(CauseTests(result), "effector_tilt", more=1))
    except (FitError, ValueError, np.linalg.LinAlgError) as error:
        raise FitError(f"{printer.name}: {error}", getattr(error, "result", None)) from None
    return Judged(result, left, answers, tilt, level, reason(result) if printer.calibrated else "")
