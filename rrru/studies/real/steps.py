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
from rrru.diagnosis.problem import Case
from rrru.diagnosis.state import State
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
    """A fitted model: its letter, what it adds in words, its State, number of parameters and of identified ones.

    trained_mm, held_out_mm: residual distances (n,) on the rows that it was fitted on, and on held-out rows.
    """

    model: str
    adds: str
    state: State
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


def held_out(left_mm: np.ndarray) -> dict[str, float]:
    """Mean, rms and largest held-out residual by column of the tables, NaN where no row is held out."""
    mean, largest = (float(left_mm.mean()), float(left_mm.max())) if len(left_mm) else (np.nan, np.nan)
    return {"held_out_mean_mm": mean, "held_out_rms_mm": rms(left_mm), "held_out_max_mm": largest}


def rms(values: np.ndarray) -> float:
    """Root mean square, NaN of nothing."""
    return float(np.sqrt((values**2).mean())) if len(values) else np.nan


def held_out_mm(case: Case, state: State) -> np.ndarray:
    """Residual distances (n,) of a state on held-out rows of targets on the robot; NaN where it has no pose."""
    held = (case.measurements["status"] == rows.HELD_OUT).to_numpy() & held_by_robot(case)
    return np.linalg.norm(case.left(state)[: len(held)][held], axis=1)


def trained_mm(case: Case, state: State) -> np.ndarray:
    """Residual distances (n,) of a state on the rows of targets on the robot that it was fitted on."""
    return np.linalg.norm(case.residual(state)[counted(case)], axis=1)


def held_by_robot(case: Case) -> np.ndarray:
    """Flags (n,) of a case's measurements of targets on the robot, not fixed in the world."""
    fixed = rows.on_the_world(case.measurements)
    return np.ones(len(case.measurements), dtype=bool) if fixed is None else ~fixed


def counted(case: Case) -> np.ndarray:
    """Flags (m,) of a case's rows that are positions of targets on the robot."""
    return case.positions & held_by_robot(case)[case.at]


def steps(case: Case) -> tuple[Step, ...]:
    """The models in order, without those whose effects the robot does not have or whose fit does not converge.

    Raises FitError where the fit of the geometry does not converge.
    """
    library = dict(case.library) | _extra_effects(case)
    case, began = replace(case, library=library), time.perf_counter()
    none = State(np.zeros(len(case.mechanism.parameters)), {})
    state = fit_frames(case, none)
    numbers = len(library[FRAMES].coordinates), _identified(case, state, False), time.perf_counter() - began
    result = [Step("a", "frames", state, *numbers, *_left(case, state))]
    names: tuple[str, ...] = ()
    calibrated = calibrate(case)
    for model, adds, effect in _MODELS:
        if effect and effect not in library:
            continue
        began, names = time.perf_counter(), (*names, effect) if effect else names
        try:
            fit = fit_named_effects(case, names, calibrated)
        except FitError:
            if not effect:
                raise
            # the next models continue from the ones before
            names = names[:-1]
            continue
        numbers = len(fit.estimate.values), fit.estimate.rank, time.perf_counter() - began
        result.append(Step(model, adds, fit.state, *numbers, *_left(case, fit.state)))
    return tuple(result)


def verdict_step(case: Case, state: State, seconds: float) -> Step:
    """The step of a diagnosis' state: calibration and named effects."""
    count = len(state.deviations) + sum(len(values) for values in state.effects.values())
    adds = "+".join(name for name, _ in state.effects) or "nothing"
    return Step("verdict", adds, state, count, _identified(case, state), seconds, *_left(case, state))


def _identified(case: Case, state: State, calibrated: bool = True) -> int:
    """Number of identifiable parameters of a state's effects, and of the calibration where that is fitted."""
    linear = case.linearise(state, [])
    blocks = [linear.base] * calibrated + [linear.columns[key] for key in state.effects]
    return numerical_rank(np.concatenate(blocks, axis=-1).reshape(linear.data.size, -1))


def _left(case: Case, state: State) -> tuple[np.ndarray, np.ndarray]:
    """`trained_mm` and `held_out_mm` of a state."""
    return trained_mm(case, state), held_out_mm(case, state)


def _extra_effects(case: Case) -> dict[str, Effect]:
    """Effects that only these models have, where a robot has sites for them."""
    result, robot = {FRAMES: frames(case.mechanism)}, case.mechanism
    sharp = find("transmission_orders", robot)
    if sharp is not None:
        pairs = tuple((drive, float(order)) for drive in range(len(robot.parts.drives)) for order in (1, 2))
        result[_HARMONICS] = replace(sharp.with_waves(pairs), name=_HARMONICS)
    return result


def library_effects(robot: Robot) -> dict[str, Effect]:
    """Effects of the library in the models, by name, where a robot has sites for them."""
    found = {name: find(name, robot) for _, _, name in _MODELS if name and name != _HARMONICS}
    return {name: effect for name, effect in found.items() if effect is not None}
