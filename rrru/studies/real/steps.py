"""Models of one real series step by step: what each adds, and its residuals on held-out rows.

(a) frames, (b) + geometry, (c) + drive compliance, (c2) + flexible links, (c3) + cross compliance, (d) + the first two
harmonics of every drive, (e) + a drift of the base, linear in the order of the rows. All are plain least squares
without model selection. They are the reference for the causes that the diagnosis names. Lengths in mm, angles in rad.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from rrru.campaign import measurements as rows
from rrru.diagnosis.calibrate import calibrate
from rrru.diagnosis.model_fit import fit_named_effects
from rrru.diagnosis.problem import DiagnosisProblem
from rrru.diagnosis.state import ModelState
from rrru.effects.library import find
from rrru.effects.protocol import Effect
from rrru.errors import FitError
from rrru.estimation.estimate import numerical_rank
from rrru.kinematics.robot import Robot
from rrru.studies.real.frame_fit import FRAMES, fit_frames, frames

_HARMONICS = "harmonics"
# letter, what it adds in words, name of the added effect
_MODELS = (
    ("b", "geometry", ""),
    ("c", "drive compliance", "drive_compliance"),
    ("c2", "compliance across the joints", "link_flexure"),
    ("c3", "cross compliance of a trunk", "cross_compliance"),
    ("d", "first and second harmonic of the drives", _HARMONICS),
    ("e", "drift of the base with the rows", "base_drift"),
)


@dataclass(frozen=True)
class Step:
    """A fitted model: its letter, what it adds in words, its ModelState, number of parameters and of identified ones.

    trained_mm, held_out_mm: residual distances (n,) on the rows that it was fitted on, and on held-out rows.
    """

    model: str
    adds: str
    state: ModelState
    parameters: int
    identifiable: int
    seconds: float
    trained_mm: np.ndarray
    held_out_mm: np.ndarray

    @property
    def row(self) -> dict:
        """The row of `real_steps` without the campaign."""
        return {
            "model": self.model,
            "adds": self.adds,
            "parameters": self.parameters,
            "identifiable": self.identifiable,
            "train_rms_mm": rms(self.trained_mm),
            **held_out(self.held_out_mm),
        }


def held_out(residual_mm: np.ndarray) -> dict[str, float]:
    """Mean, rms and largest held-out residual by column of the tables, NaN where no row is held out."""
    mean, largest = (float(residual_mm.mean()), float(residual_mm.max())) if len(residual_mm) else (np.nan, np.nan)
    return {"held_out_mean_mm": mean, "held_out_rms_mm": rms(residual_mm), "held_out_max_mm": largest}


def rms(values: np.ndarray) -> float:
    """Root mean square, NaN where there are no values."""
    return float(np.sqrt((values**2).mean())) if len(values) else np.nan


def held_out_mm(problem: DiagnosisProblem, state: ModelState) -> np.ndarray:
    """Residual distances (n,) of a state on held-out rows of targets on the robot; NaN where it has no pose."""
    held = (problem.measurements["status"] == rows.HELD_OUT).to_numpy() & held_by_robot(problem)
    return np.linalg.norm(problem.left(state)[: len(held)][held], axis=1)


def trained_mm(problem: DiagnosisProblem, state: ModelState) -> np.ndarray:
    """Residual distances (n,) of a state on the rows of targets on the robot that it was fitted on."""
    return np.linalg.norm(problem.residual(state)[counted(problem)], axis=1)


def held_by_robot(problem: DiagnosisProblem) -> np.ndarray:
    """Flags (n,) of a problem's measurements of targets on the robot, not fixed in the world."""
    fixed = rows.on_the_world(problem.measurements)
    return np.ones(len(problem.measurements), dtype=bool) if fixed is None else ~fixed


def counted(problem: DiagnosisProblem) -> np.ndarray:
    """Flags (m,) of a problem's rows that are positions of targets on the robot."""
    return problem.positions & held_by_robot(problem)[problem.at]


def steps(problem: DiagnosisProblem) -> tuple[Step, ...]:
    """The models in order, without those whose effects the robot does not have or whose fit does not converge.

    Raises FitError where the fit of the geometry does not converge.
    """
    library = dict(problem.library) | _extra_effects(problem)
    problem, began = replace(problem, library=library), time.perf_counter()
    none = ModelState(np.zeros(len(problem.mechanism.parameters)), {})
    state = fit_frames(problem, none)
    numbers = len(library[FRAMES].coordinates), _identified(problem, state, False), time.perf_counter() - began
    result = [Step("a", "frames", state, *numbers, *_residuals(problem, state))]
    names: tuple[str, ...] = ()
    calibrated = calibrate(problem)
    for model, adds, effect in _MODELS:
        if effect and effect not in library:
            continue
        began, names = time.perf_counter(), (*names, effect) if effect else names
        try:
            fit = fit_named_effects(problem, names, calibrated)
        except FitError:
            if not effect:
                raise
            # the next models continue from the ones before
            names = names[:-1]
            continue
        numbers = len(fit.estimate.values), fit.estimate.rank, time.perf_counter() - began
        result.append(Step(model, adds, fit.state, *numbers, *_residuals(problem, fit.state)))
    return tuple(result)


def verdict_step(problem: DiagnosisProblem, state: ModelState, seconds: float) -> Step:
    """The step of a diagnosis' state: calibration and named effects."""
    count = len(state.deviations) + sum(len(values) for values in state.effects.values())
    adds = "+".join(name for name, _ in state.effects) or "nothing"
    return Step("verdict", adds, state, count, _identified(problem, state), seconds, *_residuals(problem, state))


def _identified(problem: DiagnosisProblem, state: ModelState, calibrated: bool = True) -> int:
    """Number of identifiable parameters of a state's effects, and of the calibration where that is fitted."""
    linear = problem.linearise(state, [])
    blocks = [linear.base] * calibrated + [linear.columns[key] for key in state.effects]
    return numerical_rank(np.concatenate(blocks, axis=-1).reshape(linear.data.size, -1))


def _residuals(problem: DiagnosisProblem, state: ModelState) -> tuple[np.ndarray, np.ndarray]:
    """`trained_mm` and `held_out_mm` of a state."""
    return trained_mm(problem, state), held_out_mm(problem, state)


def _extra_effects(problem: DiagnosisProblem) -> dict[str, Effect]:
    """Effects that only these models have, where a robot has sites for them."""
    result, robot = {FRAMES: frames(problem.mechanism)}, problem.mechanism
    waves = find("transmission_orders", robot)
    if waves is not None:
        pairs = tuple((drive, float(order)) for drive in range(len(robot.parts.drives)) for order in (1, 2))
        result[_HARMONICS] = replace(waves.with_waves(pairs), name=_HARMONICS)
    return result


def library_effects(robot: Robot) -> dict[str, Effect]:
    """Effects of the library in the models, by name, where a robot has sites for them."""
    found = {name: find(name, robot) for _, _, name in _MODELS if name and name != _HARMONICS}
    return {name: effect for name, effect in found.items() if effect is not None}
