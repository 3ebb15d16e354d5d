"""The model without effects: nominal and calibrated."""

from rrru.calibration.calibrate import estimate_deviations
from rrru.campaign import measurements as rows
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import ModelState
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.estimation.starts import starting_values


def calibrate(problem: DiagnosisProblem) -> ModelState:
    """ModelState of the plain calibration of the problem's used points; raises FitError where they are too few."""
    return ModelState(estimate_deviations(observations_of(problem), geometry=problem.geometry).values, {})


def origin(problem: DiagnosisProblem) -> ModelState:
    """ModelState that the calibration starts from, see `rrru.estimation.starts`."""
    return ModelState(starting_values(observations_of(problem))[0], {})


def observations_of(problem: DiagnosisProblem) -> TargetPositions:
    """TargetPositions of the problem's used points."""
    frame = problem.measurements[problem.used]
    driven = rows.actuators(frame, problem.mechanism), rows.measured(frame), rows.command(frame)
    return TargetPositions(problem.mechanism, *driven, rows.readings(frame, problem.characteristic_length_mm))
