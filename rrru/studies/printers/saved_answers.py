"""Why a printer's saved answer is not that of its readings: what its owner changed after the calibration."""

from dataclasses import replace

import numpy as np
from scipy import optimize

from rrru.errors import FitError
from rrru.studies.printers.firmware import own_jacobian, residuals_of, stop

_ENDSTOPS = {"endstop_a", "endstop_b", "endstop_c"}
# changes of the microstep setting that are tried
_STEP_FACTORS = (0.0625, 0.125, 0.25, 0.5, 2.0, 4.0, 8.0, 16.0)
_UNKNOWN = "unknown: no number is that of the readings, nor with other steps, arms or one other reading"
_AFTER = "changed after the calibration"


def reason(result):
    """Why the saved answer of a PrinterFit is not that of the readings, as far as they tell; empty where it is."""
    differ = [name for name, same in zip(result.names, result.agrees, strict=True) if not same]
    if not differ:
        return ""
    shift = (result.saved - result.fitted)[3:6]
    if set(differ) == _ENDSTOPS and np.ptp(shift) <= 2.0 * result.tolerance[3:6].max():
        moved = "the zero of the heights was moved after the calibration"
        return f"all endstops are {shift.mean():+.3f} mm off alike: {moved}"
    if len(differ) < len(result.names):
        return f"overwritten after the calibration: {', '.join(differ)}; the other numbers are those of the readings"
    steps = changed_steps(result.printer, result.stopping_step)
    return steps or _changed_arms(result) or _changed_reading(result) or _UNKNOWN


def changed_steps(printer, stopping_step):
    """Says by how much the microsteps' length was changed, if the answer belongs to the readings with that."""
    for factor in _STEP_FACTORS:
        drops = {key: factor * getattr(printer, key) for key in ("height_drop_mm", "distance_drop_mm")}
        if _belongs(replace(printer, **drops), stopping_step):
            return f"the answer belongs to steps {factor:g} times as long: steps or microsteps were {_AFTER}"
    return ""


def _changed_arms(result):
    """Says by how much all arms were changed, if the answer of heights belongs to the readings with that."""
    printer = result.printer
    if printer.parameter_set != "heights":
        return ""

    def with_arms(change):
        return replace(printer, arm_mm=printer.arm_mm + change)

    try:
        change = optimize.least_squares(lambda change: _off(with_arms(change), result.stopping_step), [0.0]).x[0]
    except FitError:
        return ""
    if not _belongs(with_arms(change), result.stopping_step):
        return ""
    return f"the answer belongs to arms of {np.mean(printer.arm_mm + change):.3f} mm: the arms were {_AFTER}"


def _changed_reading(result):
    """Says which reading was changed, and from what, if the answer belongs to the readings with that."""
    residuals = result.residuals
    moves, off = _moves(residuals, result.stopping_step)
    changes = -(off @ moves) / (moves**2).sum(axis=0)
    for reading in np.flatnonzero((np.abs(off[:, None] + moves * changes) <= 1.0).all(axis=0)):
        before = residuals.measured_mm[reading] + changes[reading] / residuals.root_weight[reading]
        name = result.reading_name(reading)
        return f"the answer belongs to {name} being {before:.3f} mm: this reading was {_AFTER}"
    return ""


def _moves(residuals, stopping_step):
    """How far the best numbers move (p, n) per reading, and are off now (p,), in shares of the other program's stop."""
    start = residuals.mechanism.parameters.nominal
    jacobian = own_jacobian(residuals, start)
    moves = np.linalg.pinv(jacobian) / stop(jacobian, stopping_step)[:, None]
    return moves, moves @ residuals.residual(start)[:, 0]


def _off(printer, stopping_step):
    """How far (p,) the saved numbers are from those of the readings, one Gauss-Newton step; see `_moves`."""
    return _moves(residuals_of(printer), stopping_step)[1]


def _belongs(printer, stopping_step):
    """Whether a printer's saved numbers are those of its readings."""
    try:
        return bool((np.abs(_off(printer, stopping_step)) <= 1.0).all())
    except FitError:
        return False
