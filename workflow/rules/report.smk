rule published:
    input:
        **{
            name: table(name)
            for name in (
                "ptt_benefit",
                "ptt_spread",
                "ptt_training",
                "ptt_repeatability",
                "delta_points",
                "delta_camera",
                "delta_draws",
            )
        },
        errors=table("errors"),
        calibrations=table("calibrations"),
        parameters=table("parameters"),
        genetic=table("genetic"),
        sweep_runs=table("sweep_runs"),
    output:
        published=table("published"),
        audit=table("audit"),
    log:
        f"{RESULTS}/logs/published.log",
    params:
        settings=settings(
            "seed",
            "robots",
            "motion",
            "trajectories",
            "virtual_robots",
            "campaigns",
            "calibration",
            "genetic",
            "reproduce",
            "ptt",
            "delta",
        ),
        code=script_code("published"),
    script:
        "../scripts/published.py"


rule twin:
    output:
        f"{RESULTS}/twin/twin.yaml",
    log:
        f"{RESULTS}/logs/twin.log",
    threads: 2
    params:
        settings=settings("seed", "robots", "reproduce", "twin"),
        code=script_code("twin"),
    script:
        "../scripts/twin.py"


rule figure:
    input:
        unpack(figure_tables),
    output:
        expand(f"{RESULTS}/figures/{{{{figure}}}}.{{kind}}", kind=["pdf", "png"]),
    log:
        f"{RESULTS}/logs/figures/{{figure}}.log",
    wildcard_constraints:
        figure="|".join(set(FIGURES) - {"gap", *PTT_FIGURES}),
    params:
        figures=["{figure}"],
        options=figure_options,
        code=script_code("figure"),
    script:
        "../scripts/figure.py"


rule campaign_figures:
    input:
        paths=part("measurements"),
        workspace=part("workspace"),
        singularity=part("singularity"),
        observability=part("observability"),
        genetic=part("genetic"),
        genetic_history=part("genetic_history"),
        error_summary=part("error_summary"),
    output:
        expand(f"{RESULTS}/figures/{{{{campaign}}}}/{{figure}}.{{kind}}", figure=CAMPAIGN_FIGURES, kind=["pdf", "png"]),
    log:
        f"{RESULTS}/logs/figures/{{campaign}}.log",
    params:
        figures=CAMPAIGN_FIGURES,
        options=figure_options,
        code=script_code("figure"),
    script:
        "../scripts/figure.py"


rule figures:
    input:
        expand(f"{RESULTS}/figures/{{figure}}.png", figure=sorted(set(FIGURES) - {*GAP_FIGURES, *PTT_FIGURES})),
        expand(
            f"{RESULTS}/figures/{{campaign}}/{{figure}}.png",
            campaign=[name for name in CAMPAIGNS if name != config["reproduce"]["campaign"]],
            figure=CAMPAIGN_FIGURES,
        ),
