"""The images that the Delta's camera takes, and where it truly was."""

import numpy as np

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.delta import views


def main(config, outputs):
    """Write both sets of images, and the truth apart from them."""
    truth = views.true_poses(config)
    np.savez_compressed(outputs["images"], tilted=views.tilted_images(config), poses=views.pose_images(config, truth))
    tables.write("delta_truth", truth, outputs["truth"])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.output)
