"""Model after model on one real series: what each adds, and what it leaves on rows that no fit has seen.

(a) frames, (b) + geometry, (c) + drive compliance, (c2) + flexible links, (d) + the first two harmonics of every drive,
(e) + a drift of the base, linear in the order of the rows: plain least squares, nothing chosen. They are the reference
for what the diagnosis names. Lengths in mm, angles in rad.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from rrru.campaign import measurements as rows
from rrru.effects.library import find
from rrru.effects.protocol import Contribution, Effect, plain_coordinates
from rrru.errors import FitError
from rrru.gap.case import Case, State
from rrru.parameters import Parameter, ParameterSet
from rrru.robots.geometric_numbers import direction, open_numbers
from rrru.robots.legs import WORLD
from rrru.robots.robot import Robot

_ROUNDS, _HALVINGS, _ENOUGH = 12, 6, 1e-6
# a combination of numbers that moves the readings by less than this share of the best seen one is not identified
_SEEN = 1e-6
FRAMES, _HARMONICS, _DRIFT = "frames", "harmonics", "drift"


@dataclass(frozen=True)
class Step:
    """A fitted model: its letter, what it adds in words, its State, number of parameters and of identified ones.

    trained_mm, held_out_mm: distances (n,) that it leaves on the rows that it was fitted on, and on those held out.
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
        held, told = self.held_out_mm, {}
        if len(held):
            told = {"mean": held.mean(), "rms": np.sqrt((held**2).mean()), "max": held.max()}
        return {
            "model": self.model,
            "adds": self.adds,
            "parameters": self.parameters,
            "identifiable": self.identifiable,
            "train_rms_mm": float(np.sqrt((self.trained_mm**2).mean())),
            **{f"held_out_{name}_mm": float(told.get(name, np.nan)) for name in ("mean", "rms", "max")},
        }


def held_out_mm(case: Case, state: State) -> np.ndarray:
    """Distances (n,) by which a state misses the held-out rows; NaN where it has no pose."""
    held = (case.measurements["status"] == rows.HELD_OUT).to_numpy()
    return np.linalg.norm(case.left(state)[: len(held)][held], axis=1)


def trained_mm(case: Case, state: State) -> np.ndarray:
    """Distances (n,) by which a state misses the rows that it was fitted on."""
    return np.linalg.norm(case.residual(state)[case.positions], axis=1)


def steps(case: Case, start: State) -> tuple[Step, ...]:
    """The models one after another; start: a calibration of all numbers.

    A model whose effects the robot does not have is left out.
    """
    library = dict(case.library) | _own(case)
    case, every = replace(case, library=library), np.ones(len(start.deviations), dtype=bool)
    kinds = [("a", "frames", ~every, ((FRAMES, 0),)), ("b", "geometry", every, ())]
    for model, adds, effect in (
        ("c", "drive compliance", "drive_compliance"),
        ("c2", "compliance across the joints", "link_flexure"),
        ("d", "first and second harmonic of the drives", _HARMONICS),
        ("e", "drift of the base with the rows", _DRIFT),
    ):
        if effect in library:
            kinds.append((model, adds, every, (*kinds[-1][3], (effect, 0))))
    result, state = [], start
    for model, adds, free, keys in kinds:
        began = time.perf_counter()
        first = State(0.0 * start.deviations, {}) if model == "a" else state
        fit, rank = fitted(case, first, free, keys)
        state = start if model == "a" else fit
        count = int(free.sum()) + sum(len(library[name].coordinates) for name, _ in keys)
        left = trained_mm(case, fit), held_out_mm(case, fit)
        result.append(Step(model, adds, fit, count, rank, time.perf_counter() - began, *left))
    return tuple(result)


def fitted(case: Case, start: State, free: np.ndarray, keys: tuple) -> tuple[State, int]:
    """State of least squares over some deviations (p,) and all coordinates of effects, and how many are identified.

    Gauss-Newton from a start, steps halved where they make it worse. Raises FitError where it has no pose.
    """
    effects = {key: start.effects.get(key, np.zeros(len(case.library[key[0]].coordinates))) for key in keys}
    state, cost = State(start.deviations, effects), np.inf
    rank = 0
    for _ in range(_ROUNDS):
        linear, last = case.linearise(state, list(keys)), cost
        cost = _cost(case, state) if not np.isfinite(cost) else cost
        columns = np.concatenate([linear.base[..., free], *(linear.columns[key] for key in keys)], axis=-1)
        flat = columns.reshape(-1, columns.shape[-1])
        size = np.linalg.norm(flat, axis=0)
        size[size == 0.0] = np.inf
        # the data hold the effects' own part, not that of the deviations
        answer, _, rank, _ = np.linalg.lstsq(flat / size, linear.data.ravel(), rcond=_SEEN)
        answer = answer / size
        target = _target(state, answer, free, keys)
        last = cost
        for halving in range(_HALVINGS):
            trial = _between(state, target, 0.5**halving)
            trial_cost = _cost(case, trial)
            if trial_cost < cost:
                state, cost = trial, trial_cost
                break
        if not cost < last * (1.0 - _ENOUGH):
            break
    if not np.isfinite(cost):
        raise FitError("the model has no pose at a point of the series")
    return state, int(rank)


def _target(state: State, answer: np.ndarray, free: np.ndarray, keys: tuple) -> State:
    """The state that a linearisation's answer asks for."""
    deviations, first = state.deviations.copy(), int(free.sum())
    deviations[free] += answer[:first]
    effects = {}
    for key in keys:
        count = len(state.effects[key])
        effects[key] = answer[first : first + count]
        first += count
    return State(deviations, effects)


def _between(first: State, second: State, share: float) -> State:
    """The state at a share of the way from one to another with the same effects."""
    effects = {key: own + share * (second.effects[key] - own) for key, own in first.effects.items()}
    return State(first.deviations + share * (second.deviations - first.deviations), effects)


def _cost(case: Case, state: State) -> float:
    """Sum of squares that a state leaves; inf where it has no pose."""
    cost = float((case.residual(state) ** 2).sum())
    return cost if np.isfinite(cost) else np.inf


def _own(case: Case) -> dict[str, Effect]:
    """The laws that only these models have, as far as a robot has sites and its campaign an order."""
    result, robot = {FRAMES: frames(case.mechanism)}, case.mechanism
    sharp = find("transmission_orders", robot)
    if sharp is not None:
        pairs = tuple((drive, float(order)) for drive in range(len(robot.parts.drives)) for order in (1, 2))
        result[_HARMONICS] = replace(sharp.with_waves(pairs), name=_HARMONICS)
    if np.ptp(case.motion.time_s) > 0.0:
        result[_DRIFT] = _drift(case)
    return result


def frames(robot: Robot) -> Effect:
    """Where robot, tool and reflectors lie, as far as a campaign leaves it open: one coordinate a number."""
    numbers = open_numbers(robot.reads)
    limits = {"mm": 1000.0, "rad": np.pi}
    bounds = ((one, limits[one.unit]) for one in numbers)
    parameters = ParameterSet(tuple(Parameter(one.name, one.unit, 0.0, -most, most, "free") for one, most in bounds))
    directions = np.stack([direction(robot.legs, one) for one in numbers], axis=-1)
    typical = [1.0 if one.unit == "mm" else 1e-3 for one in numbers]

    def place(_motion, values):
        """The constant twists that the numbers make."""
        return Contribution((directions @ values)[None])

    return Effect(FRAMES, parameters, plain_coordinates(parameters, typical), place)


def _drift(case: Case) -> Effect:
    """A shift of the world in proportion to the time, in mm from the first row to the last."""
    parameters = ParameterSet(tuple(Parameter(f"drift_{axis}", "mm", 0.0, -10.0, 10.0, "assumed") for axis in "xyz"))

    def shift(motion, values):
        """The world's twist under shifts (3,)."""
        share = (motion.time_s - motion.time_s[0]) / max(np.ptp(motion.time_s), 1e-9)
        return motion.at({WORLD: np.concatenate([share[:, None] * values, np.zeros((len(share), 3))], axis=1)})

    return Effect(_DRIFT, parameters, plain_coordinates(parameters, 0.05), shift)

