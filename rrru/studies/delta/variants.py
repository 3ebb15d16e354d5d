"""Every variant to estimate the Delta's zero errors: its input and its residuals, and the paper's step.

Places are known up to a rigid motion. Readings are `rrru.estimation.observations`: `Distances` (paper C, eqs. 8 to 15),
`Shape`, `TargetHeights`. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass, replace

import numpy as np

from rrru.calibration.calibrate import assess, calibrate, estimate_deviations, estimate_deviations_at
from rrru.calibration.identifiability import analyse
from rrru.campaign.measurements import vectors
from rrru.estimation.observations.distances import Distances, Shape
from rrru.estimation.observations.target_positions import TargetHeights, TargetPositions
from rrru.simulation.tracker import measure


@dataclass(frozen=True)
class Seen:
    """Poses: planes' names (n,), commands (n, 3), and optical centres (n, 3) by the sources of variants."""

    planes: np.ndarray
    command_mm: np.ndarray
    images_mm: np.ndarray
    one_rotation_mm: np.ndarray
    true_centres_mm: np.ndarray

    @classmethod
    def of_tables(cls, centres, truth):
        """From `delta_centres` and `delta_truth`."""
        names = ((truth, "command"), (centres, "centre"), (centres, "one_rotation"), (truth, "true"))
        return cls(truth["plane"].to_numpy(), *(vectors(table, name) for table, name in names))


@dataclass(frozen=True)
class Variant:
    """One variant to estimate the zero errors.

    source: images, one_rotation (images of a camera with a common rotation), true_centres (for comparison only) or
    tracker; measure: distances, shape, positions or heights; planes: one or two; step: the paper's single linear step
    instead of a fit that has converged.
    """

    name: str
    source: str
    measure: str
    planes: str
    step: bool = False

    def used(self, planes):
        """Flags (n,) of its poses: the whole first plane, or every second pose of it and the second plane."""
        first = planes == "first"
        return first if self.planes == "one" else ~first | (np.cumsum(first) % 2 == 1)

    def places(self, twin, seen):
        """Commands (n, 3) and places (n, 3) of its input from `Seen`, in its source's frame."""
        used = self.used(seen.planes)
        command = seen.command_mm[used]
        if self.source == "tracker":
            return command, measure(twin.drive(command), twin.tracker_noise_mm, twin.generator("tracker", self.name))
        return command, getattr(seen, f"{self.source}_mm")[used]

    def residuals(self, mechanism, command_mm, actuators, places_mm):
        """Residuals that it fits, of the mechanism at actuators (n, 3) for places (n, 3)."""
        if self.measure == "distances":
            return Distances(mechanism, actuators, places_mm, alike=self.step)
        if self.measure == "shape":
            return Shape(mechanism, actuators, places_mm)
        kind = TargetHeights if self.measure == "heights" else TargetPositions
        return kind(mechanism, actuators, places_mm, command_mm)

    def zero_errors(self, mechanism, command_mm, places_mm):
        """Zero errors (3,) in rad for commands (n, 3) and places (n, 3)."""
        points = self.residuals(mechanism, command_mm, mechanism.require_reachable(command_mm), places_mm)
        return one_step(points) if self.step else estimate_deviations(points).values

    def fit(self, points):
        """Calibration by its residuals, and the covariance (3, 3) of its deviations in rad^2."""
        if self.step:
            return step_fit(points)
        result = calibrate(points)
        return result, result.identifiability.covariance(result.noise_mm)


VARIANTS = (
    Variant("paper", "images", "distances", "one", step=True),
    Variant("converged", "images", "distances", "one"),
    Variant("two_heights", "images", "distances", "two"),
    Variant("shape", "images", "shape", "one"),
    Variant("shape_two_heights", "images", "shape", "two"),
    Variant("one_rotation", "one_rotation", "distances", "one"),
    Variant("one_rotation_two_heights", "one_rotation", "distances", "two"),
    Variant("one_rotation_shape", "one_rotation", "shape", "one"),
    Variant("true_centres", "true_centres", "distances", "one"),
    Variant("true_centres_two_heights", "true_centres", "distances", "two"),
    Variant("tracker_heights", "tracker", "heights", "one"),
    Variant("tracker_positions", "tracker", "positions", "one"),
)
PAPER = VARIANTS[0]


# --- the paper's step, and its omitted-variable bias


def one_step(residuals):
    """Deviations (p,) by one step from the nominal robot: the paper's for `Distances` of equal weight (eq. 15)."""
    nominal = residuals.mechanism.parameters.nominal
    return nominal + taken_for_errors(residuals, residuals.residual(nominal)[..., None])[:, 0]


def step_fit(distances):
    """Calibration by the paper's step on `Distances` of equal weight, and the covariance (p, p) of its deviations.

    With J' J instead of the optimal weights the covariance is s^2 J^+ C J^+', C that of the distances, and s^2 the sum
    of squared residuals over the trace of (I - J J^+) C. Singular values are those of the whitened distances, as in
    every other fit.
    """
    deviations = one_step(distances)
    plain = assess(estimate_deviations_at(distances, deviations, "one step", 1))
    nominal = distances.mechanism.parameters.nominal
    jacobian = distances.jacobian(nominal)[:, 0]
    inverse = np.linalg.pinv(jacobian)
    left = distances.covariance - jacobian @ (inverse @ distances.covariance)
    noise = np.sqrt((plain.residual_mm**2).sum() / np.trace(left))
    covariance = noise**2 * inverse @ distances.covariance @ inverse.T
    identifiability = analyse(distances.mechanism, replace(distances, alike=False).jacobian(deviations))
    errors = np.sqrt(np.diag(covariance))
    return replace(plain, noise_mm=float(noise), standard_errors=errors, identifiability=identifiability), covariance


def taken_for_errors(residuals, changes):
    """Bias (p, q) of a fit from changes of its residuals (m, k, q) that are not in its model, to first order.

    Changes are derivatives of measured minus model values: of the model by other deviations, or of the measurement by
    an instrument's errors.
    """
    jacobian = residuals.jacobian(residuals.mechanism.parameters.nominal)
    flat = jacobian.reshape(-1, jacobian.shape[-1])
    return -np.linalg.lstsq(flat, np.asarray(changes).reshape(len(flat), -1), rcond=None)[0]
