"""The papers' numbers beside this study's, and the audit of their misprints."""

import pandas as pd

from rrru.genetic.campaign_runs import typical_parameters
from rrru.store import tables
from rrru.store.job import run
from rrru.studies import config as parts
from rrru.studies import setup
from rrru.studies.rrru3.audit import audit_table
from rrru.studies.rrru3.published import published_table
from rrru.studies.rrru3.redraw import spread
from rrru.studies.rrru3.schemas import TABLES
from rrru.studies.rrru3.sisters import spread_c, study_b, study_c


def main(settings, inputs, outputs):
    """Write both tables."""
    errors, calibrations, parameters, genetic, runs = (
        tables.read(inputs[name]) for name in ("errors", "calibrations", "parameters", "genetic", "sweep_runs")
    )
    config, reproduce = settings, settings["reproduce"]
    campaign = reproduce["campaign"]
    nominal, virtual = parts.nominal(config, campaign), parts.virtual(config, campaign)
    own = genetic[genetic["campaign"] == campaign]
    names = setup.mechanism(nominal).parameters.names
    typical = typical_parameters(own, (*names, "dR", "dr")).assign(campaign=campaign)
    others = {}
    if virtual:
        others = spread(
            setup.virtual_campaign(nominal, virtual), config["calibration"], reproduce, reproduce["redraws"]
        )
    parameters = pd.concat([parameters[typical.columns], typical], ignore_index=True)
    sisters = {
        "B": study_b(
            config,
            *(tables.read(inputs[name]) for name in ("ptt_benefit", "ptt_spread", "ptt_training", "ptt_repeatability")),
        ),
        "C": study_c(config, *(tables.read(inputs[name]) for name in ("delta_points", "delta_camera"))),
    }
    sister_spread = {"C": spread_c(tables.read(inputs["delta_draws"]))}
    frame = published_table(config, errors, calibrations, parameters, genetic, runs, others, sisters, sister_spread)
    tables.write_all(TABLES, {"published": frame, "audit": audit_table()}, outputs)


if __name__ == "__main__":
    run(main, snakemake)
