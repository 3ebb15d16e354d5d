from rrru.gap.settings import GapSettings

# refuses unknown effects before anything runs
GapSettings.from_config(config["gap"]).library()


# one job per campaign; it sees the measurements and what the configuration says of the robot, never the truth of a virtual one
rule diagnose:
    input:
        measurements=part("measurements"),
    output:
        **{name: part(name) for name in (*GAP_TABLES, "gap_points")},
    log:
        f"{RESULTS}/logs/diagnose/{{campaign}}.log",
    params:
        robot=campaign_robot,
        noise_mm=campaign_noise,
        masses=campaign_masses,
        use_near_singularity=config["calibration"]["use_near_singularity"],
        seed=config["seed"],
        gap=config["gap"],
        own_effects=own_effects_digest(),
        code=script_code("diagnose"),
    script:
        "../scripts/diagnose.py"


use rule gather as gather_gap with:
    input:
        **{name: [part(name, campaign) for campaign in DIAGNOSED] for name in GAP_TABLES},
    output:
        **{name: table(name) for name in GAP_TABLES},
    log:
        f"{RESULTS}/logs/gather_gap.log",


rule gap_figure:
    input:
        **{name: part(name) for name in FIGURES["gap"][1] if name != "gap_points"},
        gap_points=part("gap_points"),
    output:
        expand(f"{RESULTS}/figures/{{{{campaign}}}}/gap.{{kind}}", kind=["pdf", "png"]),
    log:
        f"{RESULTS}/logs/figures/{{campaign}}_gap.log",
    params:
        figures=["gap"],
        options=lambda wildcards: {"campaign": wildcards.campaign, "z_down": z_down(wildcards.campaign)},
        code=script_code("figure"),
    script:
        "../scripts/figure.py"


rule gap:
    input:
        [table(name) for name in GAP_TABLES],
        expand(f"{RESULTS}/figures/{{campaign}}/gap.png", campaign=DIAGNOSED),
