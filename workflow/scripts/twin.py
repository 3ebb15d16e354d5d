"""Search for the twin: one virtual robot and one spiral as near to the paper's numbers as they can be."""

import logging
from pathlib import Path

import yaml

from rrru.store.job import job
from rrru.studies import setup as study
from rrru.studies.rrru3 import twin, twin_search


def main(config, output, workers):
    """Write the twin as an overlay of the configuration."""
    section, reproduce = config["twin"], config["reproduce"]
    campaign = study.virtual_campaign(config, reproduce["campaign"])
    count = len(campaign.plan.targets())
    draws = tuple(twin_search.draw(campaign.generator(name), count) for name in ("measure", "closed_loop"))
    found, misfit = twin_search.search(
        study.mechanism(config, reproduce["campaign"]),
        campaign.noise_mm,
        draws,
        reproduce["line_calibration"],
        section["seed"],
        section["generations"],
        section["population"],
        twin.from_config(config, reproduce["campaign"]) if section["refine"] else None,
        workers,
        lambda intermediate_result: logging.info(
            "generation %d: misfit %.3f", intermediate_result.nit, intermediate_result.fun
        ),
    )
    logging.info("misfit %.3f", misfit)
    partial = Path(f"{output}.partial")
    partial.write_text(f"# misfit {misfit:.3f}\n" + yaml.safe_dump(twin.overlay(found), sort_keys=False))
    partial.replace(output)


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.output[0], snakemake.threads)
