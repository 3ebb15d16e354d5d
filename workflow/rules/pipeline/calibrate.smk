# settings of the genetic algorithm itself
GENETIC_SETTINGS = [f"genetic.{key}" for key in config["genetic"] if key not in ("campaigns", "seeds")]
TARGETS += named(CAMPAIGN_TABLES).values()


rule calibrate:
    input:
        **named(["measurements", "campaigns"], part),
    output:
        **named(CALIBRATION_TABLES, part),
        robot=f"{RESULTS}/campaigns/{{campaign}}/robot.json",
    log:
        f"{RESULTS}/logs/calibrate/{{campaign}}.log",
    params:
        settings=calibrated(*parts.CALIBRATION_KEYS),
        code=code("calibrate"),
    script:
        "../../scripts/calibrate.py"


rule genetic:
    input:
        **named(["measurements", "calibrations", "parameters"], part),
    output:
        **named(GENETIC_TABLES, part),
        timings=f"{RESULTS}/timings/{{campaign}}.parquet",
    log:
        f"{RESULTS}/logs/genetic/{{campaign}}.log",
    params:
        settings=calibrated(*parts.GENETIC_KEYS),
        code=code("genetic"),
    script:
        "../../scripts/genetic.py"


# every calibration applied to every trajectory
rule compensate:
    input:
        **named(["measurements", "parameters", "genetic", "genetic_parameters"], part),
    output:
        **named(["errors", "error_summary"], part),
    log:
        f"{RESULTS}/logs/compensate/{{campaign}}.log",
    params:
        settings=calibrated(driven=True),
        code=code("compensate"),
    script:
        "../../scripts/compensate.py"


rule gather:
    input:
        **{name: [part(name, campaign) for campaign in CAMPAIGNS] for name in CAMPAIGN_TABLES},
    output:
        **named(CAMPAIGN_TABLES),
    log:
        f"{RESULTS}/logs/gather.log",
    params:
        settings={},
        code=code("gather"),
    script:
        "../../scripts/gather.py"
