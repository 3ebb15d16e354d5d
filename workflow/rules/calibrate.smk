CALIBRATE_ROOMS = (*CAMPAIGN_ROOMS, "calibrate")


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
        code=code_digest(*CALIBRATE_ROOMS),
    script:
        "../scripts/calibrate.py"
