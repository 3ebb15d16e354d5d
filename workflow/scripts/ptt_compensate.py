"""Learning from the experiments of paper B, and the robot driven again with the corrections."""

import pandas as pd

from rrru.store import tables
from rrru.store.job import run
from rrru.studies.ptt3 import driving, results
from rrru.studies.ptt3.bench import widths_mm
from rrru.studies.ptt3.experiments import experiment, point_means
from rrru.studies.ptt3.learning import METHODS, learning
from rrru.studies.ptt3.schemas import TABLES


def main(settings, inputs, outputs):
    """Write networks, corrections, errors and benefits of every experiment, on the curve and away from it."""
    backlash, parts = tables.read(inputs["backlash"]), {name: [] for name in outputs}
    for name, own in settings["ptt"]["experiments"].items():
        one = experiment(settings, name, widths_mm(backlash, own["payload_kg"]))
        for table, frame in _frames(settings["ptt"], one, tables.read(inputs[name])).items():
            parts[table].append(frame.assign(experiment=name))
    frames = {table: pd.concat(frames, ignore_index=True) for table, frames in parts.items()}
    tables.write_all(TABLES, frames, outputs)


def _frames(section, one, measurements):
    """Tables of one experiment by name, without its name."""
    learned = learning(one, point_means(one, measurements))
    after = driving.driven(driving.one_pass(one), learned, METHODS)
    training = results.trainings(learned)
    return {
        "ptt_points": results.points(learned, after["rbf_inverse"]),
        "ptt_benefit": driving.with_ranges(one, results.benefits(learned, after), section["redraws"]),
        "ptt_start": driving.starts(one, section["starts_deg"]),
        "ptt_training": training,
        "ptt_spread": results.spreads(learned, training),
        "ptt_corrections": results.corrections(learned),
        "ptt_extrapolation": driving.extrapolations(one, learned, section["extrapolation"]),
    }


if __name__ == "__main__":
    run(main, snakemake)
