"""Every calibration of one campaign applied to all its trajectories."""

import pandas as pd

from rrru.compensation import evaluate
from rrru.compensation.schemas import TABLES
from rrru.genetic.campaign_runs import typical_parameters
from rrru.store import tables
from rrru.store.job import run
from rrru.studies import setup


def main(settings, inputs, outputs):
    """Write the campaign's errors point by point and summarised."""
    nominal = settings["nominal"]
    measurements = tables.read(inputs["measurements"])
    mechanism = setup.measured_robot(nominal, measurements)
    genetic = (tables.read(inputs[name]) for name in ("genetic", "genetic_parameters"))
    typical = typical_parameters(*genetic, mechanism.parameters.names)
    parameters = pd.concat([tables.read(inputs["parameters"])[typical.columns], typical], ignore_index=True)
    drive = None
    if settings["virtual"]:
        virtual = setup.virtual_campaign(nominal, settings["virtual"])

        def drive(controller):
            # every calibration has the same draws, so that differences come from the calibrations alone
            return virtual.run(controller, "closed_loop")[0]

    errors = evaluate.under_calibrations(measurements, mechanism, parameters, drive)
    frames = {"errors": errors, "error_summary": evaluate.summarise(errors, measurements)}
    campaign = settings["campaign"]
    tables.write_all(TABLES, {name: frame.assign(campaign=campaign) for name, frame in frames.items()}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
