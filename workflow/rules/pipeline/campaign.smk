parts.check_files(config)


rule campaign:
    input:
        file=campaign_file,
    output:
        **named(["measurements", "truth", "singularity", "campaigns", "workspace"], part),
    log:
        f"{RESULTS}/logs/campaign/{{campaign}}.log",
    wildcard_constraints:
        campaign="|".join(CAMPAIGNS),
    params:
        settings=campaign_settings,
        code=code("campaign"),
    script:
        "../../scripts/campaign.py"
