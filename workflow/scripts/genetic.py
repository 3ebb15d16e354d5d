"""The genetic algorithm with the chosen settings on every calibration set of one campaign, beside least squares."""

import pandas as pd
from tqdm import tqdm

from rrru.fit.campaign_fit import select
from rrru.genetic.campaign_runs import Runs, against_least_squares, study_set
from rrru.genetic.schemas import TABLES
from rrru.genetic.settings import GeneticSettings
from rrru.store import tables
from rrru.store.job import run
from rrru.studies import setup


def main(settings, inputs, outputs):
    """Write the campaign's runs, their history, the comparison with least squares and the times."""
    measurements = tables.read(inputs["measurements"])
    name, nominal, calibration = settings["campaign"], settings["nominal"], settings["calibration"]
    robots = setup.mechanism(nominal, "tied"), setup.mechanism(nominal)
    genetic = settings["genetic"]
    runs = Runs(GeneticSettings.from_config(genetic), genetic["seeds"], settings["seed"], (name,))
    results = []
    for label, patterns in tqdm(calibration["sets"].items(), desc=f"genetic {name}", unit="set"):
        searched, identified = (
            select(measurements, robot, patterns, calibration["use_near_singularity"]) for robot in robots
        )
        if searched is not None:
            results.append(study_set(searched, identified, label, runs))
    frames = {table: pd.concat([part[table] for part in results], ignore_index=True) for table in results[0]}
    truth = setup.true_deviations(nominal, settings["truth"])
    fits = (tables.read(inputs[table]) for table in ("calibrations", "parameters"))
    compared = against_least_squares(frames["genetic"], frames["genetic_parameters"], *fits, truth)
    frames["genetic_against_least_squares"] = compared
    tables.write_all(TABLES, {table: frame.assign(campaign=name) for table, frame in frames.items()}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
