"""Every calibration of one campaign applied to all its trajectories."""

import pandas as pd

from rrru.compensate import evaluate
from rrru.fit.campaign_fit import errors_vector
from rrru.genetic.campaign_runs import typical_parameters
from rrru.store import tables
from rrru.store.job import job
from rrru.studies import setup as study


def main(config, campaign, inputs, outputs):
    """Write the campaign's errors point by point and summed up."""
    measurements, mechanism = tables.read(inputs["measurements"]), study.mechanism(config, campaign)
    typical = typical_parameters(tables.read(inputs["genetic"]), mechanism.parameters.names)
    parameters = pd.concat([tables.read(inputs["parameters"])[typical.columns], typical], ignore_index=True)
    virtual = study.virtual_campaign(config, campaign) if study.is_virtual(config, campaign) else None
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
    tables.write("errors", result.assign(campaign=campaign), outputs["errors"])
    tables.write(
        "error_summary", evaluate.summarise(result, measurements).assign(campaign=campaign), outputs["error_summary"]
    )


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.wildcards.campaign, snakemake.input, snakemake.output)
