"""Hypotheses about the paper's campaign, each searched with the same number of evaluations."""

from rrru.pipeline import setup
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.rrru3 import twin, twin_comparisons, twin_search
from rrru.studies.rrru3.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the comparison."""
    virtual, section = settings["virtual"], settings["twin"]
    campaign = setup.virtual_campaign(settings["nominal"], virtual)
    task = twin_search.make_task(campaign, virtual, section["draws"], twin_comparisons.LINE_CALIBRATION)
    fresh = twin_search.redrawn(campaign, section["hypotheses"]["draws"])
    start = twin.from_config(virtual)
    frame = twin_comparisons.compare(task, fresh, section, start, settings["workers"], settings["state"])
    tables.write_all(TABLES, {"twin_hypotheses": frame}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
