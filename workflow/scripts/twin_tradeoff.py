"""What keeps the configured twin from printed numbers: the search again, with these numbers weighing more."""

from rrru.pipeline import setup
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.rrru3 import twin, twin_comparisons, twin_search
from rrru.studies.rrru3.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the trade-offs."""
    virtual, section = settings["virtual"], settings["twin"]
    campaign = setup.virtual_campaign(settings["nominal"], virtual)
    calibration = settings["reproduce"]["line_calibration"]
    task = twin_search.make_task(campaign, virtual, section["draws"], calibration, tuple(section["more"]))
    fresh = twin_search.redrawn(campaign, section["hypotheses"]["draws"])
    start = twin.from_config(virtual)
    frame = twin_comparisons.tradeoff(task, fresh, section, start, settings["workers"], settings["state"])
    tables.write_all(TABLES, {"twin_tradeoff": frame}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
