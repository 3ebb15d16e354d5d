"""Every method on one robot."""

import numpy as np

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.delta.virtual_delta import Poses
from rrru.studies.methods import benches, compare
from rrru.studies.methods.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the robot's rows of the comparison, of its learning curves and of the computing times."""
    robot = settings["robot"]
    bench = benches.bench(settings, robot)
    offsets = _from_images(settings, bench, tables.read(inputs["calibrations"])) if inputs.get("calibrations") else None
    methods, curve, timings = compare.compare(bench, settings, offsets)
    frames = {"methods": methods, "method_points": curve, "method_timings": timings}
    tables.write_all(TABLES, {name: frame.assign(robot=robot) for name, frame in frames.items()}, outputs)


def _from_images(config, bench, calibrations):
    """What the Delta's study found from its images by the paper's way, and the time of its poses."""
    found = calibrations.set_index("variant").loc["paper"]
    planes, poses = Poses(**config["delta"]["poses"]).commands()
    return {
        "dtheta_rad": np.array([found[f"dtheta{leg}_found_rad"] for leg in (1, 2, 3)]),
        "poses": int(found["poses"]),
        "measuring_time_s": compare.measuring_time_s(bench, poses[planes == "first"]),
    }


if __name__ == "__main__":
    run(main, snakemake)
