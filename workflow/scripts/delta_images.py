"""The images that the Delta's camera takes, and where it truly was."""

import numpy as np

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.delta import views
from rrru.studies.delta.schemas import TABLES


def main(settings, inputs, outputs):
    """Write both sets of images, and the truth apart from them."""
    truth = views.true_poses(settings)
    tilted, poses = views.tilted_images(settings), views.pose_images(settings, truth)
    np.savez_compressed(outputs["images"], tilted=tilted, poses=poses)
    tables.write_all(TABLES, {"delta_truth": truth}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
