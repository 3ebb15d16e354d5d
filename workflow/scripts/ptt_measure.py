"""Measurements of paper B's experiments."""

from rrru.campaign.schemas import TABLES
from rrru.store import tables
from rrru.store.job import run
from rrru.studies.ptt3.bench import widths_mm
from rrru.studies.ptt3.experiments import experiment, joined


def main(settings, inputs, outputs):
    """Write what the tracker sees in every experiment, and joint experiments as one campaign."""
    backlash, measured, section = tables.read(inputs["backlash"]), {}, settings["ptt"]
    for name, own in section["experiments"].items():
        measured[name], _ = experiment(settings, name, widths_mm(backlash, own["payload_kg"])).campaign.run()
    for name, members in section["joint"].items():
        measured[name] = joined([measured[member] for member in members], section["motion"]["dwell_s"])
    for name, frame in measured.items():
        tables.write_all(TABLES, {"slider_measurements": frame}, {"slider_measurements": outputs[name]})


if __name__ == "__main__":
    run(main, snakemake)
