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
        settings=settings("robots", "motion", "trajectories", "campaigns", "genetic", "sweep"),
        code=code_digest("reproduce", "mechanisms", "report/tables", "report/schemas"),
    script:
        "../scripts/published.py"
