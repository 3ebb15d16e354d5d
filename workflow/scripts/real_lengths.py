"""One data set of machines with measured lengths only: their frame, and the effects in their lengths."""

import pandas as pd

from rrru.errors import RrruError
from rrru.figures.drawing import draw_all, requests
from rrru.store import tables
from rrru.store.job import run, tell
from rrru.studies.real import belts, cables
from rrru.studies.real.schemas import TABLES
from rrru.studies.real.series import found, missing, named, refused

_STUDIES = {"belts": belts.study, "cables": cables.study}


def main(settings, inputs, outputs):
    """Write the tables of a data set, empty where its files are missing, and draw a page of its series."""
    name, real = settings["set"], settings["real"]
    series, study = found(real, name), _STUDIES[real["sets"][name]["kind"]]
    if not series:
        tell(missing(real, name))
    made, frames = [_tables(one, study) for one in series], {}
    for table in TABLES:
        parts = [part[table.name] for part in made if table.name in part and len(part[table.name])]
        whole = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()
        frames[table.name] = whole.reindex(columns=table.names)
    tables.write_all(TABLES, frames, outputs)
    draw_all(requests(settings["figures"], {key: outputs[key] for key in frames}, {"set": name}, outputs))


def _tables(series, study):
    """Tables of one series by name, or for a refused one the row with the reason."""
    try:
        frames = study(series.read(), dict(series.section) | {"files": str(series.file)}, series.dataset)
    except RrruError as error:
        tell(f"{series.name}: left out: {error}")
        frames = refused(series, error)
    else:
        numbers = range(1, len(frames["real_steps"]) + 1)
        frames["real_verdicts"] = frames["real_verdicts"].assign(**named(series))
        frames["real_steps"] = frames["real_steps"].assign(number=numbers)
        frames["real_parameters"] = frames["real_parameters"].assign(effect="calibration")
    return {name: frame.assign(campaign=series.name) for name, frame in frames.items()}


if __name__ == "__main__":
    run(main, snakemake)
