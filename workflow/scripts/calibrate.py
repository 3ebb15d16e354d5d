"""Calibrations of one campaign on every set of trajectories."""

from rrru.fit import campaign_fit
from rrru.store import tables
from rrru.store.job import job
from rrru.studies import setup as study


def main(config, campaign, inputs, outputs):
    """Write the campaign's calibrations, parameters, correlations and observability."""
    measurements = tables.read(inputs["measurements"])
    info = tables.read(inputs["campaigns"]).iloc[0]
    # noise known only from residuals is estimated anew by each fit
    noise_mm = None if info["noise_from"] == "residuals" else info["noise_mm"]
    fits = campaign_fit.fit_sets(measurements, study.mechanism(config, campaign), config["calibration"], noise_mm)
    for name, frame in campaign_fit.tables(campaign, fits, study.true_errors(config, campaign)).items():
        tables.write(name, frame, outputs[name])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.wildcards.campaign, snakemake.input, snakemake.output)
