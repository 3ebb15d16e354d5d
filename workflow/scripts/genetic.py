"""The genetic algorithm with the chosen settings on every calibration set of one campaign, beside least squares."""

import pandas as pd
from tqdm import tqdm

from rrru.genetic import campaign_runs
from rrru.genetic.schemas import TABLES
from rrru.genetic.settings import GeneticSettings
from rrru.store import tables
from rrru.store.job import run
from rrru.studies import setup


def main(settings, inputs, outputs):
    """Write the campaign's runs, their history, the comparison with least squares and the times."""
    measurements = tables.read(inputs["measurements"])
    name, nominal, calibration = settings["campaign"], settings["nominal"], settings["calibration"]
    tied, identifiable = setup.mechanism(nominal, "tied"), setup.mechanism(nominal)
    results = []
    for label, patterns in tqdm(calibration["sets"].items(), desc=f"genetic {name}", unit="set"):
        result = campaign_runs.study_set(
            measurements,
            tied,
            identifiable,
            label,
            patterns,
            GeneticSettings.from_config(settings["genetic"]),
            settings["genetic"]["seeds"],
            settings["seed"],
            (name,),
            calibration["use_near_singularity"],
        )
        if result is not None:
            results.append(result)
    runs, history, timings = (pd.concat(parts, ignore_index=True) for parts in zip(*results, strict=True))
    truth = setup.true_deviations(nominal, settings["virtual"])
    fits = (tables.read(inputs[table]) for table in ("calibrations", "parameters"))
    compared = campaign_runs.against_least_squares(runs, *fits, truth)
    # robots have different parameters, the table has those of all
    names = next(table.names for table in TABLES if table.name == "genetic")
    frames = {
        "genetic": runs.reindex(columns=[column for column in names if column != "campaign"]),
        "genetic_history": history,
        "genetic_against_least_squares": compared,
        "timings": timings,
    }
    tables.write_all(TABLES, {key: frame.assign(campaign=name) for key, frame in frames.items()}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
