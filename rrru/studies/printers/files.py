"""Printers' files of every form: the printers' JSON, Klipper's printer.cfg, commands of RepRapFirmware."""

from collections import Counter
from pathlib import Path

from rrru.errors import IngestError
from rrru.studies.printers import klipper, readings, reprap
from rrru.studies.printers.printer import Refused


def read(path, name=None):
    """Printers of a file, a tuple; raises IngestError where none of them can be read. name: of a file with one."""
    if Path(path).suffix.lower() == ".json":
        return readings.read(path)
    name = name or Path(path).stem
    form = reprap if reprap.belongs(path) else klipper
    printer = readings.printer_of(path, name, form.entry(path, name))
    if isinstance(printer, Refused):
        raise IngestError(printer.problems)
    return (printer,)


def read_all(paths):
    """Printers of several files, a tuple; a file that cannot be read is a `Refused` under its name.

    Files of the same name are named by their paths. Raises IngestError where no printer of any file can be read, or
    where a name occurs twice.
    """
    stems, printers = Counter(Path(path).stem for path in paths), []
    for path in paths:
        name = Path(path).stem if stems[Path(path).stem] == 1 else str(path)
        try:
            printers += read(path, name)
        except IngestError as error:
            printers.append(Refused(name, str(path), error.problems))
    if all(isinstance(printer, Refused) for printer in printers):
        raise IngestError([problem for printer in printers for problem in printer.problems])
    twice = [name for name, count in Counter(printer.name for printer in printers).items() if count > 1]
    if twice:
        problem = {"file": ", ".join(str(path) for path in paths), "value": f"the id {twice[0]} twice"}
        raise IngestError([problem | {"allowed": "a different id for each printer"}])
    return tuple(printers)
