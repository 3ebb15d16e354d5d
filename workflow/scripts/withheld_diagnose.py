"""The diagnosis of a chunk of robots, from their measurements alone."""

import pandas as pd

from rrru.gap.diagnose import diagnose
from rrru.gap.settings import GapSettings
from rrru.robots.dynamics import Masses
from rrru.robots.protocol import make_mechanism
from rrru.store import tables
from rrru.store.job import job
from rrru.studies.withheld.states import state_row

# the tracker's noise is known, as it is for the campaigns
_NOISE_MM = 0.02
_COLUMNS = ["effects", "probability", "leg", "gap_rms_mm", "noise_rms_mm", "share_closed"]


def main(config, without, inputs, outputs):
    """Write verdicts and states of a chunk; without: the effect that the library has to do without, empty for none."""
    settings = GapSettings.from_config(config["gap"], config["seed"])
    if without:
        settings = settings.without(without)
    mechanism = make_mechanism("rrru3", config["robots"].get("rrru3", {}))
    verdicts, states = [], []
    for (robot, kind), rows in tables.read(inputs["measurements"]).groupby(["robot", "kind"], sort=True):
        points = rows[tables.columns("measurements")].reset_index(drop=True)
        result = diagnose(points, mechanism, Masses(), settings, noise_mm=_NOISE_MM, details=False, name=robot)
        told = {key: result.verdict[key] for key in _COLUMNS}
        verdicts.append(told | {"check": "effect" if without else "label", "robot": robot, "kind": kind})
        states.append(state_row(robot, result.calibrated_errors, result.state))
    tables.write("withheld_verdicts", pd.DataFrame(verdicts), outputs["verdicts"])
    tables.write("withheld_states", pd.DataFrame(states), outputs["states"])


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.config, snakemake.params.without, snakemake.input, snakemake.output)
