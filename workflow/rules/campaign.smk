rule campaign:
    input:
        file=campaign_file,
    output:
        measurements=part("measurements"),
        truth=part("truth"),
        singularity=part("singularity"),
        campaigns=part("campaigns"),
    log:
        f"{RESULTS}/logs/campaign/{{campaign}}.log",
    params:
        section=campaign_settings,
        settings=settings("seed", "robots", "motion", "trajectories", "virtual_robots", "calibration"),
        code=code_digest(*CAMPAIGN_ROOMS),
    script:
        "../scripts/campaign.py"


rule gather:
    input:
        lambda wildcards: [part(wildcards.table, campaign) for campaign in CAMPAIGNS],
    output:
        table("{table}"),
    log:
        f"{RESULTS}/logs/gather/{{table}}.log",
    wildcard_constraints:
        table="|".join(CAMPAIGN_TABLES),
    params:
        table="{table}",
        code=code_digest("report/tables", "report/schemas"),
    script:
        "../scripts/gather.py"


rule workspace:
    input:
        measurements=part("measurements"),
    output:
        part("workspace"),
    log:
        f"{RESULTS}/logs/workspace/{{campaign}}.log",
    params:
        settings=settings("robots", "calibration"),
        code=code_digest("mechanisms"),
    script:
        "../scripts/workspace.py"
