"""One campaign as the diagnosis sees it: usable points, the calibrated sim, every effect's signature, the exact sim.

The sim with effects is the exact closure of the plant; a hypothesis is fitted on its linearisation, renewed about the
best one found. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.campaign.driven_path import STEPS, driven_path, starts_of_runs
from rrru.effects.motion import Course, make_motion
from rrru.effects.protocol import Contribution, Motion
from rrru.errors import FitError
from rrru.gap.unknown import UNKNOWN, unknown_functions

# a parameter of a law's shape may be off by this share
_SHAPE_STEP = 0.3
# an effect is tested where at least this share of the points has what it needs
_ENOUGH = 0.8
# nearer than this to a reversal of a drive the interpolated path may be on the wrong side of it
_STANDS = {"rad": 1e-8, "mm": 1e-6}
_NEAR_REVERSAL = {"rad": 3e-4, "mm": 0.1}


@dataclass(frozen=True)
class State:
    """A corrected sim: deviations (p,) of the mechanism and, by effect and number of its shape, coordinates (c,).

    shape_values: effect to the values of its shape's parameters where they have been fitted further.
    """

    deviations: np.ndarray
    effects: dict
    shape_values: dict = field(default_factory=dict)

    def shape(self, library, key):
        """Values of the shape's parameters of one effect (name, shape) by name."""
        name, number = key
        listed = library[name].coordinates.shapes[number]
        return self.shape_values.get(name, listed) if key in self.effects else listed

    def contribution(self, library, key, motion, coordinates=None, shape=None):
        """What one effect (name, shape) changes along a motion, at its own coordinates and shape or other ones."""
        coordinates = self.effects[key] if coordinates is None else coordinates
        effect = library[key[0]]
        values = effect.coordinates.to_values(coordinates, shape or self.shape(library, key))
        return effect.contribute(motion, values)


@dataclass(frozen=True)
class Linear:
    """The sim linearised about a state.

    data (n, 3): measured minus model, with the state's effects taken out again; base (n, 3, p): derivative by the
    mechanism's deviations; columns: (effect, shape) to the derivative (n, 3, c) by the effect's coordinates;
    shape_columns: effect of the state to what its shape's parameters may be wrong by, (n, 3, q), each column one
    standard deviation; shape_steps: effect to these parameters, each (name, value, stepped value); drive (n, 3 axes,
    K): derivative by the actuator values.
    """

    data: np.ndarray
    base: np.ndarray
    columns: dict
    shape_columns: dict
    shape_steps: dict
    drive: np.ndarray


@dataclass(frozen=True)
class Case:
    """Points of a campaign, all m of them, of which the n used ones are fitted.

    library: effects by name that the campaign can test, and after them the functions of `rrru.gap.unknown` that it can;
    untestable: name to the reason for the other effects.
    """

    mechanism: object
    measurements: pd.DataFrame
    motion: Motion
    used: np.ndarray
    library: dict
    untestable: dict
    noise_mm: float

    def __len__(self):
        return int(self.used.sum())

    @property
    def effects(self):
        """The library without the unknown functions."""
        return {name: effect for name, effect in self.library.items() if name not in UNKNOWN}

    @property
    def points(self):
        """The measurement table of the n used points."""
        return self.measurements.iloc[np.flatnonzero(self.used)]

    @property
    def measured_mm(self):
        """Measured positions (n, 3)."""
        return rows.measured(self.measurements)[self.used]

    @property
    def run(self):
        """Run numbers (n,)."""
        return self.measurements["run"].to_numpy()[self.used]

    def without(self, dropped):
        """The case without the used points flagged in (n,)."""
        used = self.used.copy()
        used[np.flatnonzero(used)[dropped]] = False
        return replace(self, used=used)

    def sim(self, deviations):
        """Positions (m, 3) of the calibrated sim without effects."""
        return self.mechanism.forward(
            rows.actuators(self.measurements, self.mechanism), deviations, rows.command(self.measurements)
        )

    def exact(self, state):
        """Positions (n, 3) of the sim corrected by a state: the exact closure with its effects."""
        change = sum((state.contribution(self.library, key, self.motion) for key in state.effects), Contribution())
        actuators, command = rows.actuators(self.measurements, self.mechanism), rows.command(self.measurements)
        twists = self.mechanism.twists(state.deviations) + change.twists
        return self.mechanism.measured(self.mechanism.solve(actuators, command, twists), twists)[self.used]

    def model(self, state):
        """Positions (n, 3) of a state's sim: exact where it has effects, the calibrated one where it has none."""
        return self.exact(state) if state.effects else self.sim(state.deviations)[self.used]

    def linearise(self, state, keys=None):
        """The sim linearised about a state; raises FitError where the state's sim has no pose at a point.

        keys: (effect, shape) pairs to make columns for, by default all.
        """
        actuators, position = rows.actuators(self.measurements, self.mechanism), self.sim(state.deviations)
        at = self.mechanism.map_at(actuators, position, state.deviations)
        model = self.model(state)
        lost = ~np.isfinite(model).all(axis=1) | ~np.isfinite(position[self.used]).all(axis=1)
        if lost.any():
            raise FitError(f"the sim has no pose at {int(lost.sum())} points")
        if keys is None:
            keys = [(name, k) for name, effect in self.library.items() for k in range(len(effect.coordinates.shapes))]
        columns = {key: self._columns(at, key, state) for key in dict.fromkeys((*keys, *state.effects))}
        by_shape = {key[0]: self._by_shape(at, key, state) for key in state.effects}
        data = self.measured_mm - model
        for key, coordinates in state.effects.items():
            data = data + columns[key] @ coordinates
        return Linear(
            data,
            at.columns(self.mechanism.directions)[self.used],
            columns,
            {name: shape_columns for name, (shape_columns, _) in by_shape.items()},
            {name: steps for name, (_, steps) in by_shape.items()},
            at.drive_response[self.used],
        )

    def _by_shape(self, at, key, state):
        """`Linear.shape_columns` and `Linear.shape_steps` of one effect of the state."""
        shape, effect = state.shape(self.library, key), self.library[key[0]]
        own = state.contribution(self.library, key, self.motion)
        columns, steps = [], []
        for name, value in shape.items():
            stepped = value * (1.0 + _SHAPE_STEP)
            if stepped > effect.parameters[name].high:
                stepped = value * (1.0 - _SHAPE_STEP)
            if stepped != value:
                other = state.contribution(self.library, key, self.motion, shape=dict(shape) | {name: stepped})
                columns.append(at.move((other - own).twists)[self.used])
                steps.append((name, value, stepped))
        nothing = np.zeros((len(self), 3, 0))
        return np.stack(columns, axis=-1) if columns else nothing, tuple(steps)

    def _columns(self, at, key, state):
        """Derivative (n, 3, c) by the coordinates of one effect: secants over their present or typical size."""
        step = np.array(self.library[key[0]].coordinates.typical)
        if key in state.effects:
            active = state.effects[key]
            step = np.where(np.abs(active) > 1e-3 * step, active, step)
        result = np.empty((len(self), 3, len(step)))
        for k, one in enumerate(np.diag(step)):
            change = state.contribution(self.library, key, self.motion, one)
            result[..., k] = at.move(change.twists)[self.used] / step[k]
        return result


def make_case(measurements, mechanism, masses, noise_mm, library, use_near_singularity=True):
    """The case of a measurement table.

    Effects whose needs the motion meets at too few points are set aside with the reason; the few points that lack what
    a tested effect needs are left out. Raises FitError for an empty table.
    """
    if not len(measurements):
        raise FitError("the campaign has no points")
    actuators, command = rows.actuators(measurements, mechanism), rows.command(measurements)
    motion = _motion(measurements, mechanism, masses, actuators)
    used = rows.usable(measurements, use_near_singularity) & np.isfinite(motion.position_mm).all(axis=1)
    # what lies in the drives' play at a run's start depends on how the robot arrived, which no column tells
    used &= ~starts_of_runs(measurements["run"].to_numpy()) & ~at_reversals(motion)
    used &= np.isfinite(mechanism.forward(actuators, guess_mm=command)).all(axis=1)
    if not used.any():
        raise FitError("the campaign has no point that a diagnosis can use")
    testable, untestable, complete = {}, {}, np.ones(len(used), dtype=bool)
    for name, effect in library.items():
        known = {need: np.isfinite(getattr(motion, need).reshape(len(used), -1)).all(axis=1) for need in effect.needs}
        missing = [need for need, there in known.items() if there[used].mean() < _ENOUGH]
        if missing:
            untestable[name] = f"needs {', '.join(missing)}, which the columns do not give"
        else:
            testable[name] = effect
            complete = np.all([complete, *known.values()], axis=0)
    used &= complete
    for name, function in unknown_functions(mechanism).items():
        values = [getattr(motion, need)[used] for need in function.needs]
        if all(np.isfinite(value).all() and np.ptp(value) > 0.0 for value in values):
            testable[name] = function
    return Case(mechanism, measurements, motion, used, testable, untestable, float(noise_mm))


def at_reversals(motion):
    """Rows (n,) at which a drive reverses: on its way up or down there the commanded points alone do not tell."""
    path, result = motion.path_drive, np.zeros(len(motion.drive), dtype=bool)
    for leg, unit in enumerate(motion.robot.parts.units):
        step = np.diff(path[:, leg])
        # a drive that stands still does not turn back
        moving = np.flatnonzero(~(np.abs(step) < _STANDS[unit]))
        reversals = moving[1:][step[moving[:-1]] * step[moving[1:]] < 0.0]
        if len(reversals):
            nearest = reversals[np.abs(reversals[:, None] - motion.path_index).argmin(axis=0)]
            close = np.abs(nearest - motion.path_index) <= STEPS
            result |= close & (np.abs(path[nearest, leg] - motion.drive[:, leg]) < _NEAR_REVERSAL[unit])
    return result


def _motion(measurements, mechanism, masses, actuators):
    """The motion that the effects see; at the measured points with the table's own actuator values."""
    path, told = driven_path(measurements)
    if mechanism.orients:
        # positions do not tell the orientation between the points: drives are taken to move evenly
        rows_of_path = np.arange(len(path))
        path_drive = np.stack([np.interp(rows_of_path, told["path_index"], one) for one in actuators.T], axis=1)
    else:
        path_drive = mechanism.inverse(path)
    lost = ~np.isfinite(path_drive).all(axis=1)
    if lost.any():
        # what is out of reach stays where it was last
        good = np.flatnonzero(~lost)
        path_drive = path_drive[good[np.maximum(np.searchsorted(good, np.arange(len(lost)), side="right") - 1, 0)]]
    path_drive[told["path_index"]] = actuators
    return make_motion(mechanism, masses, Course(drive=actuators, path_drive=path_drive, **told))
