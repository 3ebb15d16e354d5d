"""Search for the Delta's twin: one virtual robot as near to paper C's numbers as it can be."""

import logging
from pathlib import Path

import yaml

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.delta import draws
from rrru.studies.delta import robot_search as search
from rrru.studies.delta import twin as robot


def main(config, inputs, output):
    """Write the twin's errors as an overlay of the configuration."""
    twin = robot.twin(config)
    section, truth = config["delta"]["search"], tables.read(inputs["truth"])
    noise = draws.centre_noise_px(config, truth, tables.read(inputs["dots"]))
    found, misfit = search.search(
        twin, truth, draws.drawn_errors(config, truth, noise, section["draws"], "search"), section
    )
    logging.info("misfit %.4f", misfit)
    deviations = {name: round(value, 6) for name, value in twin.truth.parameters.mapping(found).items()}
    partial = Path(f"{output}.partial")
    partial.write_text(f"# misfit {misfit:.4f}\n" + yaml.safe_dump({"delta": {"errors": deviations}}, sort_keys=False))
    partial.replace(output)


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.input, snakemake.output[0])
