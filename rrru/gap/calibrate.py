"""The sim without effects: as its owner believes it to be, and calibrated."""

from rrru.campaign import measurements as rows
from rrru.fit.least_squares import least_squares
from rrru.fit.residuals import Residuals
from rrru.fit.start import start_of
from rrru.gap.state import State


def calibrate(case):
    """State of the plain calibration of the case's used points; raises FitError where there are too few of them."""
    return State(least_squares(residuals_of(case)).deviations, {})


def origin(case):
    """State that the calibration starts from, see `rrru.fit.start`."""
    return State(start_of(residuals_of(case))[0], {})


def residuals_of(case):
    """Residuals of the case's used points."""
    frame = case.measurements[case.used]
    driven = rows.actuators(frame, case.mechanism), rows.measured(frame), rows.command(frame)
    return Residuals(case.mechanism, *driven, rows.readings(frame, case.arm_mm))
