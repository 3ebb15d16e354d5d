"""Search for the twin: the virtual robot and spiral nearest to the paper's numbers."""

import logging

from rrru.pipeline import setup
from rrru.store import overlay
from rrru.store.job import run
from rrru.studies.rrru3 import twin, twin_search


def main(settings, inputs, outputs):
    """Write the twin as an overlay of the configuration."""
    virtual, section = settings["virtual"], settings["twin"]
    campaign = setup.virtual_campaign(settings["nominal"], virtual)
    # other draws than those of `redraws`
    pairs = [
        [campaign.generator("twin", number, name) for name in ("measure", "closed_loop")]
        for number in range(section["draws"])
    ]
    task = twin_search.Task(
        setup.mechanism(settings["nominal"]),
        virtual["motion"],
        virtual["trajectories"],
        campaign.noise_mm,
        twin_search.draw(pairs, len(campaign.plan.targets())),
        settings["reproduce"]["line_calibration"],
    )
    start = twin.from_config(virtual) if section["refine"] else None
    best, misfit = twin_search.search(task, section, start, settings["workers"], _log)
    overlay.write(twin.overlay(best), misfit, outputs["twin"])


def _log(intermediate_result):
    """Log the progress of a generation."""
    logging.info("generation %d: misfit %.3f", intermediate_result.nit, intermediate_result.fun)


if __name__ == "__main__":
    run(main, snakemake)
