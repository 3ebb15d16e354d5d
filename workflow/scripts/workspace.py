"""Slices of the reachable workspace with both singularity measures."""

import pandas as pd

from rrru import study
from rrru.campaign import measurements as rows
from rrru.mechanisms import workspace
from rrru.report import tables
from rrru.report.job import job

_STEP_MM = 10.0
_RANGE_MM = {"x": (-1000.0, 1000.0), "y": (-1000.0, 1000.0), "z": (0.0, 1300.0)}


def main(config, campaign, inputs, output):
    """Write the vertical slice y = 0 and the horizontal one through the middle of the commanded points."""
    mechanism = study.mechanism(config, campaign)
    height = float(rows.command(tables.read(inputs["measurements"]))[:, 2].mean().round(-1))
    frames = []
    for plane, at in (("xz", 0.0), ("xy", height)):
        points = workspace.slice_points(plane, at, _RANGE_MM[plane[0]], _RANGE_MM[plane[1]], _STEP_MM)
        reachable, translational, constraint, determinant = workspace.measures(mechanism, points)
        frames.append(
            pd.DataFrame(
                {
                    "campaign": campaign,
                    "slice": plane,
                    **{f"{axis}_mm": points[:, k] for k, axis in enumerate("xyz")},
                    "reachable": reachable,
                    "translational_measure": translational,
                    "constraint_measure": constraint,
                    "constraint_determinant": determinant,
                }
            )
        )
    tables.write("workspace", pd.concat(frames, ignore_index=True), output)


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.wildcards.campaign, snakemake.input, snakemake.output[0])
