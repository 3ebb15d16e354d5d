"""The genetic algorithm with the chosen settings on all calibration sets of a campaign, compared with least squares."""

import pandas as pd
from tqdm import tqdm

from rrru.calibration.campaign_fit import select
from rrru.campaign.measurements import at_tool
from rrru.genetic.campaign_runs import Runs, against_least_squares, study_set
from rrru.genetic.schemas import TABLES
from rrru.genetic.settings import GeneticSettings
from rrru.robots.catalogue import searched_set
from rrru.store import tables
from rrru.store.job import run
from rrru.studies import setup


def main(settings, inputs, outputs):
    """Write the campaign's runs, their history, the comparison with least squares and the times."""
    searched = searched_set(settings["nominal"]["name"])
    frames = _runs(settings, inputs, searched) if searched else _nothing(outputs)
    frames = {table: frame.assign(campaign=settings["campaign"]) for table, frame in frames.items()}
    tables.write_all(TABLES, frames, outputs)


def _runs(settings, inputs, searched):
    """Frames by table of all runs; searched: the searched set of parameters."""
    genetic, name, nominal = settings["genetic"], settings["campaign"], settings["nominal"]
    calibration = settings["calibration"]
    # its objective uses positions of the tool only, in the robot's frame
    measurements = at_tool(tables.read(inputs["measurements"]), setup.mechanism(nominal))
    robots = [setup.measured_robot(nominal | {"registered": False}, measurements, one) for one in (searched, None)]
    runs = Runs(GeneticSettings.from_config(genetic), genetic["seeds"], settings["seed"], (name,))
    results = []
    for label, patterns in tqdm(calibration["sets"].items(), desc=f"genetic {name}", unit="set"):
        wide, identified = (
            select(measurements, robot, patterns, calibration["use_near_singularity"]) for robot in robots
        )
        if wide is not None:
            results.append(study_set(wide, identified, label, runs))
    frames = {table: pd.concat([part[table] for part in results], ignore_index=True) for table in results[0]}
    truth = setup.true_deviations(robots[1], settings["truth"])
    fits = (tables.read(inputs[table]) for table in ("calibrations", "parameters"))
    compared = against_least_squares(frames["genetic"], frames["genetic_parameters"], *fits, truth)
    return frames | {"genetic_against_least_squares": compared}


def _nothing(names):
    """Empty frames of the tables of these names, for a robot without an objective fast enough."""
    return {table.name: pd.DataFrame(columns=table.names) for table in TABLES if table.name in names}


if __name__ == "__main__":
    run(main, snakemake)
