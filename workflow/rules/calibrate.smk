rule calibrate:
    input:
        measurements=part("measurements"),
        campaigns=part("campaigns"),
    output:
        calibrations=part("calibrations"),
        parameters=part("parameters"),
        correlations=part("correlations"),
        observability=part("observability"),
    log:
        f"{RESULTS}/logs/calibrate/{{campaign}}.log",
    params:
        settings=settings("robots", "calibration"),
        code=script_code("calibrate"),
    script:
        "../scripts/calibrate.py"


rule genetic:
    input:
        measurements=part("measurements"),
        calibrations=part("calibrations"),
        parameters=part("parameters"),
    output:
        genetic=part("genetic"),
        genetic_history=part("genetic_history"),
        genetic_against_least_squares=part("genetic_against_least_squares"),
        timings=f"{RESULTS}/timings/{{campaign}}.parquet",
    log:
        f"{RESULTS}/logs/genetic/{{campaign}}.log",
    params:
        settings=settings("seed", "robots", "calibration", "genetic"),
        code=script_code("genetic"),
    script:
        "../scripts/genetic.py"


rule sweep:
    input:
        measurements=part("measurements", config["reproduce"]["campaign"]),
    output:
        sweep_runs=f"{RESULTS}/sweep/{{parameter}}/{{population}}/{{value}}_runs.parquet",
        sweep_history=f"{RESULTS}/sweep/{{parameter}}/{{population}}/{{value}}_history.parquet",
    log:
        f"{RESULTS}/logs/sweep/{{parameter}}/{{population}}/{{value}}.log",
    params:
        settings=settings("seed", "robots", "calibration", "genetic", "reproduce", "sweep"),
        code=script_code("sweep"),
    script:
        "../scripts/sweep.py"


rule sweep_tables:
    input:
        **{
            name: expand(
                f"{RESULTS}/sweep/{{parameter}}/{{population}}/{{value}}_{name.removeprefix('sweep_')}.parquet",
                parameter=SWEPT,
                population=sorted(config["sweep"]["populations"]),
                value=config["sweep"]["values"],
            )
            for name in ("sweep_runs", "sweep_history")
        },
    output:
        **{name: table(name) for name in SWEEP_TABLES},
    log:
        f"{RESULTS}/logs/sweep_tables.log",
    params:
        seed=config["seed"],
        code=script_code("sweep_tables"),
    script:
        "../scripts/sweep_tables.py"
