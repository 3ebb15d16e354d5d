"""Fits of the placements of robot, tool and targets with the other parameters fixed. Lengths in mm, angles in rad."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from rrru.arrays import FloatArray
from rrru.campaign import measurements as rows
from rrru.campaign.target_registration import PLACE_SD_MM
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import ModelState
from rrru.effects.protocol import Contribution, Effect, plain_coordinates
from rrru.errors import FitError
from rrru.estimation.explain import explain_end
from rrru.estimation.parameters import Block, Parameters
from rrru.estimation.problem import Problem
from rrru.estimation.solver import solve
from rrru.estimation.starts import frame_values
from rrru.kinematics.base_parameters import Candidate, direction, open_numbers
from rrru.kinematics.legs import WORLD
from rrru.kinematics.readings import Readings
from rrru.kinematics.robot import Robot
from rrru.parameters import Parameter, ParameterSet

FRAMES = "frames"
# prior s.d.: an instrument is within ten metres of the robot
_INSTRUMENT_SD_MM = 1e4


def frames(robot: Robot) -> Effect:
    """Placements of robot, tool and reflectors that a campaign does not fix, one coordinate per parameter."""
    numbers = open_numbers(robot.measurement_config)
    limits = {"mm": _INSTRUMENT_SD_MM, "rad": np.pi}
    bounds = ((number, limits[number.unit]) for number in numbers)
    parameters = ParameterSet(
        tuple(Parameter(number.name, number.unit, 0.0, -limit, limit, "free") for number, limit in bounds)
    )
    directions = frame_directions(robot)
    typical = [1.0 if number.unit == "mm" else 1e-3 for number in numbers]

    def place(_motion, values):
        """The constant twists of the parameters."""
        return Contribution((directions @ values)[None])

    return Effect(FRAMES, parameters, plain_coordinates(parameters, typical), place)


def frame_directions(robot: Robot) -> FloatArray:
    """Twists (sites, 6, c) per unit of each coordinate of `frames`."""
    return np.stack([direction(robot.legs, one) for one in open_numbers(robot.measurement_config)], axis=-1)


@dataclass(frozen=True, eq=False)
class FrameObservations:
    """Readings of a problem as `rrru.estimation.problem.Observations` of the coordinates (c,) of its frames alone."""

    problem: DiagnosisProblem
    state: ModelState
    directions: FloatArray

    def state_at(self, values: FloatArray) -> ModelState:
        """The ModelState with frames at values (c,)."""
        return replace(self.state, effects=dict(self.state.effects) | {(FRAMES, 0): values})

    def residual(self, values: FloatArray, /) -> FloatArray:
        """Readings minus prediction (m, 3) in mm."""
        return np.asarray(self.problem.residual(self.state_at(values)))

    def jacobian(self, values: FloatArray, /) -> FloatArray:
        """Its derivative (m, 3, c), exact for frames of any size."""
        return -self.problem.of_rows(self.problem.map_of(self.state_at(values)).columns(self.directions))

    def whiten(self, values: FloatArray) -> FloatArray:
        """Values (m, 3, ...) in standard deviations of the problem's noise."""
        return values / self.problem.noise_mm


def fit_frames(problem: DiagnosisProblem, state: ModelState) -> ModelState:
    """A state with frames fitted to the used points of a problem whose library has `frames`; all else stays fixed.

    The search starts at the closed-form registration, so that any rotation of the instrument is allowed. Raises
    FitError where it does not converge, naming the parameters that the readings do not determine.
    """
    numbers = open_numbers(problem.mechanism.measurement_config)
    observations = FrameObservations(problem, state, frame_directions(problem.mechanism))
    sd = [np.inf if one.unit == "rad" else _INSTRUMENT_SD_MM if WORLD in one.twists else PLACE_SD_MM for one in numbers]
    block = Block.of(FRAMES, [one.name for one in numbers], [one.unit for one in numbers], sd)
    estimation = Problem(observations, Parameters((block,)), observations.whiten)
    estimate = solve(estimation, [_start(observations, numbers)])
    if not estimate.end.converged:
        raise FitError(explain_end(estimate, "the fit of frame and targets"), estimate)
    return observations.state_at(estimate.values)


def _start(observations: FrameObservations, numbers: Sequence[Candidate]) -> FloatArray:
    """Coordinates (c,) of the frames by registration of the used points; zero where nothing determines them."""
    problem, nothing = observations.problem, np.zeros(len(numbers))
    if problem.mechanism.measurement_config.frame:
        poses, twists = problem.posed(observations.state_at(nothing))
        # twists of effects differ from row to row; their mean is good enough for a start
        twists = (twists[problem.used] if len(twists) > 1 else twists).mean(axis=0, keepdims=True)
        readings = problem.readings or Readings(rows.measured(problem.measurements))
        with suppress(FitError):
            found = frame_values(problem.mechanism, poses.of(problem.used), twists, readings.of(problem.used))
            return np.array([found[one.name] for one in numbers])
    return nothing
