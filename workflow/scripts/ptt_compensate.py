"""What the experiments of paper B teach, and the robot driven again with it."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.ptt3 import bench, redraws, results
from rrru.studies.ptt3 import controllers as methods
from rrru.studies.ptt3 import experiments as robot
from rrru.studies.ptt3.driving import driven
from rrru.studies.ptt3.extrapolation import extrapolations


def main(config, backlash, measurements, outputs):
    """Write networks, corrections, errors and benefits of every experiment, on the curve and away from it.

    measurements: path of an experiment's table by its name.
    """
    backlash, parts = tables.read(backlash), {name: [] for name in outputs}
    for name, path in measurements.items():
        one = robot.experiment(config, name)
        widths = bench.widths_mm(backlash, one.payload_kg)
        for table, frame in _frames(config, one, widths, tables.read(path)).items():
            parts[table].append(frame.assign(experiment=name))
    for table, frames in parts.items():
        tables.write(table, pd.concat(frames, ignore_index=True), outputs[table])


def _frames(config, one, widths, measurements):
    """Tables of one experiment by name, without its name."""
    learned = methods.learning(config, one, robot.point_means(config, measurements))
    controllers = learned.controllers()
    after = driven(config, one, widths, controllers)
    training = results.trainings(learned)
    return {
        "ptt_points": results.points(learned, after["rbf_inverse"]),
        "ptt_benefit": redraws.with_ranges(config, one, widths, results.benefits(learned, after)),
        "ptt_start": redraws.starts(config, one.name, widths),
        "ptt_training": training,
        "ptt_spread": results.spreads(learned, training),
        "ptt_corrections": results.corrections(learned),
        "ptt_extrapolation": extrapolations(config, one, widths, controllers),
    }


if __name__ == "__main__":
    with job(snakemake.log[0]):
        paths = {name: snakemake.input[name] for name in snakemake.config["ptt"]["experiments"]}
        main(snakemake.config, snakemake.input["backlash"], paths, dict(snakemake.output.items()))
