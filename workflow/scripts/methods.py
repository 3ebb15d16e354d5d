"""Every method on one robot."""

import numpy as np

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.delta.twin import pose_commands
from rrru.studies.methods import benches, compare


def main(config, robot, inputs, outputs):
    """Write the robot's rows of the comparison, of its learning curves and of the computing times."""
    bench = benches.bench(config, robot)
    offsets = _from_images(config, bench, tables.read(inputs["calibrations"])) if inputs.get("calibrations") else None
    methods, curve, timings = compare.compare(bench, config, offsets)
    for name, frame in (("methods", methods), ("method_points", curve), ("method_timings", timings)):
        tables.write(name, frame.assign(robot=robot), outputs[name])


def _from_images(config, bench, calibrations):
    """What the Delta's study found from its images by the paper's way, and the time of its poses."""
    found = calibrations.set_index("variant").loc["paper"]
    planes, poses = pose_commands(config["delta"])
    return {
        "dtheta_rad": np.array([found[f"dtheta{leg}_found_rad"] for leg in (1, 2, 3)]),
        "poses": int(found["poses"]),
        "measuring_time_s": compare.measuring_time_s(bench, poses[planes == "first"]),
    }


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.wildcards.robot, dict(snakemake.input.items()), snakemake.output)
