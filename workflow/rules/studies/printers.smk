from pathlib import Path

from rrru.errors import ConfigError

PRINTER_TABLES = ["printers", "printer_parameters", "printer_readings", "printer_causes"]
PRINTER_FIGURES = {"printers": ("rrru.studies.printers.figures:printers", ["printers"])}
FIGURES["printer"] = PRINTER_FIGURES

if not Path(config["printers"]["file"]).is_file():
    raise ConfigError(f"printers.file: there is no file {config['printers']['file']}")


rule calibrate_printers:
    input:
        file=config["printers"]["file"],
    output:
        **named(PRINTER_TABLES),
    log:
        f"{RESULTS}/logs/printers.log",
    params:
        settings=reads("printers.stopping_step", "printers.level", "printers.imitated_from"),
        code=code("printers"),
    script:
        "../../scripts/printers.py"


rule printers:
    input:
        named(PRINTER_TABLES).values(),
        drawn(PRINTER_FIGURES).values(),


TARGETS += rules.printers.input
