"""One series of a real arm: calibrated, diagnosed and evaluated on held-out rows, or refused with a reason."""

import json
from pathlib import Path

import pandas as pd

from rrru.diagnosis.settings import GapSettings
from rrru.errors import RrruError
from rrru.store import tables
from rrru.store.atomic_write import whole
from rrru.store.job import run, tell
from rrru.studies.real import arm_tables, arms
from rrru.studies.real.carry import saved_values
from rrru.studies.real.schemas import SERIES_TABLES
from rrru.studies.real.series import found, refused


def main(settings, inputs, outputs):
    """Write the tables of a series, its measurements, and in `model` the values that apply to other series."""
    series = next(one for one in found(settings["real"], settings["set"]) if one.name == settings["series"])
    chosen = GapSettings.from_config(settings["gap"] | settings["real"]["gap"], settings["seed"])
    try:
        studied = arms.study(series, settings["robots"], chosen, Path(outputs["model"]).with_name("sheet.parquet"))
        frames, measurements, model = arm_tables.tables(studied), studied.measurements, saved_values(studied)
    except RrruError as error:
        tell(f"{series.name}: left out: {error}")
        frames, measurements, model = refused(series, error), pd.DataFrame(), None
    frames = {one.name: frames.get(one.name, pd.DataFrame()) for one in SERIES_TABLES}
    frames = {
        one.name: frames[one.name].assign(campaign=series.name).reindex(columns=one.names) for one in SERIES_TABLES
    }
    tables.write_all(SERIES_TABLES, frames, outputs)
    with whole(outputs["measurements"], outputs["model"]) as (table, text):
        measurements.to_parquet(table, index=False)
        text.write_text(json.dumps(model))


if __name__ == "__main__":
    run(main, snakemake)
