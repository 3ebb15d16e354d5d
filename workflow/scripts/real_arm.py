"""One data set of real arms: the tables of its series, and the transfer of models between series."""

import json
from pathlib import Path

import pandas as pd

from rrru.diagnosis.settings import GapSettings
from rrru.figures.drawing import draw_all, requests
from rrru.store import tables
from rrru.store.job import run, tell
from rrru.studies.real.carry import carried, model
from rrru.studies.real.schemas import TABLES
from rrru.studies.real.series import found, missing


def main(settings, inputs, outputs):
    """Write the tables of a data set, empty where its files are missing, and draw a page of its series."""
    name = settings["set"]
    series = found(settings["real"], name)
    if not series:
        tell(missing(settings["real"], name))
    frames = {}
    for table in TABLES:
        parts = [tables.read(part) for part in inputs.get(table.name, ())]
        whole = [part for part in parts if len(part)]
        frames[table.name] = pd.concat(whole, ignore_index=True) if whole else pd.DataFrame(columns=table.names)
    frames["real_carried"] = _carried(series, settings, inputs)
    tables.write_all(TABLES, frames, outputs)
    draw_all(requests(settings["figures"], {key: outputs[key] for key in frames}, {"set": name}, outputs))


def _carried(series, settings, inputs):
    """Rows of `real_carried` of the usable series."""
    parts = zip(series, inputs.get("model", ()), inputs.get("measurements", ()), strict=True)
    known = [(one, json.loads(Path(numbers).read_text()), seen) for one, numbers, seen in parts]
    known = [one for one in known if one[1] is not None]
    if len(known) < 2:
        return carried(())
    chosen = GapSettings.from_config(settings["gap"] | settings["real"]["gap"], settings["seed"])
    robots = settings["robots"]
    return carried([model(one, numbers, pd.read_parquet(seen), robots, chosen) for one, numbers, seen in known])


if __name__ == "__main__":
    run(main, snakemake)
