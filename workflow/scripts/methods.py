"""Every method on one robot."""

from rrru.campaign.measurements import vectors
from rrru.genetic.settings import GeneticSettings
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.methods.compare import compare, measuring_time_s
from rrru.studies.methods.learners import Candidates
from rrru.studies.methods.regions import trial
from rrru.studies.methods.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the robot's rows of the comparison, of its learning curves and of the computing times."""
    one, offsets = trial(settings), None
    if inputs.get("calibrations"):
        offsets = _from_images(one, tables.read(inputs["calibrations"]), tables.read(inputs["poses"]))
    network, genetic = Candidates(**settings["network"]), GeneticSettings.from_config(settings["genetic"])
    names = ("methods", "method_points", "method_timings")
    frames = dict(zip(names, compare(one, settings["points"], network, genetic, offsets), strict=True))
    tables.write_all(TABLES, {name: frame.assign(robot=one.name) for name, frame in frames.items()}, outputs)


def _from_images(one, calibrations, poses):
    """The estimate of the Delta's study from its images by the paper's method, and the time of its poses."""
    found = calibrations.set_index("variant").loc["paper"]
    return {
        "dtheta_rad": found[[f"dtheta{leg}_found_rad" for leg in (1, 2, 3)]].to_numpy(dtype=float),
        "poses": int(found["poses"]),
        "measuring_time_s": measuring_time_s(one, vectors(poses[poses["plane"] == "first"], "command")),
    }


if __name__ == "__main__":
    run(main, snakemake)
