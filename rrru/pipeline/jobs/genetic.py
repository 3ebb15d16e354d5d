"""The genetic algorithm with the chosen settings on all calibration sets of a campaign, compared with least squares."""

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Any

import pandas as pd

from rrru.calibration.campaign_fit import select
from rrru.campaign.measurements import at_tool
from rrru.genetic.campaign_runs import Runs, against_least_squares, study_set
from rrru.genetic.schemas import TABLES
from rrru.genetic.settings import GeneticSettings
from rrru.pipeline import setup
from rrru.pipeline.jobs.outputs import GENETIC_TABLES
from rrru.robots.catalogue import searched_set
from rrru.store import tables

_WRITTEN = (*GENETIC_TABLES, "timings")


def main(settings: Mapping[str, Any], inputs: Mapping[str, str], outputs: Mapping[str, str]) -> None:
    """Write the campaign's runs, their history, the comparison with least squares and the times."""
    write(genetic(settings, {name: tables.read(path) for name, path in inputs.items()}), outputs)


def genetic(settings: Mapping[str, Any], read: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Frames by table name of all runs, empty ones where `genetic.campaigns` does not name the campaign.

    read: frames of `measurements`, `calibrations` and `parameters`.
    """
    campaign, searched = settings["campaign"], searched_set(settings["nominal"]["name"])
    if not searched or not any(fnmatchcase(campaign, pattern) for pattern in settings["genetic"]["campaigns"]):
        return {table.name: pd.DataFrame(columns=table.names) for table in TABLES if table.name in _WRITTEN}
    frames = _runs(settings, read, searched)
    return {table: frame.assign(campaign=campaign) for table, frame in frames.items()}


def write(frames: Mapping[str, pd.DataFrame], paths: Mapping[str, str]) -> None:
    """Write the frames of `genetic` to paths by table name."""
    tables.write_all(TABLES, frames, paths)


def _runs(settings: Mapping[str, Any], read: Mapping[str, pd.DataFrame], searched: str) -> dict[str, pd.DataFrame]:
    """Frames by table of all runs; searched: the searched set of parameters."""
    # loaded where the algorithm runs, for few campaigns
    from tqdm import tqdm

    genetic, name, nominal = settings["genetic"], settings["campaign"], settings["nominal"]
    calibration = settings["calibration"]
    # its objective uses positions of the tool only, in the robot's frame
    measurements = at_tool(read["measurements"], setup.mechanism(nominal))
    robots = [setup.measured_robot(nominal | {"registered": False}, measurements, one) for one in (searched, None)]
    runs = Runs(GeneticSettings.from_config(genetic), genetic["seeds"], settings["seed"], (name,))
    results = []
    for label, patterns in tqdm(calibration["sets"].items(), desc=f"genetic {name}", unit="set"):
        wide, identified = (
            select(measurements, robot, patterns, calibration["use_near_singularity"]) for robot in robots
        )
        if wide is not None and identified is not None:
            results.append(study_set(wide, identified, label, runs))
    frames = {table: pd.concat([part[table] for part in results], ignore_index=True) for table in results[0]}
    truth = setup.true_deviations(robots[1], settings["truth"])
    fits = read["calibrations"], read["parameters"]
    compared = against_least_squares(frames["genetic"], frames["genetic_parameters"], *fits, truth)
    return frames | {"genetic_against_least_squares": compared}
