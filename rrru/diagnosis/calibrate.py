"""The model without effects: nominal and calibrated."""

from rrru.calibration.calibrate import estimate_deviations
from rrru.campaign import measurements as rows
from rrru.diagnosis.state import State
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.estimation.starts import starting_values


def calibrate(case):
    """State of the plain calibration of the case's used points; raises FitError where there are too few of them."""
    return State(estimate_deviations(observations_of(case), geometry=case.geometry).values, {})


def origin(case):
    """State that the calibration starts from, see `rrru.estimation.starts`."""
    return State(starting_values(observations_of(case))[0], {})


def observations_of(case):
    """TargetPositions of the case's used points."""
    frame = case.measurements[case.used]
    driven = rows.actuators(frame, case.mechanism), rows.measured(frame), rows.command(frame)
    return TargetPositions(case.mechanism, *driven, rows.readings(frame, case.arm_mm))
