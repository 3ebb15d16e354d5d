"""Search for the twin: the virtual robot and spiral nearest to the paper's numbers."""

from rrru.pipeline import setup
from rrru.store import overlay, tables
from rrru.store.job import run
from rrru.studies.rrru3 import twin, twin_restarts, twin_search
from rrru.studies.rrru3.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the twin as an overlay of the configuration, and the search's restarts and progress."""
    virtual, section = settings["virtual"], settings["twin"]
    campaign = setup.virtual_campaign(settings["nominal"], virtual)
    calibration = settings["reproduce"]["line_calibration"]
    task = twin_search.make_task(campaign, virtual, section["draws"], calibration, tuple(section["more"]))
    start = twin.from_config(virtual) if section["refine"] else None
    restarts, ended = twin_restarts.search(task, section, start, settings["workers"], settings["state"])
    best = twin_restarts.best(restarts)
    overlay.write(twin.overlay(best.twin), best.best, outputs["twin"])
    tables.write_all(TABLES, twin_restarts.tables(restarts, ended), outputs)


if __name__ == "__main__":
    run(main, snakemake)
