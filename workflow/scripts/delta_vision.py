"""From the Delta's images to optical centres: the camera is calibrated, dots are found, poses fitted."""

import time

import numpy as np
import pandas as pd

from rrru.campaign.measurements import vectors
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.delta import centres
from rrru.studies.delta.schemas import TABLES
from rrru.studies.delta.variants import PAPER
from rrru.studies.delta.virtual_delta import Poses, twin
from rrru.studies.delta.vision import Lattice


def main(settings, inputs, outputs):
    """Write centres, dots, the first image, the camera's numbers, and the time of one calibration with 20 poses."""
    section = settings["delta"]
    lattice = Lattice(section["target"]["pitch_mm"], section["target"]["diameter_mm"])
    with np.load(inputs["images"]) as taken:
        tilted, poses = taken["tilted"], taken["poses"]
    planes, command = Poses(**section["poses"]).commands()
    first = planes == "first"
    started = [time.perf_counter()]
    model = centres.calibrate_camera(tilted, lattice)
    started.append(time.perf_counter())
    found, _ = centres.find_centres(poses[first], planes[first], command[first], model, lattice)
    started.append(time.perf_counter())
    PAPER.zero_errors(twin(settings).mechanism, command[first], vectors(found, "centre"))
    started.append(time.perf_counter())
    steps = {"step": ["camera", "centres", "zero_errors"], "images": [len(tilted), int(first.sum()), 0]}
    found, dots = centres.find_centres(poses, planes, command, model, lattice)
    y, x = (axis.ravel() for axis in np.indices(poses[0].shape))
    frames = {
        "delta_centres": found,
        "delta_dots": dots,
        "delta_picture": pd.DataFrame({"y_px": y, "x_px": x, "grey": poses[0].ravel()}),
        "delta_lens": centres.camera_numbers(model),
        "delta_timings": pd.DataFrame({**steps, "seconds": np.diff(started)}),
    }
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
