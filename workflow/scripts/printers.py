"""Linear-delta printers calibrated from their owners' measurements, and compared with their firmware's answers."""

from rrru.store import tables
from rrru.store.job import run, tell
from rrru.studies.printers import printer_tables
from rrru.studies.printers.files import read_all
from rrru.studies.printers.schemas import TABLES


def main(settings, inputs, outputs):
    """Write the tables of the printers; log saved answers that do not belong to their readings."""
    frames = printer_tables.tables(read_all(inputs["files"]), settings["printers"])
    columns = {table.name: table.names for table in TABLES}
    frames = {name: frame.reindex(columns=columns[name]) for name, frame in frames.items()}
    tables.write_all(TABLES, frames, outputs)
    for row in frames["printers"].itertuples():
        if row.reason:
            tell(f"{row.printer}: {row.verdict}: {row.reason}")


if __name__ == "__main__":
    run(main, snakemake)
