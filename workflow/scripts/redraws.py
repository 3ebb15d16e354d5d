"""Results of the reproduced robot for other draws of non-repeatability and noise, and the searched numbers."""

import pandas as pd

from rrru.pipeline import setup
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.rrru3 import redraw, twin
from rrru.studies.rrru3.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the draws, the counts over them and the searched numbers; empty for a measured campaign."""
    reproduce, calibration, virtual = (settings[key] for key in ("reproduce", "calibration", "virtual"))
    patterns = [settings["sets"][reproduce[f"{kind}_calibration"]] for kind in ("line", "spiral")]
    count, near = reproduce["redraws"] if virtual else 0, calibration["use_near_singularity"]
    campaign = setup.virtual_campaign(settings["nominal"], virtual) if virtual else None
    chosen = redraw.others(campaign, count) if campaign else []
    drawn = redraw.draws(campaign, patterns, reproduce["method"], chosen, near)
    found = redraw.redraws(drawn)
    commands = campaign.plan.commands(campaign.robot.mechanism) if campaign else pd.DataFrame(columns=redraw.PLACE)
    frames = {
        "redraws": found,
        "redraw_counts": redraw.redraw_counts(found),
        "redraw_errors": redraw.redraw_errors(drawn, commands),
        "twin_numbers": twin.numbers(virtual or {"trajectories": {}}),
    }
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
