rule campaign:
    input:
        file=campaign_file,
    output:
        measurements=part("measurements"),
        truth=part("truth"),
        singularity=part("singularity"),
        campaigns=part("campaigns"),
        workspace=part("workspace"),
    log:
        f"{RESULTS}/logs/campaign/{{campaign}}.log",
    wildcard_constraints:
        campaign="|".join(CAMPAIGNS),
    params:
        section=campaign_settings,
        settings=settings("seed", "robots", "motion", "trajectories", "virtual_robots", "calibration"),
        code=script_code("campaign"),
    script:
        "../scripts/campaign.py"


rule gather:
    input:
        **{name: [part(name, campaign) for campaign in CAMPAIGNS] for name in CAMPAIGN_TABLES},
    output:
        **{name: table(name) for name in CAMPAIGN_TABLES},
    log:
        f"{RESULTS}/logs/gather.log",
    params:
        code=script_code("gather"),
    script:
        "../scripts/gather.py"
