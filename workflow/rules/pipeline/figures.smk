# the figures of a study, in one job
for study, figures in FIGURES.items():

    rule:
        name:
            f"{study}_figures"
        input:
            **named(shown(figures)),
        output:
            **drawn(figures),
        log:
            f"{RESULTS}/logs/figures/{study}.log",
        params:
            settings={"figures": figures, "options": {}},
            code=code("figure", figures),
        script:
            "../../scripts/figure.py"
