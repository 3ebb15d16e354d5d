"""Residuals of the model of one series on another series of the same robot, with only the frames fitted again.

Series are studied separately: `saved_values` gives the numbers and texts that `model` needs of each.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from typing import Any

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.diagnosis.diagnose import with_wide_bounds
from rrru.diagnosis.discrepancy_basis import UNKNOWN
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.payload_nuisance import WEIGHT
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.settings import GapSettings
from rrru.diagnosis.state import ModelState
from rrru.effects.protocol import Effect, plain_coordinates
from rrru.errors import FitError
from rrru.kinematics.robot import Robot
from rrru.pipeline import setup
from rrru.studies.real.arms import NO_MASSES, Studied, nominal_robot
from rrru.studies.real.frame_fit import FRAMES, fit_frames, frames
from rrru.studies.real.series import Series
from rrru.studies.real.steps import held_out_mm, rms

_COLUMNS = ("campaign", "carried_from", "frames_rms_mm", "geometry_rms_mm", "causes_rms_mm")


@dataclass(frozen=True)
class Model:
    """The model of a studied series for transfer: its measurements, robot and estimates.

    characteristic_length_mm: of orientations, NaN where none were read; noise_mm: per axis; geometry (p,), deviations
    (p,): of the calibration alone and together with the causes; effects: these by name, with values by parameter;
    weight: estimated errors of payload and tilt.
    """

    series: Series
    measurements: pd.DataFrame
    robot: Robot
    characteristic_length_mm: float
    noise_mm: float
    geometry: np.ndarray
    deviations: np.ndarray
    effects: Mapping[str, tuple[Effect, np.ndarray]]
    weight: Mapping[str, float]


def saved_values(studied: Studied) -> dict[str, Any]:
    """The values of a studied series that `model` needs in addition to its measurements."""
    problem, state = studied.problem, studied.state
    effects = {}
    for key, coordinates in state.effects.items():
        effect = problem.library[key[0]]
        values = effect.coordinates.to_values(coordinates, state.shape(problem.library, key))
        if effect.name not in UNKNOWN:
            effects[effect.name] = {"values": np.asarray(values).tolist(), "waves": effect.waves}
    return {
        "arm_mm": float(problem.characteristic_length_mm),
        "noise_mm": float(problem.noise_mm),
        "geometry": studied.step("b").state.deviations.tolist(),
        "deviations": state.deviations.tolist(),
        "effects": effects,
        "weight": dict(state.weight),
    }


def model(
    series: Series,
    numbers: Mapping[str, Any],
    measurements: pd.DataFrame,
    robots: Mapping[str, Any],
    settings: GapSettings,
) -> Model:
    """The Model of a series from the numbers of `saved_values`."""
    robot = setup.measured_robot(nominal_robot(series, robots), measurements)
    library, effects = settings.library(robot), {}
    for name, saved in numbers["effects"].items():
        effect = library[name].with_waves(saved["waves"]) if saved["waves"] else library[name]
        effects[name] = effect, np.array(saved["values"])
    deviations = (np.array(numbers[key]) for key in ("geometry", "deviations"))
    return Model(
        series, measurements, robot, numbers["arm_mm"], numbers["noise_mm"], *deviations, effects, numbers["weight"]
    )


def carried(models: Sequence[Model]) -> pd.DataFrame:
    """Rows of `real_carried`: of all pairs of series of one robot, in both directions."""
    pairs = [pair for pair in permutations(models, 2) if pair[0].series.variant == pair[1].series.variant]
    return pd.DataFrame([_row(*pair) for pair in pairs], columns=_COLUMNS)


def _row(first: Model, second: Model) -> dict:
    """The row of the model of one series on another one."""
    robot = with_wide_bounds(first.robot)
    characteristic_length_mm = second.characteristic_length_mm if rows.has_turns(second.measurements) else np.nan
    problem = make_diagnosis_problem(
        second.measurements, robot, NO_MASSES, second.noise_mm, {}, True, characteristic_length_mm
    )
    effects = {
        name: replace(effect, coordinates=plain_coordinates(effect.parameters, 1.0))
        for name, (effect, _) in first.effects.items()
    }
    problem = replace(problem, library=effects | {FRAMES: frames(robot)})
    values = {(name, 0): values for name, (_, values) in first.effects.items()}
    models = {
        "frames_rms_mm": ModelState(0.0 * first.geometry, {}),
        "geometry_rms_mm": ModelState(first.geometry, {}),
        "causes_rms_mm": ModelState(first.deviations, values, {WEIGHT: first.weight}),
    }
    left = {name: _left_mm(problem, state) for name, state in models.items()}
    return {"campaign": second.series.name, "carried_from": first.series.name, **left}


def _left_mm(problem: DiagnosisProblem, state: ModelState) -> float:
    """Held-out rms of a state with its frames fitted again, NaN where that fit fails."""
    try:
        return rms(held_out_mm(problem, fit_frames(problem, state)))
    except FitError:
        return np.nan
