"""Every calibration of one campaign applied to all its trajectories."""

import pandas as pd

from rrru.compensate import evaluate
from rrru.fit.campaign_fit import errors_vector
from rrru.fit.schemas import TABLES
from rrru.genetic.campaign_runs import typical_parameters
from rrru.store import tables
from rrru.store.job import run
from rrru.studies import setup


def main(settings, inputs, outputs):
    """Write the campaign's errors point by point and summed up."""
    nominal = settings["nominal"]
    measurements, mechanism = tables.read(inputs["measurements"]), setup.mechanism(nominal)
    typical = typical_parameters(tables.read(inputs["genetic"]), mechanism.parameters.names)
    parameters = pd.concat([tables.read(inputs["parameters"])[typical.columns], typical], ignore_index=True)
    virtual = setup.virtual_campaign(nominal, settings["virtual"]) if settings["virtual"] else None
    frames = [evaluate.before(measurements)]
    for calibration, method in parameters[["calibration", "method"]].drop_duplicates().itertuples(index=False):
        deviations = errors_vector(parameters, calibration, method, mechanism)
        frames.append(evaluate.model_residual(measurements, mechanism, deviations, calibration, method))
        if virtual is not None:
            # every calibration is driven with the same draws, so that differences are the calibrations'
            generator = virtual.generator("closed_loop")
            frames.append(
                evaluate.closed_loop(
                    virtual.robot, virtual.plan, deviations, virtual.noise_mm, generator, calibration, method
                )
            )
    result = pd.concat(frames, ignore_index=True)
    result_tables = {"errors": result, "error_summary": evaluate.summarise(result, measurements)}
    campaign = settings["campaign"]
    tables.write_all(TABLES, {key: frame.assign(campaign=campaign) for key, frame in result_tables.items()}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
