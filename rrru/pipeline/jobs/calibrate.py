"""Calibrations of one campaign on every set of trajectories."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from rrru.calibration import campaign_fit
from rrru.calibration.calibrate import Calibration
from rrru.calibration.campaign_noise import Noise
from rrru.calibration.schemas import TABLES
from rrru.pipeline import setup
from rrru.store import json_files, tables


def main(settings: Mapping[str, Any], inputs: Mapping[str, str], outputs: Mapping[str, str]) -> None:
    """Write the campaign's calibrations, parameters, fixed non-identifiable parameters, correlations and observability.

    And what the robot was taken for, with which the calibration can be applied to other measurements.
    """
    frames, _ = calibrate(settings, tables.read(inputs["measurements"]), tables.read(inputs["campaigns"]))
    write(settings, frames, tables.read(inputs["campaigns"]), outputs)


def calibrate(
    settings: Mapping[str, Any], measurements: pd.DataFrame, campaigns: pd.DataFrame
) -> tuple[dict[str, pd.DataFrame], dict[tuple[str, str], Calibration]]:
    """Frames by table name, and {(set, method): Calibration}.

    measurements, campaigns: the campaign's tables. Raises ConfigError where no set of trajectories can be fitted.
    """
    robot, noise = setup.measured_robot(settings["nominal"], measurements), _noise(campaigns)
    calibration = campaign_fit.CalibrationSettings.from_config(settings["calibration"])
    fits = campaign_fit.fit_sets(measurements, robot, calibration, noise.mm, noise.characteristic_length_mm)
    truth = setup.true_deviations(robot, settings["truth"])
    gauge = pd.DataFrame(list(robot.gauge.items()), columns=["number", "stands_for"])
    frames = {"gauge": gauge.assign(campaign=settings["campaign"])}
    return frames | campaign_fit.tables(settings["campaign"], fits, truth), fits


def write(
    settings: Mapping[str, Any], frames: Mapping[str, pd.DataFrame], campaigns: pd.DataFrame, paths: Mapping[str, str]
) -> None:
    """Write the frames of `calibrate`, and paths["robot"], to paths by table name."""
    noise = _noise(campaigns)
    fitted = {"noise_mm": noise.mm, "arm_mm": noise.characteristic_length_mm, "calibration": settings["calibration"]}
    json_files.write({"nominal": settings["nominal"], **fitted}, paths["robot"])
    tables.write_all(TABLES, frames, paths)


def _noise(campaigns: pd.DataFrame) -> Noise:
    """The Noise of the campaign's row of `campaigns`."""
    info = campaigns.iloc[0]
    return Noise(info["noise_mm"], info["noise_rad"], info["noise_from"])
