PTT_BENCH_TABLES = ["ptt_kinematics", "ptt_singularity", "ptt_encoder", "ptt_backlash", "ptt_repeatability"]
PTT_STUDY_TABLES = [
    "ptt_points",
    "ptt_benefit",
    "ptt_start",
    "ptt_training",
    "ptt_spread",
    "ptt_corrections",
    "ptt_extrapolation",
]


rule ptt_bench:
    output:
        **{name: table(name) for name in PTT_BENCH_TABLES},
    log:
        f"{RESULTS}/logs/ptt_bench.log",
    params:
        settings=settings("seed", "robots", "loads", "ptt"),
        code=script_code("ptt_bench"),
    script:
        "../scripts/ptt_bench.py"


# measured and, where experiments are diagnosed together, also as one campaign
rule ptt_measure:
    input:
        backlash=table("ptt_backlash"),
    output:
        **{name: part("measurements", name) for name in (*PTT_EXPERIMENTS, *PTT_JOINT)},
    log:
        f"{RESULTS}/logs/ptt_measure.log",
    params:
        settings=settings("seed", "robots", "loads", "ptt"),
        code=script_code("ptt_measure"),
    script:
        "../scripts/ptt_measure.py"


# one job: starting five takes longer than what they do
rule ptt_compensate:
    input:
        **{name: part("measurements", name) for name in PTT_EXPERIMENTS},
        backlash=table("ptt_backlash"),
    output:
        **{name: table(name) for name in PTT_STUDY_TABLES},
    log:
        f"{RESULTS}/logs/ptt_compensate.log",
    params:
        settings=settings("seed", "robots", "loads", "ptt"),
        code=script_code("ptt_compensate"),
    script:
        "../scripts/ptt_compensate.py"


rule ptt_figures:
    input:
        **{name: table(name) for name in sorted({name for figure in PTT_FIGURES for name in FIGURES[figure][1]})},
    output:
        expand(f"{RESULTS}/figures/{{figure}}.{{kind}}", figure=PTT_FIGURES, kind=["pdf", "png"]),
    log:
        f"{RESULTS}/logs/figures/ptt.log",
    params:
        figures=PTT_FIGURES,
        options={},
        code=script_code("figure"),
    script:
        "../scripts/figure.py"


rule ptt:
    input:
        [table(name) for name in (*PTT_BENCH_TABLES, *PTT_STUDY_TABLES)],
        rules.ptt_figures.output,
        # their figures are of `gap`
        [part("gap_verdicts", name) for name in (*PTT_EXPERIMENTS, *PTT_JOINT)],
