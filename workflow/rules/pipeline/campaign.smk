parts.check_files(config)


def campaign_file(wildcards):
    """The file of an ingested campaign, nothing for a virtual one."""
    return config["campaigns"][wildcards.campaign].get("ingest", [])


def campaign_settings(wildcards):
    """What one campaign is made from."""
    name, calibration = wildcards.campaign, config["calibration"]
    return {
        "campaign": name,
        "section": config["campaigns"][name],
        "nominal": parts.nominal(config, name),
        "virtual": parts.virtual(config, name),
        **{key: calibration[key] for key in ("singularity_margin", "use_near_singularity", "sets")},
    }


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
