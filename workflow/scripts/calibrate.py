"""Calibrations of one campaign on every set of trajectories."""

import pandas as pd

from rrru.calibration import campaign_fit
from rrru.calibration.campaign_noise import Noise
from rrru.calibration.schemas import TABLES
from rrru.store import json_files, tables
from rrru.store.job import run
from rrru.studies import setup


def main(settings, inputs, outputs):
    """Write the campaign's calibrations, parameters, fixed non-identifiable parameters, correlations and observability.

    And what the robot was taken for, with which the calibration can be applied to other measurements.
    """
    nominal, info = settings["nominal"], tables.read(inputs["campaigns"]).iloc[0]
    measurements = tables.read(inputs["measurements"])
    calibration = campaign_fit.CalibrationSettings.from_config(settings["calibration"])
    robot = setup.measured_robot(nominal, measurements)
    noise = Noise(info["noise_mm"], info["noise_rad"], info["noise_from"])
    fits = campaign_fit.fit_sets(measurements, robot, calibration, noise.mm, noise.arm_mm)
    truth = setup.true_deviations(robot, settings["truth"])
    gauge = pd.DataFrame(list(robot.gauge.items()), columns=["number", "stands_for"])
    frames = {"gauge": gauge.assign(campaign=settings["campaign"])}
    fitted = {"noise_mm": noise.mm, "arm_mm": noise.arm_mm, "calibration": settings["calibration"]}
    json_files.write({"nominal": nominal, **fitted}, outputs["robot"])
    tables.write_all(TABLES, frames | campaign_fit.tables(settings["campaign"], fits, truth), outputs)


if __name__ == "__main__":
    run(main, snakemake)
