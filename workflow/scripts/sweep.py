"""All values and seeds of one swept setting of the genetic algorithm."""

import pandas as pd
from tqdm import tqdm

from rrru.calibration.campaign_fit import select
from rrru.errors import ConfigError
from rrru.genetic.schemas import TABLES
from rrru.genetic.settings import GeneticSettings
from rrru.genetic.sweep import run_sweep
from rrru.pipeline import setup
from rrru.store import tables
from rrru.store.job import run


def main(settings, inputs, outputs):
    """Write the runs and their history."""
    operators, parameter, population = (settings[key] for key in ("operators", "parameter", "population"))
    mechanism = setup.mechanism(settings["nominal"], "tied")
    measurements, patterns = tables.read(inputs["measurements"]), settings["patterns"]
    residuals = select(measurements, mechanism, patterns, settings["calibration"]["use_near_singularity"])
    if residuals is None:
        raise ConfigError(f"sweep: too few points on the trajectories {', '.join(patterns)}")
    own = {"operators": operators, "populations": settings["populations"]}
    genetic = GeneticSettings.from_config(settings["genetic"] | settings["sweep"], **own)
    swept = [
        run_sweep(
            residuals.mean_distance,
            mechanism.parameters,
            genetic,
            parameter,
            float(value),
            range(1, settings["reading"]["seeds"] + 1),
            settings["seed"],
        )
        for value in tqdm(settings["reading"]["values"], desc=f"{operators} {parameter} {population}", unit="value")
    ]
    frames = {name: pd.concat([part[name] for part in swept], ignore_index=True) for name in swept[0]}
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
