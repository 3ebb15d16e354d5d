"""Linear-delta printers: what their owners measured, calibrated here and compared with what their firmware saved."""

import logging
import sys

from rrru.store import tables
from rrru.store.job import job
from rrru.studies.printers import printer_tables
from rrru.studies.printers import readings as printers


def main(file, settings, outputs):
    """Write the printers, their numbers, readings and possible causes; says which saved answers do not belong to their
    readings.
    """
    frames = printer_tables.tables(printers.read(file), settings)
    for name, frame in frames.items():
        tables.write(name, frame.reindex(columns=tables.columns(name)), outputs[name])
    for row in frames["printers"].itertuples():
        if row.reason:
            logging.warning("%s: %s: %s", row.printer, row.verdict, row.reason)
            print(f"{row.printer}: {row.verdict}: {row.reason}", file=sys.stderr)


if __name__ == "__main__":
    with job(snakemake.log[0]):
        main(snakemake.input[0], snakemake.params.settings, snakemake.output)
