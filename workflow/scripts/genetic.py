"""The genetic algorithm with the chosen settings on every calibration set of one campaign, beside least squares."""

import pandas as pd
from tqdm import tqdm

from rrru.genetic import campaign_runs as genetic_study
from rrru.store import tables
from rrru.store.job import job
from rrru.studies import setup as study


def main(config, campaign, inputs, outputs):
    """Write the campaign's runs, their history, the comparison with least squares and the times."""
    measurements = tables.read(inputs["measurements"])
    tied, identifiable = study.mechanism(config, campaign, "tied"), study.mechanism(config, campaign)
    settings = genetic_study.settings_from_config(config["genetic"])
    results = []
    for name, patterns in tqdm(config["calibration"]["sets"].items(), desc=f"genetic {campaign}", unit="set"):
        result = genetic_study.study_set(
            measurements,
            tied,
            identifiable,
            name,
            patterns,
            settings,
            config["genetic"]["seeds"],
            config["seed"],
            (campaign,),
            config["calibration"]["use_near_singularity"],
        )
        if result is not None:
            results.append(result)
    runs, history, timings = (pd.concat(parts, ignore_index=True) for parts in zip(*results, strict=True))
    compared = genetic_study.against_least_squares(
        runs,
        tables.read(inputs["calibrations"]),
        tables.read(inputs["parameters"]),
        study.true_errors(config, campaign),
    )
    # robots have different parameters, the table has those of all
    runs = runs.reindex(columns=[name for name in tables.columns("genetic") if name != "campaign"])
    for name, frame in (
        ("genetic", runs),
        ("genetic_history", history),
        ("genetic_against_least_squares", compared),
        ("timings", timings),
    ):
        tables.write(name, frame.assign(campaign=campaign), outputs[name])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.wildcards.campaign, snakemake.input, snakemake.output)
