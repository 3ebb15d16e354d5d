"""All seeds of one value of one swept setting."""

from tqdm import tqdm

from rrru.errors import ConfigError
from rrru.fit.campaign_fit import select
from rrru.genetic.campaign_runs import settings_from_config
from rrru.genetic.sweep import run_sweep
from rrru.store import tables
from rrru.store.job import job
from rrru.studies import setup as study


def main(config, parameter, population, value, inputs, outputs):
    """Write the runs and their history."""
    section, reproduce = config["sweep"], config["reproduce"]
    mechanism = study.mechanism(config, reproduce["campaign"], "tied")
    patterns = config["calibration"]["sets"][reproduce["line_calibration"]]
    residuals = select(
        tables.read(inputs["measurements"]), mechanism, patterns, config["calibration"]["use_near_singularity"]
    )
    if residuals is None:
        raise ConfigError(
            f"campaign {reproduce['campaign']} has too few points for the set {reproduce['line_calibration']}"
        )
    settings = settings_from_config(config["genetic"], populations=section["populations"][population])
    runs, history = run_sweep(
        residuals.mean_distance,
        mechanism.parameters.low,
        mechanism.parameters.high,
        settings,
        parameter,
        float(value),
        tqdm(range(1, section["seeds"] + 1), desc=f"{parameter} {value} {population}", unit="run"),
        mechanism.parameters.names,
        study_seed=config["seed"],
    )
    tables.write("sweep_runs", runs, outputs["sweep_runs"])
    tables.write("sweep_history", history, outputs["sweep_history"])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        names = snakemake.wildcards
        main(snakemake.config, names.parameter, names.population, names.value, snakemake.input, snakemake.output)
