parts.check_files(config)


rule campaign:
    input:
        file=campaign_file,
        next_runs=lambda wildcards: campaign_advice(wildcards, "gap_next_runs"),
        next_poses=lambda wildcards: campaign_advice(wildcards, "gap_next_poses"),
    output:
        **named(READ_TABLES, part),
    log:
        f"{RESULTS}/logs/campaign/{{campaign}}.log",
    wildcard_constraints:
        campaign="|".join(CAMPAIGNS),
    params:
        settings=campaign_settings,
        code=code("campaign"),
    script:
        "../../scripts/campaign.py"
