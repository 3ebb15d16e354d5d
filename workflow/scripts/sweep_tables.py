"""All runs of the sweeps, and whether a setting's effect is distinguishable from the seeds' scatter."""

import pandas as pd

from rrru.genetic.schemas import TABLES
from rrru.genetic.sweep import setting_effect, setting_pairs
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.rrru3.schemas import TABLES as OWN_TABLES
from rrru.studies.rrru3.sweep_match import sweep_match


def main(settings, inputs, outputs):
    """Write the runs and their history, tests of their values, and interpretations compared with the printed tables."""
    frames = {
        name: pd.concat([tables.read(path) for path in inputs[name]], ignore_index=True)
        for name in ("sweep_runs", "sweep_history", "sweep_parameters")
    }
    runs = frames["sweep_runs"]
    frames |= {"sweep_effect": setting_effect(runs), "sweep_pairs": setting_pairs(runs, settings["seed"])}
    frames["sweep_match"] = sweep_match(runs, settings["seed"])
    tables.write_all((*TABLES, *OWN_TABLES), frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
