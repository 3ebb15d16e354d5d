"""Measurements of paper B's experiments."""

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.ptt3 import bench
from rrru.studies.ptt3 import experiments as robot


def main(config, backlash, outputs):
    """Write what the tracker sees in every experiment, and the experiments that are diagnosed together as one
    campaign.
    """
    backlash, measured = tables.read(backlash), {}
    for name in config["ptt"]["experiments"]:
        one = robot.experiment(config, name)
        measured[name] = one.run(bench.widths_mm(backlash, one.payload_kg), one.generator("measure"))
    for name, members in config["ptt"]["joint"].items():
        measured[name] = robot.joined([measured[member] for member in members], config["ptt"]["motion"]["dwell_s"])
    for name, frame in measured.items():
        tables.write("slider_measurements", frame, outputs[name])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.input["backlash"], snakemake.output)
