"""A point of the corrected model, and the model linearised about it. Lengths in mm, angles in rad."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from rrru.arrays import BoolArray, FloatArray
from rrru.diagnosis.aliases import EffectKey, WeightStep
from rrru.diagnosis.discrepancy_basis import Library
from rrru.diagnosis.payload_nuisance import WEIGHT
from rrru.effects.protocol import Contribution, Motion, is_compliant, lacks_values

# singular values of columns of unit length below this share of the largest are rounding
RANK_TOLERANCE = 1e-9


@dataclass(frozen=True)
class ModelState:
    """A point of the corrected model: geometric errors and coefficients of the effects.

    deviations (p,): of the mechanism; effects: (effect, number of its shape) to its coordinates (c,);
    shape_values: effect to the values of its shape's parameters where they have been fitted; "weight" to the errors of
    payload and tilt.
    """

    deviations: FloatArray
    effects: Mapping[EffectKey, FloatArray]
    shape_values: dict[str, dict[str, float]] = field(default_factory=dict)

    @property
    def weight(self) -> dict[str, float]:
        """Errors of payload and tilt by name, empty where not fitted, see `rrru.diagnosis.payload_nuisance`."""
        return self.shape_values.get(WEIGHT, {})

    def under(self, weight: dict[str, float]) -> Self:
        """The state with other errors of payload and tilt."""
        return replace(self, shape_values=self.shape_values | {WEIGHT: weight})

    def shape(self, library: Library, key: EffectKey) -> Mapping[str, float]:
        """Values of the shape's parameters of one effect (name, shape) by name."""
        name, number = key
        if key in self.effects and name in self.shape_values:
            # a shape that was searched may not be among those of a library
            return self.shape_values[name]
        return library[name].coordinates.shapes[number]

    def contribution(
        self,
        library: Library,
        key: EffectKey,
        motion: Motion,
        coordinates: FloatArray | None = None,
        shape: Mapping[str, float] | None = None,
    ) -> Contribution:
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

    data: FloatArray
    base: FloatArray
    columns: dict[EffectKey, FloatArray]
    shape_columns: dict[str, FloatArray]
    shape_steps: dict[str, tuple[tuple[str, float, float], ...]]
    drive: FloatArray
    by_weight: dict[EffectKey, FloatArray] = field(default_factory=dict)
    weight_steps: tuple[WeightStep, ...] = ()
    base_prior: tuple[FloatArray, FloatArray] | None = None

    @cached_property
    def calibration_basis(self) -> FloatArray:
        """Orthonormal basis (3m, r) of the derivatives by the deviations, without combinations that change nothing."""
        columns = self.base.reshape(-1, self.base.shape[-1])
        basis, triangle = np.linalg.qr(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))
        turned, size, _ = np.linalg.svd(triangle)
        return np.asarray(basis @ turned[:, size > RANK_TOLERANCE * size.max(initial=0.0)])

    def at(self, rows: BoolArray) -> Self:
        """The linearisation at some of its rows (m,)."""
        return replace(
            self,
            data=self.data[rows],
            base=self.base[rows],
            drive=self.drive[rows],
            columns={key: values[rows] for key, values in self.columns.items()},
            shape_columns={name: values[rows] for name, values in self.shape_columns.items()},
            by_weight={key: values[rows] for key, values in self.by_weight.items()},
        )


class LeftByCalibration:
    """Residuals of a calibration of an orthonormal basis (3m, r), at those of the m readings that count.

    taken: share of the noise that it absorbs there.
    """

    def __init__(self, basis: FloatArray, counted: BoolArray) -> None:
        self._basis = basis
        self._counted = np.repeat(counted, 3)
        self.taken = float((self._basis[self._counted] ** 2).sum() / self._counted.sum())

    def residual(self, numbers: FloatArray) -> FloatArray:
        """Residuals (3n, k) at the readings that count, of numbers (3m, k) at all readings."""
        return numbers[self._counted] - self._basis[self._counted] @ (self._basis.T @ numbers)

    def error(self, generator: np.random.Generator, draws: int) -> FloatArray:
        """Draws (b,) of the mean square of its error, for noise of unit variance per axis."""
        # squares of independent combinations of its parameters
        powers = np.linalg.eigvalsh(self._basis[self._counted].T @ self._basis[self._counted])
        made = np.maximum(powers, 0.0) @ generator.standard_normal((len(powers), draws)) ** 2
        return np.asarray(3.0 * made / self._counted.sum())
