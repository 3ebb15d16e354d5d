"""Results of the reproduced robot for other draws of non-repeatability and noise, and the searched numbers."""

from rrru.pipeline import setup
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.rrru3 import twin
from rrru.studies.rrru3.redraw import redraw_counts, redraws
from rrru.studies.rrru3.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the draws, the counts over them and the searched numbers; empty for a measured campaign."""
    reproduce, calibration, virtual = (settings[key] for key in ("reproduce", "calibration", "virtual"))
    patterns = [settings["sets"][reproduce[f"{kind}_calibration"]] for kind in ("line", "spiral")]
    count, near = reproduce["redraws"] if virtual else 0, calibration["use_near_singularity"]
    campaign = setup.virtual_campaign(settings["nominal"], virtual) if virtual else None
    found = redraws(campaign, patterns, reproduce["method"], count, near)
    frames = {"redraws": found, "redraw_counts": redraw_counts(found)}
    tables.write_all(TABLES, frames | {"twin_numbers": twin.numbers(virtual or {"trajectories": {}})}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
