"""A robot's file, its calibration and its corrected file on a held-out campaign."""

from rrru.calibration.campaign_fit import deviation_vector
from rrru.kinematics.dynamics import Masses
from rrru.pipeline import setup
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.end_to_end.models import errors, sizes
from rrru.studies.end_to_end.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the errors of each model on the new campaign."""
    section, nominal = settings["circle"], settings["nominal"]
    robot = setup.measured_robot(nominal, tables.read(inputs["measurements"]))
    deviations = deviation_vector(tables.read(inputs["parameters"]), section["calibration"], "least_squares", robot)
    verdict, info = (tables.read(inputs[name]).iloc[0] for name in ("gap_verdicts", "campaigns"))
    masses = Masses(**settings["masses"])
    points = errors(tables.read(inputs["fresh"]), nominal, masses, (robot, deviations), inputs["corrected"])
    whole = sizes(points, verdict["effects"], info["noise_mm"])
    frames = {"circle_points": points, "circle": whole.assign(diagnosed=section["diagnosed"], fresh=section["fresh"])}
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
