from pathlib import Path

from rrru.errors import ConfigError

PRINTER_TABLES = ["printers", "printer_parameters", "printer_readings", "printer_causes"]
PRINTER_FIGURES = {"printers": ("rrru.studies.printers.figures:printers", ["printers"])}
FIGURES["printer"] = PRINTER_FIGURES

PRINTER_FILES = config["printers"]["files"]
for _file in PRINTER_FILES:
    if not Path(_file).is_file():
        raise ConfigError(f"printers.files: there is no file {_file}")


rule calibrate_printers:
    input:
        files=PRINTER_FILES,
    output:
        **named(PRINTER_TABLES),
    log:
        f"{RESULTS}/logs/printers.log",
    params:
        settings=reads("printers.stopping_step", "printers.level", "printers.confounded_from"),
        code=code("printers"),
    script:
        "../../scripts/printers.py"


rule printers:
    input:
        named(PRINTER_TABLES).values(),
        drawn(PRINTER_FIGURES).values(),


TARGETS += rules.printers.input
