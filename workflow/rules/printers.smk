PRINTER_TABLES = ["printers", "printer_parameters", "printer_readings", "printer_causes"]


rule calibrate_printers:
    input:
        config["printers"]["file"],
    output:
        **{name: table(name) for name in PRINTER_TABLES},
    log:
        f"{RESULTS}/logs/printers.log",
    params:
        settings={key: value for key, value in config["printers"].items() if key != "file"},
        code=script_code("printers"),
    script:
        "../scripts/printers.py"


rule printers:
    input:
        [table(name) for name in PRINTER_TABLES],
        f"{RESULTS}/figures/printers.png",
