"""Every calibration of one campaign applied to all its trajectories."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from rrru.compensation import evaluate
from rrru.compensation.schemas import TABLES
from rrru.genetic.campaign_runs import typical_parameters
from rrru.pipeline import setup
from rrru.pipeline.setup import Controller
from rrru.store import tables


def main(settings: Mapping[str, Any], inputs: Mapping[str, str], outputs: Mapping[str, str]) -> None:
    """Write the campaign's errors point by point and summarised."""
    read = {name: tables.read(path) for name, path in inputs.items()}
    write(compensate(settings, read), outputs)


def compensate(settings: Mapping[str, Any], read: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Frames of `errors` and `error_summary`.

    read: frames of `measurements`, `parameters`, `genetic` and `genetic_parameters`.
    """
    nominal, measurements = settings["nominal"], read["measurements"]
    mechanism = setup.measured_robot(nominal, measurements)
    typical = typical_parameters(read["genetic"], read["genetic_parameters"], mechanism.parameters.names)
    parameters = pd.concat([read["parameters"][typical.columns], typical], ignore_index=True)
    drive = None
    if settings["virtual"]:
        virtual = setup.virtual_campaign(nominal, settings["virtual"])

        def drive(controller: Controller) -> pd.DataFrame:
            # every calibration has the same draws, so that differences come from the calibrations alone
            return virtual.run(controller, "closed_loop")[0]

    errors = evaluate.under_calibrations(measurements, mechanism, parameters, drive)
    frames = {"errors": errors, "error_summary": evaluate.summarise(errors, measurements)}
    return {name: frame.assign(campaign=settings["campaign"]) for name, frame in frames.items()}


def write(frames: Mapping[str, pd.DataFrame], paths: Mapping[str, str]) -> None:
    """Write the frames of `compensate` to paths by table name."""
    tables.write_all(TABLES, frames, paths)
