"""What the experiments of paper B teach, and the robot driven again with it."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.ptt3 import bench, controllers, experiments, redraws, results
from rrru.studies.ptt3.driving import driven
from rrru.studies.ptt3.extrapolation import extrapolations
from rrru.studies.ptt3.schemas import TABLES


def main(settings, inputs, outputs):
    """Write networks, corrections, errors and benefits of every experiment, on the curve and away from it."""
    backlash, parts = tables.read(inputs["backlash"]), {name: [] for name in outputs}
    for name in settings["ptt"]["experiments"]:
        one = experiments.experiment(settings, name)
        widths = bench.widths_mm(backlash, one.payload_kg)
        for table, frame in _frames(settings, one, widths, tables.read(inputs[name])).items():
            parts[table].append(frame.assign(experiment=name))
    frames = {table: pd.concat(frames, ignore_index=True) for table, frames in parts.items()}
    tables.write_all(TABLES, frames, outputs)


def _frames(settings, one, widths, measurements):
    """Tables of one experiment by name, without its name."""
    learned = controllers.learning(settings, one, experiments.point_means(settings, measurements))
    controlled = learned.controllers()
    after = driven(settings, one, widths, controlled)
    training = results.trainings(learned)
    return {
        "ptt_points": results.points(learned, after["rbf_inverse"]),
        "ptt_benefit": redraws.with_ranges(settings, one, widths, results.benefits(learned, after)),
        "ptt_start": redraws.starts(settings, one.name, widths),
        "ptt_training": training,
        "ptt_spread": results.spreads(learned, training),
        "ptt_corrections": results.corrections(learned),
        "ptt_extrapolation": extrapolations(settings, one, widths, controlled),
    }


if __name__ == "__main__":
    run(main, snakemake)
