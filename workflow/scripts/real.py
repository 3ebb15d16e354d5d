"""One data set of a real robot: its series calibrated, diagnosed and judged on rows that no fit has seen."""

from pathlib import Path

import numpy as np
import pandas as pd

from rrru.figures.drawing import draw_all
from rrru.gap.settings import GapSettings
from rrru.store import tables
from rrru.store.job import run, tell
from rrru.studies.real import arm_tables, arms, belts, cables
from rrru.studies.real.carry import carried
from rrru.studies.real.schemas import TABLES
from rrru.studies.real.series import found, missing

# machines of which only lengths are known, by kind
_LENGTHS = {"belts": belts.study, "cables": cables.study}


def main(settings, inputs, outputs):
    """Write the tables of a data set, empty where its files are not here, and draw a page of each series."""
    name, real = settings["set"], settings["real"]
    series = found(real, name)
    if not series:
        tell(missing(real, name))
    kind = real["sets"][name].get("kind")
    made = _lengths(series, _LENGTHS[kind]) if kind else _arms(series, settings, Path(outputs["real_verdicts"]).parent)
    frames = {}
    for table in TABLES:
        parts = [part[table.name] for part in made if table.name in part and len(part[table.name])]
        whole = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()
        frames[table.name] = whole.reindex(columns=table.names)
    tables.write_all(TABLES, frames, outputs)
    draw_all(settings["figures"], {key: outputs[key] for key in frames}, {"set": name}, outputs)


def _arms(series, settings, folder):
    """Tables of the series of an arm, and of what carries from one to another."""
    chosen = GapSettings.from_config(settings["gap"] | settings["real"]["gap"], settings["seed"])
    # all are read before the first is studied: what is refused is refused at once
    known = [arms.prepared(one, settings["robots"], folder / f"{one.name}_sheet.parquet") for one in series]
    studied = [arms.studied(one, chosen) for one in known]
    made = [_called(arm_tables.tables(one), one.series.name) for one in studied]
    return [*made, {"real_carried": carried(studied)}]


def _lengths(series, study):
    """Tables of the series of a machine of which lengths are known."""
    made = []
    for one in series:
        frames = study(one.read(), dict(one.section) | {"files": str(one.file)}, one.dataset)
        told = {"dataset": one.dataset, "robot": one.dataset, "source": one.file.name}
        numbers = np.arange(1, len(frames["real_steps"]) + 1)
        frames["real_verdicts"] = frames["real_verdicts"].assign(**told)
        frames["real_steps"] = frames["real_steps"].assign(number=numbers)
        frames["real_parameters"] = frames["real_parameters"].assign(effect="calibration")
        made.append(_called(frames, one.name))
    return made


def _called(frames, campaign):
    """Tables with the campaign's name."""
    return {name: frame.assign(campaign=campaign) for name, frame in frames.items()}


if __name__ == "__main__":
    run(main, snakemake)
