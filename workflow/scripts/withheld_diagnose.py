"""The diagnosis of a chunk of robots, from their measurements alone."""

import pandas as pd

from rrru.gap.diagnose import diagnose
from rrru.gap.settings import GapSettings
from rrru.robots.dynamics import Masses
from rrru.robots.protocol import make_mechanism
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.withheld.schemas import TABLES
from rrru.studies.withheld.states import state_row

# the tracker's noise is known, as it is for the campaigns
_NOISE_MM = 0.02
_COLUMNS = ["effects", "probability", "leg", "gap_rms_mm", "noise_rms_mm", "share_closed"]


def main(settings, inputs, outputs):
    """Write verdicts and states of a chunk."""
    library, without = GapSettings.from_config(settings["gap"], settings["seed"]), settings["effect"]
    if without:
        library = library.without(without)
    mechanism = make_mechanism("rrru3", settings["robots"].get("rrru3", {}))
    verdicts, states = [], []
    for (robot, kind), rows in tables.read(inputs["withheld_measurements"]).groupby(["robot", "kind"], sort=True):
        points = rows.drop(columns=["robot", "kind"]).reset_index(drop=True)
        result = diagnose(points, mechanism, Masses(), library, noise_mm=_NOISE_MM, details=False, name=robot)
        told = {key: result.verdict[key] for key in _COLUMNS}
        verdicts.append(told | {"check": "effect" if without else "label", "robot": robot, "kind": kind})
        states.append(state_row(robot, result.calibrated_errors, result.state))
    frames = {"withheld_verdicts": pd.DataFrame(verdicts), "withheld_states": pd.DataFrame(states)}
    tables.write_all(TABLES, frames, outputs)


if __name__ == "__main__":
    run(main, snakemake)
