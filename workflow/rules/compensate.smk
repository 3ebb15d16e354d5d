rule compensate:
    input:
        measurements=part("measurements"),
        parameters=part("parameters"),
        genetic=part("genetic"),
    output:
        errors=part("errors"),
        error_summary=part("error_summary"),
    log:
        f"{RESULTS}/logs/compensate/{{campaign}}.log",
    params:
        settings=settings("seed", "robots", "motion", "trajectories", "virtual_robots", "calibration"),
        code=script_code("compensate"),
    script:
        "../scripts/compensate.py"
