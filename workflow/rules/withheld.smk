rule withheld_answers:
    output:
        answers=withheld_part("answers"),
    log:
        f"{RESULTS}/logs/withheld_answers/{{chunk}}.log",
    params:
        robots=chunk_robots,
        settings=settings("seed", "robots"),
        code=script_code("withheld_answers"),
    script:
        "../scripts/withheld_answers.py"


rule withheld_measure:
    input:
        answers=withheld_part("answers"),
    output:
        measurements=withheld_part("measurements"),
    log:
        f"{RESULTS}/logs/withheld_measure/{{chunk}}.log",
    params:
        settings=settings("seed", "robots"),
        code=script_code("withheld_measure"),
    script:
        "../scripts/withheld_measure.py"


rule withheld_diagnose:
    input:
        measurements=withheld_part("measurements"),
    output:
        verdicts=withheld_part("verdicts"),
        states=withheld_part("states"),
    log:
        f"{RESULTS}/logs/withheld_diagnose/{{chunk}}.log",
    params:
        without=taken_out,
        settings=settings("seed", "robots", "gap"),
        code=script_code("withheld_diagnose"),
    script:
        "../scripts/withheld_diagnose.py"


rule withheld_score:
    input:
        answers=withheld_part("answers"),
        measurements=withheld_part("measurements"),
        verdicts=withheld_part("verdicts"),
        states=withheld_part("states"),
    output:
        scores=withheld_part("scores"),
        limits=withheld_part("limits"),
    log:
        f"{RESULTS}/logs/withheld_score/{{chunk}}.log",
    params:
        robots=chunk_robots,
        settings=settings("seed", "robots", "gap"),
        code=script_code("withheld_score"),
    script:
        "../scripts/withheld_score.py"


rule withheld_summary:
    input:
        verdicts=[withheld_part("verdicts", chunk) for chunk in WITHHELD],
        scores=[withheld_part("scores", chunk) for chunk in WITHHELD],
        limits=[withheld_part("limits", chunk) for chunk in WITHHELD],
        field=[part("gap_verdicts", campaign) for campaign in config["withheld"]["field"]],
        field_answers=config["withheld"]["field_answers"] or [],
    output:
        **{name: table(name) for name in WITHHELD_TABLES},
    log:
        f"{RESULTS}/logs/withheld_summary.log",
    params:
        code=script_code("withheld_summary"),
    script:
        "../scripts/withheld_summary.py"


rule withheld:
    input:
        [table(name) for name in WITHHELD_TABLES],
        f"{RESULTS}/figures/withheld.png",
