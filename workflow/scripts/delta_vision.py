"""From the Delta's images to optical centres: the camera is calibrated, dots are found, poses fitted."""

import time

import numpy as np
import pandas as pd

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.delta import fits, twin
from rrru.studies.delta.schemas import TABLES


def main(settings, inputs, outputs):
    """Write centres, dots, the first image, the camera's numbers, and the time of one calibration with 20 poses."""
    section = settings["delta"]
    with np.load(inputs["images"]) as taken:
        tilted, poses = taken["tilted"], taken["poses"]
    paper = twin.pose_commands(section)[0] == "first"
    started = [time.perf_counter()]
    model = fits.calibrate_camera(tilted, section)
    started.append(time.perf_counter())
    centres, _ = fits.find_centres(poses[paper], model, section)
    started.append(time.perf_counter())
    fits.paper_fit(twin.twin(settings).mechanism, centres)
    started.append(time.perf_counter())
    steps = {"step": ["camera", "centres", "zero_errors"], "images": [len(tilted), int(paper.sum()), 0]}
    centres, dots = fits.find_centres(poses, model, section)
    y, x = (axis.ravel() for axis in np.indices(poses[0].shape))
    frames = {
        "delta_centres": centres,
        "delta_dots": dots,
        "delta_picture": pd.DataFrame({"y_px": y, "x_px": x, "grey": poses[0].ravel()}),
        "delta_lens": fits.camera_numbers(model),
        "delta_timings": pd.DataFrame({**steps, "seconds": np.diff(started)}),
    }
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
