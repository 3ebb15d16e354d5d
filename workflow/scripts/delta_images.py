"""The images of the Delta's camera, and its true poses."""

import numpy as np

from rrru.store import tables
from rrru.store.atomic_write import whole
from rrru.store.job import run
from rrru.studies.delta import views
from rrru.studies.delta.schemas import TABLES
from rrru.studies.delta.virtual_delta import twin


def main(settings, inputs, outputs):
    """Write both sets of images, and the truth separately."""
    view, truth = views.scene(settings), views.true_poses(settings)
    by_hand, mounted = (twin(settings).generator(f"{kind} images") for kind in ("tilted", "pose"))
    tilted = view.images(view.tilted_places(by_hand), by_hand)
    poses = view.images(view.pose_places(truth), mounted)
    with whole(outputs["images"]) as (partial,), partial.open("wb") as file:
        np.savez(file, tilted=tilted, poses=poses)
    tables.write_all(TABLES, {"delta_truth": truth}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
