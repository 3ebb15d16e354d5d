"""A point of the corrected model, and the model linearised about it. Lengths in mm, angles in rad."""

from dataclasses import dataclass, field, replace

import numpy as np

from rrru.diagnosis.payload_nuisance import WEIGHT
from rrru.effects.protocol import Contribution, is_compliant, lacks_values


@dataclass(frozen=True)
class ModelState:
    """A point of the corrected model: geometric errors and coefficients of the effects.

    deviations (p,): of the mechanism; effects: (effect, number of its shape) to its coordinates (c,);
    shape_values: effect to the values of its shape's parameters where they have been fitted; "weight" to the errors of
    payload and tilt.
    """

    deviations: np.ndarray
    effects: dict
    shape_values: dict = field(default_factory=dict)

    @property
    def weight(self):
        """Errors of payload and tilt by name, empty where not fitted, see `rrru.diagnosis.payload_nuisance`."""
        return self.shape_values.get(WEIGHT, {})

    def under(self, weight):
        """The state with other errors of payload and tilt."""
        return replace(self, shape_values=self.shape_values | {WEIGHT: weight})

    def shape(self, library, key):
        """Values of the shape's parameters of one effect (name, shape) by name."""
        name, number = key
        if key in self.effects and name in self.shape_values:
            # a shape that was searched may not be among those of a library
            return self.shape_values[name]
        return library[name].coordinates.shapes[number]

    def contribution(self, library, key, motion, coordinates=None, shape=None):
        """What one effect (name, shape) changes along a motion, at its own coordinates and shape or other ones."""
        coordinates = self.effects[key] if coordinates is None else coordinates
        effect = library[key[0]]
        values = effect.coordinates.to_values(coordinates, shape or self.shape(library, key))
        loaded = motion.under(*self.weight.values()) if self.weight and is_compliant(effect) else motion
        made = effect.contribute(loaded, values)
        if not (effect.needs and (lacking := lacks_values(effect, motion)).any()):
            return made
        # its change is unknown there; `rrru.diagnosis.evidence` does not count these readings for it
        return Contribution(np.where(lacking[:, None, None], 0.0, made.twists))


@dataclass(frozen=True)
class LinearizedProblem:
    """The model linearised about a state.

    data (m, 3): readings minus model, with the state's effects added back; base (m, 3, p): derivative by the
    mechanism's deviations; columns: (effect, shape) to the derivative (m, 3, c) by the effect's coordinates;
    shape_columns: effect of the state to the changes (m, 3, q) by its shape parameters, each column for one
    standard deviation; shape_steps: effect to these parameters, each (name, value, stepped value); drive (m, 3, K):
    derivative by the actuator values; by_weight: (effect, shape) of compliant effects to the changes of their
    columns, (m, 3, q c), by a step of each of q errors of payload and tilt; weight_steps: these, each (name, value,
    stepped value, prior mean in steps); base_prior: standard deviations (p,) and means (p,) of the geometric errors'
    priors, the means as steps from the present values, None for flat priors.
    """

    data: np.ndarray
    base: np.ndarray
    columns: dict
    shape_columns: dict
    shape_steps: dict
    drive: np.ndarray
    by_weight: dict = field(default_factory=dict)
    weight_steps: tuple = ()
    base_prior: tuple | None = None

    def at(self, rows):
        """The linearisation at some of its rows (m,)."""
        arrays = {name: getattr(self, name)[rows] for name in ("data", "base", "drive")}
        columns = {name: getattr(self, name) for name in ("columns", "shape_columns", "by_weight")}
        chosen = {name: {key: values[rows] for key, values in made.items()} for name, made in columns.items()}
        return replace(self, **arrays, **chosen)
