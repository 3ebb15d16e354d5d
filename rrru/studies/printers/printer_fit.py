"""Linear-delta printers calibrated from their readings, in the numbers of their firmware."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import special

from rrru.calibration.calibrate import Calibration, calibrate
from rrru.calibration.identifiability import analyse_columns, parameter_scale
from rrru.errors import FitError
from rrru.estimation.f_test import LinearizedModel
from rrru.estimation.observations.probed_heights import ProbedHeights
from rrru.estimation.problem import WhiteNoise
from rrru.studies.printers import steps
from rrru.studies.printers.firmware import NAMES, own_jacobian, own_numbers, residuals_of, rounding, stop
from rrru.studies.printers.printer import Printer

_CONFIDENCE = 0.95
# heights of the dense probing
_DENSE = 100


@dataclass(frozen=True)
class PrinterFit:
    """A printer, its calibration and the step at which the firmware's program stops (mm and degrees).

    printer: with carriage displacements in the steps of its readings, which are step_factors (3,) times those of the
    file.
    """

    printer: Printer
    fit: Calibration
    stopping_step: float
    step_factors: np.ndarray

    @property
    def residuals(self):
        """Its ProbedHeights."""
        return self.fit.observations

    @cached_property
    def in_mm(self):
        """The Estimate of its readings (n, 1) in mm about the answer, without the firmware's weights."""
        unweighted = replace(self.residuals, height_weight=1.0)
        return self.fit.at(self.fit.deviations, "without weights", unweighted).estimate

    def linearized(self, sd):
        """The LinearizedModel about the answer; sd (n,): relative standard deviations of the readings' noises."""
        return LinearizedModel.of(self.in_mm, WhiteNoise(sd[:, None]))

    @property
    def names(self):
        """Names of the fitted numbers."""
        return NAMES[: len(self.fit.deviations)]

    @property
    def fitted(self):
        """Fitted numbers (p,) in mm and degrees."""
        return own_numbers(self.residuals.mechanism, self.fit.deviations)[0]

    @property
    def saved(self):
        """Saved numbers (p,) in mm and degrees."""
        return own_numbers(self.residuals.mechanism, self.residuals.mechanism.parameters.nominal)[0]

    @cached_property
    def tolerance(self):
        """Largest possible stopping errors (p,) of the program, in mm and degrees; see `firmware`."""
        return stop(own_jacobian(self.residuals, self.fit.deviations), self.stopping_step)

    @property
    def agrees(self):
        """Which saved numbers (p,) are those of the readings."""
        return np.abs(self.saved - self.fitted) <= self.slack

    @property
    def slack(self):
        """Largest possible errors (p,) of saved numbers of these readings: the program's stop and rounding."""
        return self.tolerance + rounding(self.printer)[: len(self.names)]

    @property
    def freedom(self):
        """Degrees of freedom: readings minus numbers."""
        return len(self.residuals) - len(self.fit.deviations)

    def reading_name(self, reading):
        """Kind and number from 1 of a reading, such as "distance 3", by its number from 0 over all."""
        heights = len(self.residuals.height_mm)
        return f"height {reading + 1}" if reading < heights else f"distance {reading - heights + 1}"

    @cached_property
    def standard_errors(self):
        """Standard errors (p,) of the numbers in mm and degrees.

        # ASSUME the noises of a height and a distance have the ratio of the firmware's weights.
        """
        slope = own_numbers(self.residuals.mechanism, self.fit.deviations)[1]
        return np.sqrt(np.diag(slope @ self.fit.identifiability.covariance(self.fit.noise_mm) @ slope.T))

    @property
    def half_widths(self):
        """Half the 95 % interval (p,) of the numbers, Student's t: 12.7 standard errors with 1 degree of freedom."""
        return self.standard_errors * special.stdtrit(self.freedom, 0.5 + 0.5 * _CONFIDENCE)


def fit_printer(printer, stopping_step, level):
    """Calibrate a printer from its readings, in the steps of these readings.

    level: of the test whether these differ from those of the file, see `steps`. Raises FitError naming the printer
    where the fit fails or its numbers reach a bound.
    """
    factors = steps.changed_steps(printer, level)
    printer = steps.with_steps(printer, factors)
    try:
        fit = calibrate(residuals_of(printer))
        if fit.at_bound.any() or fit.identifiability.rank < len(fit.deviations):
            allowed = "readings over the whole bed, with the steps that the file states"
            raise FitError(f"the readings do not determine its numbers; allowed: {allowed}", fit)
    except (FitError, ValueError, np.linalg.LinAlgError) as error:
        reasons = "; ".join(filter(None, [str(error), steps.describe(factors)]))
        raise FitError(f"{printer.name}: {reasons}", getattr(error, "result", None)) from None
    return PrinterFit(printer, fit, stopping_step, factors)


def common_arm_error(result):
    """Standard error in mm of the arms' common length from heights alone, fitted together with the six other numbers.

    Heights are hardly sensitive to the scale: a robot with longer arms and a larger radius touches the same bed.
    """
    return _common_arm_error(result, -result.printer.height_drop_mm)


def dense_arm_error(result):
    """The same in mm for 100 heights with the same noise, spread evenly over their disc (sunflower spiral)."""
    return _common_arm_error(result, result.residuals.mechanism.inverse(even_places(result, _DENSE)))


def even_places(result, count):
    """Places (count, 3) in mm on the disc of a printer's heights, in a sunflower spiral."""
    mechanism, seeds = result.residuals.mechanism, np.arange(count)
    reach = np.linalg.norm(mechanism.forward(-result.printer.height_drop_mm)[:, :2], axis=1).max()
    radius, turn = reach * np.sqrt((seeds + 0.5) / count), seeds * np.pi * (3.0 - np.sqrt(5.0))
    height = np.full(count, result.printer.height_mm.mean())
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)


def _common_arm_error(result, actuators):
    """The same in mm for heights at actuators (n, 3)."""
    deviations = np.zeros(len(NAMES))
    deviations[: len(result.fit.deviations)] = result.fit.deviations
    nothing = np.empty((0, 2, 3))
    mechanism = result.printer.mechanism("distances")
    heights = ProbedHeights(mechanism, actuators, np.zeros(len(actuators)), nothing, nothing[:, 0, 0])
    jacobian = heights.jacobian(deviations)
    both = np.concatenate([jacobian[..., :6], jacobian[..., 6:].sum(axis=-1, keepdims=True)], axis=-1)
    identifiability = analyse_columns((*mechanism.parameters.names[:6], "dL"), parameter_scale(mechanism)[:7], both)
    return float(identifiability.standard_errors(result.fit.noise_mm / np.sqrt(result.residuals.height_weight))[-1])
