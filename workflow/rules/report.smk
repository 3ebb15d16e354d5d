rule published:
    input:
        errors=table("errors"),
        parameters=table("parameters"),
        genetic=table("genetic"),
        sweep_runs=table("sweep_runs"),
    output:
        published=table("published"),
        audit=table("audit"),
    log:
        f"{RESULTS}/logs/published.log",
    params:
        settings=settings("robots", "motion", "trajectories", "campaigns", "genetic", "reproduce", "sweep"),
        code=code_digest("reproduce", "mechanisms", "report/tables", "report/schemas"),
    script:
        "../scripts/published.py"


rule twin:
    output:
        f"{RESULTS}/twin/twin.yaml",
    log:
        f"{RESULTS}/logs/twin.log",
    params:
        settings=settings("seed", "robots", "reproduce", "twin"),
        code=code_digest("mechanisms", "effects", "plant", "campaign", "reproduce"),
    threads: 2
    script:
        "../scripts/twin.py"


rule figure:
    input:
        unpack(figure_tables),
    output:
        pdf=f"{RESULTS}/figures/{{figure}}.pdf",
        png=f"{RESULTS}/figures/{{figure}}.png",
    log:
        f"{RESULTS}/logs/figures/{{figure}}.log",
    wildcard_constraints:
        figure="|".join(FIGURES),
    params:
        options=figure_options,
        code=code_digest("report"),
    script:
        "../scripts/figure.py"


use rule figure as campaign_figure with:
    output:
        pdf=f"{RESULTS}/figures/{{campaign}}/{{figure}}.pdf",
        png=f"{RESULTS}/figures/{{campaign}}/{{figure}}.png",
    log:
        f"{RESULTS}/logs/figures/{{campaign}}/{{figure}}.log",


rule figures:
    input:
        expand(f"{RESULTS}/figures/{{figure}}.png", figure=sorted(FIGURES)),
        expand(
            f"{RESULTS}/figures/{{campaign}}/{{figure}}.png",
            campaign=[name for name in CAMPAIGNS if name != config["reproduce"]["campaign"]],
            figure=CAMPAIGN_FIGURES,
        ),
