from rrru.gap.chunks import check as check_withheld, chunks

check_withheld(config)
WITHHELD = chunks(config["withheld"])
# the robots are drawn and driven by these; the diagnosis and the scoring are the whole room
DRAWING_ROOMS = ("gap/withheld", "gap/withheld_robots", "gap/outside", "gap/chunks")
GAP_KEYS = [key for key in ("gap",) if key in config]
WITHHELD_TABLES = [
    "withheld_verdicts",
    "withheld_scores",
    "withheld_limits",
    "withheld_summary",
    "withheld_confusion",
]


wildcard_constraints:
    chunk="|".join(WITHHELD) or "none",


def withheld_part(name, chunk="{chunk}"):
    """Path of a chunk's part of a table."""
    return f"{RESULTS}/withheld/{name}/{chunk}.parquet"


def taken_out(wildcards):
    """The effect that the diagnosis of a chunk has to do without, empty for none."""
    return WITHHELD[wildcards.chunk].effect


def chunk_robots(wildcards):
    """Which robots a chunk holds."""
    chunk = WITHHELD[wildcards.chunk]
    return [chunk.check, chunk.effect, chunk.first, chunk.end]


rule withheld_answers:
    output:
        answers=withheld_part("answers"),
    log:
        f"{RESULTS}/logs/withheld_answers/{{chunk}}.log",
    params:
        robots=chunk_robots,
        settings=settings("seed", "robots"),
        code=code_digest(*STUDY_ROOMS, *DRAWING_ROOMS),
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
        code=code_digest(*STUDY_ROOMS, *DRAWING_ROOMS),
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
        settings=settings("robots", *GAP_KEYS),
        code=code_digest(*STUDY_ROOMS, "gap"),
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
        settings=settings("seed", "robots", *GAP_KEYS),
        code=code_digest(*STUDY_ROOMS, "gap"),
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
        code=code_digest(*TABLE_ROOMS, "gap"),
    script:
        "../scripts/withheld_summary.py"


rule withheld:
    input:
        [table(name) for name in WITHHELD_TABLES],
        [f"{RESULTS}/figures/withheld.png"] if "withheld" in FIGURES else [],
