"""Why a printer's saved answer is not that of its readings: what its owner changed after the calibration."""

from dataclasses import replace

import numpy as np
from scipy import optimize

from rrru.errors import FitError
from rrru.studies.printers import steps
from rrru.studies.printers.firmware import own_jacobian, residuals_of, rounding, stop

_ENDSTOPS = ("endstop_a", "endstop_b", "endstop_c")
_UNKNOWN = "unknown: no number is that of the readings, nor with other steps, arms or one other reading"
_AFTER = "changed after the calibration"


def reason(result):
    """Why the saved answer of a PrinterFit is not that of the readings, as far as they tell; empty where it is."""
    return _joined(steps.told(result.step_factors), _changed_numbers(result))


def _joined(*parts):
    """Sentences that say something."""
    return "; ".join(filter(None, parts))


def _changed_numbers(result):
    """Which of the answer's numbers, arms or readings were changed."""
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
        rest = "the other numbers are those of the readings"
        return _joined(f"overwritten after the calibration: {', '.join(differ)}; {rest}", offset)
    return _changed_reading(result) or _UNKNOWN


def _z_offset(moved_mm):
    """What to say of endstops that were moved alike."""
    return f"a Z offset was applied after the calibration: all endstops are {moved_mm:+.3f} mm off alike"


def _changed_arms(result):
    """Says by how much one arm, or all, were changed, if the answer of heights belongs to the readings with that.

    A Z offset may have been applied beside.
    """
    printer = result.printer
    for arms in (*np.eye(3), np.ones(3)) if printer.parameter_set == "heights" else ():

        def before(change, arms=arms):
            return replace(printer, arm_mm=printer.arm_mm + change[0] * arms, endstop_mm=printer.endstop_mm - change[1])

        change = _change_that_belongs(before, rounding(printer), result.stopping_step)
        if change is not None:
            now, then = (one.arm_mm[arms > 0.0] for one in (printer, before(change)))
            which = "all arms were" if len(now) == 3 else f"arm_{'abc'[int(arms.argmax())]} was"
            told = f"the answer belongs to {now[0]:.3f} mm being {then.mean():.3f} mm: {which} {_AFTER}"
            return _joined(told, _z_offset(change[1]) if abs(change[1]) > result.slack[3:6].max() else "")
    return ""


def _change_that_belongs(before, rounded, stopping_step):
    """The change (2,) under which a printer's saved numbers are those of its readings, None if there is none."""
    try:
        found = optimize.least_squares(lambda change: _off(before(change), rounded, stopping_step), np.zeros(2))
    except (FitError, ValueError):
        return None
    # where one change leaves no number off by more than 1, the change of least squares leaves no more than p in sum
    return found.x if (found.fun**2).sum() <= len(found.fun) else None


def _changed_reading(result):
    """Says which reading was changed, and from what, if the answer belongs to the readings with that."""
    residuals = result.residuals
    moves, off = _moves(residuals, rounding(result.printer), result.stopping_step)
    changes = -(off @ moves) / (moves**2).sum(axis=0)
    for reading in np.flatnonzero((np.abs(off[:, None] + moves * changes) <= 1.0).all(axis=0)):
        before = residuals.measured_mm[reading] + changes[reading] / residuals.root_weight[reading]
        name = result.reading_name(reading)
        return f"the answer belongs to {name} being {before:.3f} mm: this reading was {_AFTER}"
    return ""


def _moves(residuals, rounded, stopping_step):
    """How far the best numbers move (p, n) per reading, and are off now (p,), in shares of what they may be off by."""
    start = residuals.mechanism.parameters.nominal
    jacobian = own_jacobian(residuals, start)
    slack = stop(jacobian, stopping_step) + rounded[: len(start)]
    moves = np.linalg.pinv(jacobian) / slack[:, None]
    return moves, moves @ residuals.residual(start)[:, 0]


def _off(printer, rounded, stopping_step):
    """How far (p,) the saved numbers are from those of the readings, one Gauss-Newton step; see `_moves`."""
    return _moves(residuals_of(printer), rounded, stopping_step)[1]
