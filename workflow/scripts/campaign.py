"""One campaign: driven by a virtual robot or read from a file."""

import logging
import sys

import pandas as pd

from rrru.store import tables
from rrru.store.job import job
from rrru.studies import setup as study


def main(config, campaign, outputs):
    """Write measurements, truth (empty for a file), singularity measures, workspace slices and the campaign's row."""
    ingested = None
    if study.is_virtual(config, campaign):
        measurements, truth = study.virtual_campaign(config, campaign).run()
    else:
        ingested = study.ingest_campaign(config, campaign)
        measurements, truth = ingested.measurements, pd.DataFrame(columns=tables.columns("truth"))
    margin = config["calibration"]["singularity_margin"]
    robot = study.mechanism(config, campaign)
    measurements, singular = study.with_singularities(robot, measurements, margin)
    kind = "measurements" if robot.drive_unit == "rad" else "slider_measurements"
    tables.write(kind, measurements, outputs["measurements"])
    tables.write("truth", truth[tables.columns("truth")], outputs["truth"])
    tables.write("singularity", singular.assign(campaign=campaign), outputs["singularity"])
    tables.write("workspace", study.workspace_table(config, campaign, measurements), outputs["workspace"])
    row = study.campaign_row(config, campaign, measurements, singular, ingested)
    if row["notes"].iloc[0]:
        logging.warning("campaign %s: %s", campaign, row["notes"].iloc[0])
        print(f"campaign {campaign}: {row['notes'].iloc[0]}", file=sys.stderr)
    tables.write("campaigns", row, outputs["campaigns"])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.wildcards.campaign, snakemake.output)
