"""Diagnosis of one campaign's gap between the calibrated sim and what was measured."""

import pandas as pd

from rrru.gap.diagnose import diagnose
from rrru.gap.settings import GapSettings
from rrru.robots.dynamics import Masses
from rrru.robots.protocol import make_mechanism
from rrru.store import tables
from rrru.store.job import job


def main(campaign, measurements, outputs, params):
    """Write the verdict and everything behind it."""
    robot = dict(params.robot)
    result = diagnose(
        tables.read(measurements),
        make_mechanism(robot.pop("name"), robot),
        Masses(**params.masses),
        GapSettings.from_config(params.gap, params.seed),
        params.noise_mm,
        name=campaign,
        use_near_singularity=params.use_near_singularity,
    )
    frames = {"gap_verdicts": pd.DataFrame([result.verdict]), **result.tables}
    for name, output in outputs.items():
        frame = frames[name] if name == "gap_points" else frames[name].assign(campaign=campaign)
        tables.write(name, frame, output)


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(
            snakemake.wildcards.campaign, snakemake.input.measurements, dict(snakemake.output.items()), snakemake.params
        )
