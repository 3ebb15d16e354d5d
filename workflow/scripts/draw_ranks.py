"""Draws of the reproduced robot by how near they are to what the paper prints."""

from rrru.pipeline import setup
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.rrru3 import redraw
from rrru.studies.rrru3.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the ranks."""
    reproduce, near = settings["reproduce"], settings["calibration"]["use_near_singularity"]
    patterns = [settings["sets"][reproduce[f"{kind}_calibration"]] for kind in ("line", "spiral")]
    campaign = setup.virtual_campaign(settings["nominal"], settings["virtual"])
    drawn = redraw.draws(campaign, patterns, reproduce["method"], range(reproduce["ranked"]), near)
    tables.write_all(TABLES, {"draw_ranks": redraw.draw_ranks(drawn)}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
