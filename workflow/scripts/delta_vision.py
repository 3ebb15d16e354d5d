"""From the Delta's images to optical centres: the camera is calibrated, dots are found, poses fitted."""

import time

import numpy as np
import pandas as pd

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.delta import fits
from rrru.studies.delta import twin as robot


def main(config, images, outputs):
    """Write centres, dots, the first image, the camera's numbers, and the time of one calibration with the paper's
    poses.
    """
    section = config["delta"]
    with np.load(images) as taken:
        tilted, poses = taken["tilted"], taken["poses"]
    paper = robot.pose_commands(section)[0] == "first"
    started = [time.perf_counter()]
    model = fits.calibrate_camera(tilted, section)
    started.append(time.perf_counter())
    centres, _ = fits.find_centres(poses[paper], model, section)
    started.append(time.perf_counter())
    fits.paper_fit(robot.twin(config).mechanism, centres)
    started.append(time.perf_counter())
    timings = pd.DataFrame(
        {
            "step": ["camera", "centres", "zero_errors"],
            "images": [len(tilted), int(paper.sum()), 0],
            "seconds": np.diff(started),
        }
    )
    centres, dots = fits.find_centres(poses, model, section)
    y, x = (axis.ravel() for axis in np.indices(poses[0].shape))
    frames = {
        "delta_centres": centres,
        "delta_dots": dots,
        "delta_picture": pd.DataFrame({"y_px": y, "x_px": x, "grey": poses[0].ravel()}),
        "delta_lens": fits.camera_numbers(model),
        "delta_timings": timings,
    }
    for name, frame in frames.items():
        tables.write(name, frame, outputs[name])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.input["images"], snakemake.output)
