"""Kinematics, singularities, backlash and repeatability of paper B's robot, and the measurements of its experiments."""

from rrru.campaign.schemas import measurement_table
from rrru.robots.ptt3 import Ptt3
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.ptt3 import bench
from rrru.studies.ptt3.experiments import experiment, joined
from rrru.studies.ptt3.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the tables before the experiments, then the measurements of each experiment."""
    encoder, backlash = bench.backlash(settings)
    frames = {
        "ptt_kinematics": bench.kinematics(settings),
        "ptt_singularity": bench.singularity(settings),
        "ptt_encoder": encoder,
        "ptt_backlash": backlash,
        "ptt_repeatability": bench.repeatabilities(settings, backlash),
    }
    tables.write_all(TABLES, frames, outputs)
    for name, frame in _measured(settings, backlash).items():
        tables.write_all((measurement_table(Ptt3()),), {"measurements": frame}, {"measurements": outputs[name]})


def _measured(settings, backlash):
    """Measurements by experiment, and by name of experiments that are diagnosed together, as one campaign."""
    section, measured = settings["ptt"], {}
    for name, own in section["experiments"].items():
        widths = bench.widths_mm(backlash, own["payload_kg"])
        measured[name], _ = experiment(settings, name, widths).campaign.run()
    for name, members in section["joint"].items():
        measured[name] = joined([measured[member] for member in members], section["motion"]["dwell_s"])
    return measured


if __name__ == "__main__":
    run(main, snakemake)
