"""One campaign as the diagnosis sees it: its usable points, the calibrated sim, every effect's signature, and the exact
corrected sim.

The sim with effects is the exact closure of the plant; a hypothesis is fitted on its linearisation, renewed about the
best one found. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from rrru.campaign import measurements as rows
from rrru.effects.effect import Contribution
from rrru.errors import FitError
from rrru.gap.driven_path import at_turn_back, motion_of, starts_of_runs
from rrru.gap.unknown import UNKNOWN, unknown_functions
from rrru.plant.closure import corrected_sim
from rrru.robots.first_order import first_order

# a parameter of a law's shape may be off by this share
_SHAPE_STEP = 0.3
# an effect is tested where at least this share of the points has what it needs
_ENOUGH = 0.8


@dataclass(frozen=True)
class State:
    """A corrected sim: deviations (p,) of the mechanism, per effect (name, shape) its coordinates (c,), and shapes fitted
    further, by name.
    """

    deviations: np.ndarray
    effects: dict
    shapes: dict = field(default_factory=dict)

    def shape(self, library, key):
        """Values of the shape's parameters of one effect (name, shape) by name."""
        name, number = key
        listed = library[name].coordinates.shapes[number]
        return self.shapes.get(name, listed) if key in self.effects else listed

    def values(self, library):
        """Parameter values (p,) by effect name."""
        return {
            key[0]: library[key[0]].coordinates.to_values(value, self.shape(library, key))
            for key, value in self.effects.items()
        }


@dataclass(frozen=True)
class Linear:
    """The sim linearised about a state.

    data (n, 3): measured minus model, with the state's effects taken out again; base (n, 3, p): derivative by the
    mechanism's errors; columns: (effect, shape) to the derivative (n, 3, c) by the effect's coordinates; laws: effect
    of the state to what the parameters of its shape may be wrong by, (n, 3, q), each column one standard deviation;
    reshaped: effect to these parameters, each (name, value, stepped value); drive (n, 3 axes, 3): derivative by the
    actuator values.
    """

    data: np.ndarray
    base: np.ndarray
    columns: dict
    laws: dict
    reshaped: dict
    drive: np.ndarray


@dataclass(frozen=True)
class Case:
    """Points of a campaign, all m of them, of which the n used ones are fitted.

    library: effects by name that the campaign can test, and after them the functions of `rrru.gap.unknown` that it can;
    untestable: name to the reason for the other effects.
    """

    mechanism: object
    measurements: object
    motion: object
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
        return self.mechanism.forward(rows.actuators(self.measurements), deviations, rows.command(self.measurements))

    def contribution(self, state):
        """What the state's effects change along the motion, together."""
        values = state.values(self.library)
        return sum((self.library[name].contribute(self.motion, values[name]) for name in values), Contribution())

    def exact(self, state):
        """Positions (n, 3) of the sim corrected by a state: the exact closure with its effects."""
        actuators, command = rows.actuators(self.measurements), rows.command(self.measurements)
        return corrected_sim(self.mechanism, state.deviations, actuators, command, self.contribution(state))[self.used]

    def model(self, state):
        """Positions (n, 3) of a state's sim: the exact one where it has effects, the calibrated one where it has
        none.
        """
        return self.exact(state) if state.effects else self.sim(state.deviations)[self.used]

    def linearise(self, state, shapes=None):
        """The sim linearised about a state; raises FitError where the state's sim has no pose at a point.

        shapes: (effect, shape) pairs to make columns for, by default all.
        """
        actuators = rows.actuators(self.measurements)
        position = self.sim(state.deviations)
        legs = first_order(self.mechanism, position, actuators, state.deviations)
        model = self.model(state)
        lost = ~np.isfinite(model).all(axis=1) | ~np.isfinite(position[self.used]).all(axis=1)
        if lost.any():
            raise FitError(f"the sim has no pose at {int(lost.sum())} points")
        if shapes is None:
            shapes = [
                (name, shape)
                for name, effect in self.library.items()
                for shape in range(len(effect.coordinates.shapes))
            ]
        columns = {key: self._columns(legs, key, state) for key in dict.fromkeys((*shapes, *state.effects))}
        laws, reshaped = {}, {}
        for key in state.effects:
            laws[key[0]], reshaped[key[0]] = self._laws(legs, key, state)
        data = self.measured_mm - model
        for key, coordinates in state.effects.items():
            data = data + columns[key] @ coordinates
        return Linear(
            data,
            self.mechanism.parameter_jacobian(position, actuators, state.deviations)[self.used],
            columns,
            laws,
            reshaped,
            (legs.response[..., 0] * legs.drive[:, None, :])[self.used],
        )

    def _laws(self, legs, key, state):
        """What the shape of an effect of the state may be wrong by, (n, 3, q), and the steps of its parameters; see
        Linear.
        """
        coordinates, effect = self.library[key[0]].coordinates, self.library[key[0]]
        shape = state.shape(self.library, key)
        leg = legs.leg_deviations(effect.contribute(self.motion, coordinates.to_values(state.effects[key], shape)))
        columns, steps = [], []
        for name, value in shape.items():
            high = effect.parameters[name].high
            stepped = (
                value * (1.0 + _SHAPE_STEP) if value * (1.0 + _SHAPE_STEP) <= high else value * (1.0 - _SHAPE_STEP)
            )
            if stepped != value:
                other = effect.contribute(
                    self.motion, coordinates.to_values(state.effects[key], dict(shape) | {name: stepped})
                )
                columns.append(np.einsum("nalc,nlc->na", legs.response, legs.leg_deviations(other) - leg)[self.used])
                steps.append((name, value, stepped))
        nothing = np.zeros((len(self), 3, 0))
        return np.stack(columns, axis=-1) if columns else nothing, tuple(steps)

    def _columns(self, legs, key, state):
        """Derivative (n, 3, c) by the coordinates of one effect: secants over their present or typical size."""
        effect, active = self.library[key[0]], state.effects.get(key)
        shape = state.shape(self.library, key)
        coordinates = effect.coordinates
        step = np.array(coordinates.typical)
        if active is not None:
            step = np.where(np.abs(active) > 1e-3 * step, active, step)
        result = np.empty((len(self), 3, len(coordinates)))
        for k in range(len(coordinates)):
            one = np.zeros(len(coordinates))
            one[k] = step[k]
            values = coordinates.to_values(one, shape)
            result[..., k] = legs.move(effect.contribute(self.motion, values))[self.used] / step[k]
        return result


def make_case(measurements, mechanism, masses, noise_mm, library, use_near_singularity=True):
    """The case of a measurement table.

    Effects whose needs the motion meets at too few points are set aside with the reason; the few points that lack what
    a tested effect needs are left out. Raises FitError for an empty table.
    """
    if not len(measurements):
        raise FitError("the campaign has no points")
    motion = motion_of(measurements, mechanism, masses)
    used = rows.usable(measurements, use_near_singularity) & np.isfinite(motion.position_mm).all(axis=1)
    # what lies in the drives' play at a run's start depends on how the robot arrived, which no column tells
    used &= ~starts_of_runs(measurements["run"].to_numpy()) & ~at_turn_back(motion, mechanism.drive_unit)
    used &= np.isfinite(mechanism.forward(rows.actuators(measurements), guess_mm=rows.command(measurements))).all(
        axis=1
    )
    testable, untestable, complete = {}, {}, np.ones(len(used), dtype=bool)
    for name, effect in library.items():
        known = {need: np.isfinite(getattr(motion, need).reshape(len(used), -1)).all(axis=1) for need in effect.needs}
        missing = [need for need, there in known.items() if there[used].mean() < _ENOUGH]
        if missing:
            untestable[name] = f"needs {', '.join(missing)}, which the columns do not give"
        else:
            testable[name] = effect
            complete &= np.all(list(known.values()), axis=0) if known else True
    used &= complete
    for name, function in unknown_functions(mechanism.drive_unit).items():
        values = [getattr(motion, need)[used] for need in function.needs]
        if all(np.isfinite(value).all() and np.ptp(value) > 0.0 for value in values):
            testable[name] = function
    return Case(mechanism, measurements, motion, used, testable, untestable, float(noise_mm))
