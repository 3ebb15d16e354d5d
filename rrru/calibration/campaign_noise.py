"""The measuring noise of a campaign, given or from the residuals of a calibration of all its points."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from rrru.calibration.calibrate import calibrate
from rrru.calibration.campaign_fit import select
from rrru.campaign import measurements as rows
from rrru.campaign.noise import quieter_repeats, read_noise, reading_series
from rrru.errors import ConfigError
from rrru.estimation.noise_model import high_frequency_noises
from rrru.kinematics.robot import Robot


class Noise(NamedTuple):
    """Noise per axis of positions in mm and of orientations in rad, NaN where none were measured, and their sources.

    rad_source: "given", "high_frequency" or, where no orientations were measured, "".
    """

    mm: float
    rad: float
    source: str
    rad_source: str = ""

    @property
    def characteristic_length_mm(self) -> float:
        """Length that makes orientations comparable with positions."""
        return self.mm / self.rad if self.mm > 0.0 and self.rad > 0.0 else np.nan


def campaign_noise(
    robot: Robot,
    measurements: pd.DataFrame,
    given: tuple[float | None, float | None],
    use_near_singularity: bool = True,
) -> Noise:
    """The Noise of a campaign; where it is not given it is estimated, see `rrru.estimation.noise_model`.

    given: of positions in mm and of orientations in rad, None where it is not stated. Raises ConfigError where there
    are too few points to estimate it.
    """
    noise_mm, noise_rad = given
    known = "given"
    if noise_mm is None:
        noise_mm, known = read_noise(measurements), "readings"
    turned = rows.has_turns(measurements)
    if noise_mm is not None and (noise_rad or not turned):
        return Noise(noise_mm, noise_rad, known, "given") if noise_rad and turned else Noise(noise_mm, np.nan, known)
    residuals = select(measurements, robot, ["*"], use_near_singularity, robot.characteristic_length_mm)
    if residuals is None:
        raise ConfigError("too few usable points to estimate noise_mm; give it")
    fit, used = calibrate(residuals), measurements[rows.usable(measurements, use_near_singularity)]
    left, columns = residuals.residual(fit.deviations), residuals.jacobian(fit.deviations)
    series, positions = reading_series(used, residuals.readings), np.arange(len(left)) < len(used)
    found_mm, turned_mm = high_frequency_noises(left, columns, series, positions)
    found_rad, rad_source = np.nan, ""
    if turned:
        found_rad = noise_rad or turned_mm / robot.characteristic_length_mm
        rad_source = "given" if noise_rad else "high_frequency"
    if noise_mm is not None:
        return Noise(noise_mm, found_rad, known, rad_source)
    if np.isnan(found_mm):
        raise ConfigError("too few usable points to estimate noise_mm; give it")
    repeated = quieter_repeats(used, found_mm)
    if repeated is None:
        return Noise(found_mm, found_rad, "high_frequency", rad_source)
    return Noise(repeated, found_rad, "repeats", rad_source)
