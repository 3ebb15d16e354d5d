"""Linear-delta printers calibrated from their readings, and whether the answer that their firmware saved belongs to
these readings.

The firmware minimises the same sum of squares over its own numbers: the radius, the angles of towers a and b (c is the
gauge: the base turns freely), the three endstops, and with distances the three arms. It stops where steps of a size
that it states no longer help any number. Where that stop can lie is known without knowing its path: with the Hessian H
of the cost in these numbers, each of which is within the step s of its own best value,

    |saved - best|_i <= s sum_j |H^-1|_ij H_jj

A saved number beyond this was not found from these readings.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import optimize, stats

from rrru.errors import FitError
from rrru.fit.identifiability import analyse_columns, parameter_scale
from rrru.fit.least_squares import Fit, least_squares
from rrru.studies.printers.heights import HeightResiduals

NAMES = ("radius", "angle_a", "angle_b", "endstop_a", "endstop_b", "endstop_c", "arm_a", "arm_b", "arm_c")
UNITS = ("mm", "deg", "deg", *("mm",) * 6)
_ENDSTOPS = {"endstop_a", "endstop_b", "endstop_c"}
# the firmware's weights: all squared heights together count twice as much as all squared distances
_HEIGHTS_COUNT = 2.0
# changes of the microstep setting that are tried
_STEP_FACTORS = (0.0625, 0.125, 0.25, 0.5, 2.0, 4.0, 8.0, 16.0)
_CONFIDENCE = 0.95
_DENSE = 100
_UNKNOWN = "unknown: no number is that of the readings, nor with other steps, arms or one other reading"


def residuals_of(printer, parameter_set=None):
    """Residuals of a printer's readings with the firmware's weights; errors: "heights" or "distances", by default those
    it calibrates.
    """
    heights, distances = len(printer.height_mm), len(printer.distance_mm)
    weight = _HEIGHTS_COUNT * distances / heights if distances else 1.0
    mechanism = printer.mechanism(parameter_set)
    return HeightResiduals(
        mechanism, -printer.height_drop_mm, printer.height_mm, -printer.distance_drop_mm, printer.distance_mm, weight
    )


def own_numbers(mechanism, deviations):
    """A printer's own numbers (p,), NAMES in UNITS, under deviations (p,), and their derivative (p, p) by the errors."""
    legs = mechanism.legs(deviations)
    arm, radius = legs[:, 1], legs[0, 2]
    root = np.sqrt(arm**2 - radius**2)
    angle = np.degrees(np.asarray(mechanism.azimuth_rad) + legs[:, 3])
    numbers = np.array([radius, angle[0], angle[1], *(legs[:, 0] - root), *arm])
    slope = np.eye(len(NAMES))
    slope[1:3] = np.degrees(slope[1:3])
    slope[3:6, 0] = radius / root
    slope[3:6, 6:] = -np.diag(arm / root)
    count = len(deviations)
    return numbers[:count], slope[:count, :count]


def _own_jacobian(residuals, deviations):
    """Derivative (n, p) of the residual by the printer's own numbers."""
    return residuals.jacobian(deviations)[:, 0] @ np.linalg.inv(own_numbers(residuals.mechanism, deviations)[1])


def _stop(jacobian, step):
    """How far (p,) from the best numbers a program can stop whose steps no longer help; jacobian (n, p)."""
    hessian = jacobian.T @ jacobian
    return step * np.abs(np.linalg.inv(hessian)) @ np.diag(hessian)


@dataclass(frozen=True)
class PrinterFit:
    """A printer, its residuals, their least-squares fit and the step at which the other program stops (mm and
    degrees).
    """

    printer: object
    residuals: HeightResiduals
    fit: Fit
    stopping_step: float

    @property
    def names(self):
        """Names of the fitted numbers."""
        return NAMES[: len(self.fit.deviations)]

    @property
    def here(self):
        """Fitted numbers (p,) in mm and degrees."""
        return own_numbers(self.residuals.mechanism, self.fit.deviations)[0]

    @property
    def there(self):
        """Saved numbers (p,) in mm and degrees."""
        return own_numbers(self.residuals.mechanism, self.residuals.mechanism.parameters.nominal)[0]

    @cached_property
    def tolerance(self):
        """How far (p,) the other program's stop can lie from the best numbers, in mm and degrees; see the module."""
        return _stop(_own_jacobian(self.residuals, self.fit.deviations), self.stopping_step)

    @property
    def agrees(self):
        """Which saved numbers (p,) are those of the readings."""
        return np.abs(self.there - self.here) <= self.tolerance

    @property
    def freedom(self):
        """Readings less numbers."""
        return len(self.residuals) - len(self.fit.deviations)

    def reading_name(self, reading):
        """Kind and number from 1 of a reading, such as "distance 3", by its number from 0 over all."""
        heights = len(self.residuals.height_mm)
        return f"height {reading + 1}" if reading < heights else f"distance {reading - heights + 1}"

    @property
    def standard_errors(self):
        """Standard deviations (p,) of the numbers in mm and degrees.

        # ASSUME the noises of a height and a distance stand to each other as the firmware's weights say.
        """
        slope = own_numbers(self.residuals.mechanism, self.fit.deviations)[1]
        return np.sqrt(np.diag(slope @ self.fit.identifiability.covariance(self.fit.noise_mm) @ slope.T))

    @property
    def half_widths(self):
        """Half the 95 % interval (p,) of the numbers: Student's t with the fit's freedom, 12.7 standard errors with a
        freedom of 1.
        """
        return self.standard_errors * stats.t.ppf(0.5 + 0.5 * _CONFIDENCE, self.freedom)


def fit_printer(printer, stopping_step):
    """Calibrate a printer from its readings; raises FitError naming it where that fails or its numbers run away."""
    residuals = residuals_of(printer)
    names = residuals.mechanism.parameters.names
    try:
        fit = least_squares(residuals)
        if fit.at_bound.any() or fit.identifiability.rank < len(names):
            raise FitError(
                "the readings do not hold its numbers; allowed: readings over the whole bed, with the steps that the file states",
                fit,
            )
    except (FitError, ValueError, np.linalg.LinAlgError) as error:
        hint = _changed_steps(printer, stopping_step)
        raise FitError(f"{printer.name}: {error}{hint and f'; {hint}'}", getattr(error, "result", None)) from None
    return PrinterFit(printer, residuals, fit, stopping_step)


def reason(result):
    """Why a saved answer is not that of the readings, as far as they tell; empty where it is."""
    differ = [name for name, same in zip(result.names, result.agrees, strict=True) if not same]
    if not differ:
        return ""
    shift = (result.there - result.here)[3:6]
    if set(differ) == _ENDSTOPS and np.ptp(shift) <= 2.0 * result.tolerance[3:6].max():
        return f"all endstops are {shift.mean():+.3f} mm off alike: the zero of the heights was moved after the calibration"
    if len(differ) < len(result.names):
        return f"overwritten after the calibration: {', '.join(differ)}; the other numbers are those of the readings"
    steps = _changed_steps(result.printer, result.stopping_step)
    return steps or _changed_arms(result) or _changed_reading(result) or _UNKNOWN


def _off(printer, stopping_step):
    """How far (p,) the saved numbers are from those of the readings, one Gauss-Newton step, in shares of the other
    program's stop.
    """
    residuals = residuals_of(printer)
    start = residuals.mechanism.parameters.nominal
    jacobian = _own_jacobian(residuals, start)
    return np.linalg.lstsq(jacobian, residuals.residual(start)[:, 0])[0] / _stop(jacobian, stopping_step)


def _belongs(printer, stopping_step):
    """Whether a printer's saved numbers are those of its readings."""
    try:
        return bool((np.abs(_off(printer, stopping_step)) <= 1.0).all())
    except FitError:
        return False


def _changed_steps(printer, stopping_step):
    """Says by how much the microsteps' length was changed, if the answer belongs to the readings with that; else
    empty.
    """
    for factor in _STEP_FACTORS:
        drops = {key: factor * getattr(printer, key) for key in ("height_drop_mm", "distance_drop_mm")}
        if _belongs(replace(printer, **drops), stopping_step):
            return f"the answer belongs to steps {factor:g} times as long: steps or microsteps were changed after the calibration"
    return ""


def _changed_arms(result):
    """Says by how much all arms were changed, if the answer of heights belongs to the readings with that; else
    empty.
    """
    printer = result.printer
    if printer.parameter_set != "heights":
        return ""

    def with_arms(change):
        return replace(printer, arm_mm=printer.arm_mm + change)

    try:
        change = optimize.least_squares(lambda change: _off(with_arms(change), result.stopping_step), [0.0]).x[0]
    except FitError:
        return ""
    if _belongs(with_arms(change), result.stopping_step):
        return f"the answer belongs to arms of {np.mean(printer.arm_mm + change):.3f} mm: the arms were changed after the calibration"
    return ""


def _changed_reading(result):
    """Says which reading was changed, and from what, if the answer belongs to the readings with that; else empty."""
    residuals = result.residuals
    start = residuals.mechanism.parameters.nominal
    jacobian = _own_jacobian(residuals, start)
    # how far the best numbers move (p, n) per reading, and are off now (p,), in shares of the other program's stop
    moves = np.linalg.pinv(jacobian) / _stop(jacobian, result.stopping_step)[:, None]
    off = moves @ residuals.residual(start)[:, 0]
    changes = -(off @ moves) / (moves**2).sum(axis=0)
    for reading in np.flatnonzero((np.abs(off[:, None] + moves * changes) <= 1.0).all(axis=0)):
        before = residuals.measured_mm[reading] + changes[reading] / residuals.root_weight[reading]
        return f"the answer belongs to {result.reading_name(reading)} being {before:.3f} mm: this reading was changed after the calibration"
    return ""


def common_arm_error(result):
    """Standard error in mm of the arms' common length, beside the six other numbers, if its heights alone had to give
    it.

    Heights hardly see the scale: a robot with longer arms and a larger radius touches the same bed.
    """
    return _common_arm_error(result, -result.printer.height_drop_mm)


def dense_arm_error(result):
    """The same in mm for 100 heights with the noise of its own, spread evenly over the disc that these reach (a
    sunflower's seeds).
    """
    mechanism = result.residuals.mechanism
    seeds = np.arange(_DENSE)
    reach = np.linalg.norm(mechanism.forward(-result.printer.height_drop_mm)[:, :2], axis=1).max() * np.sqrt(
        (seeds + 0.5) / _DENSE
    )
    turn = seeds * np.pi * (3.0 - np.sqrt(5.0))
    places = np.stack(
        [reach * np.cos(turn), reach * np.sin(turn), np.full(_DENSE, result.printer.height_mm.mean())], axis=1
    )
    return _common_arm_error(result, mechanism.inverse(places))


def _common_arm_error(result, actuators):
    """The same in mm for heights at actuators (n, 3)."""
    deviations = np.zeros(len(NAMES))
    deviations[: len(result.fit.deviations)] = result.fit.deviations
    nothing = np.empty((0, 2, 3))
    heights = HeightResiduals(
        result.printer.mechanism("distances"), actuators, np.zeros(len(actuators)), nothing, nothing[:, 0, 0]
    )
    jacobian = heights.jacobian(deviations)
    both = np.concatenate([jacobian[..., :6], jacobian[..., 6:].sum(axis=-1, keepdims=True)], axis=-1)
    names, scale = heights.mechanism.parameters.names[:6], parameter_scale(heights.mechanism)
    noise = result.fit.noise_mm / np.sqrt(result.residuals.height_weight)
    return float(analyse_columns((*names, "dL"), scale[:7], both).standard_errors(noise)[-1])
