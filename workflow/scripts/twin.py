"""Search for the twin: one virtual robot and one spiral as near to the paper's numbers as they can be."""

import logging

from rrru.store import overlay
from rrru.store.job import run
from rrru.studies import setup
from rrru.studies.rrru3 import twin, twin_search


def main(settings, inputs, outputs):
    """Write the twin as an overlay of the configuration."""
    section, nominal = settings["twin"], settings["nominal"]
    campaign = setup.virtual_campaign(nominal, settings["virtual"])
    count = len(campaign.plan.targets())
    draws = tuple(twin_search.draw(campaign.generator(name), count) for name in ("measure", "closed_loop"))
    best, misfit = twin_search.search(
        setup.mechanism(nominal),
        campaign.noise_mm,
        draws,
        settings["reproduce"]["line_calibration"],
        section["seed"],
        section["generations"],
        section["population"],
        twin.from_config(settings["virtual"]) if section["refine"] else None,
        settings["workers"],
        lambda intermediate_result: logging.info(
            "generation %d: misfit %.3f", intermediate_result.nit, intermediate_result.fun
        ),
    )
    overlay.write(twin.overlay(best), misfit, outputs["twin"])


if __name__ == "__main__":
    run(main, snakemake)
