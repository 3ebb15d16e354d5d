from rrru.studies.blind_validation.chunks import chunks, described, rivalled, statement_chunks

CHECKS.append("rrru.studies.blind_validation.chunks:check")
# the robots of every job
WITHHELD = chunks(config["withheld"])
WITHHELD_NAMES = ("verdicts", "scores", "limits", "parts", "causes", "summary", "confusion")
WITHHELD_TABLES = [f"withheld_{name}" for name in WITHHELD_NAMES]
WITHHELD_ADVICE = ["withheld_advice", "withheld_advice_summary"]
# the chunks that have robots whose cause is hidden
WITHHELD_HIDDEN = [name for name, members in WITHHELD.items() if any(member.check == "label" for member in members)]
# statements of pages of own robots, and gross mistakes in files
STATEMENTS = statement_chunks(config["withheld"]["sentences"])
# of the calibration's settings, what the jobs read that a page needs
PAGE_CALIBRATION = [f"calibration.{key}" for key in ("sets", "bounds", "singularity_margin", "use_near_singularity")]
WITHHELD_FIGURES = {
    "withheld": (
        "rrru.studies.blind_validation.figures:withheld",
        ["withheld_scores", "withheld_confusion", "withheld_parts"],
    ),
    "withheld_causes": ("rrru.studies.blind_validation.figures:withheld_causes", ["withheld_causes"]),
}
PLANTS_FIGURES = {
    "withheld_plants": (
        "rrru.studies.blind_validation.figures:withheld_plants",
        ["withheld_scores", "withheld_confusion", "withheld_parts"],
    )
}
FIGURES["withheld"] = WITHHELD_FIGURES
if config["withheld"]["mujoco"] + config["withheld"]["own"]:
    FIGURES["withheld"] = WITHHELD_FIGURES | PLANTS_FIGURES
# the robots among them for the comparison of methods
RIVALLED = rivalled(config["withheld"])
# known settings of every robot
WITHHELD_ROBOT = {
    "robot": parts.robot(config, {"robot": "rrru3"}),
    "masses": parts.masses(config, {}),
    **reads("seed", "withheld.noise_mm"),
}


# the same for the robots of a chunk, with those of files by the file's entry; and with the input of their diagnosis
WITHHELD_KNOWN, WITHHELD_MEASURED = (
    {chunk: {"files": described(config, members, as_measured), **WITHHELD_ROBOT} for chunk, members in WITHHELD.items()}
    for as_measured in (False, True)
)


wildcard_constraints:
    chunk="|".join([*WITHHELD, *STATEMENTS]) or "none",


rule withheld_robots:
    output:
        **named(["withheld_answers", "withheld_measurements"], under("withheld/{chunk}")),
    log:
        f"{RESULTS}/logs/withheld_robots/{{chunk}}.log",
    params:
        settings=lambda wildcards: {
            "members": WITHHELD[wildcards.chunk],
            **WITHHELD_KNOWN[wildcards.chunk],
            **reads("motion"),
        },
        code=code("withheld_robots"),
    script:
        "../../scripts/withheld_robots.py"


# it reads the measurements and the effects removed from its library, never the truth
rule withheld_diagnose:
    input:
        **named(["withheld_measurements"], under("withheld/{chunk}")),
    output:
        **named(
            [f"withheld_{name}" for name in ("verdicts", "stated", "states", "budget")],
            under("withheld/{chunk}"),
        ),
    log:
        f"{RESULTS}/logs/withheld_diagnose/{{chunk}}.log",
    params:
        settings=lambda wildcards: {
            "robots": {one.name: (one.check, one.taken_out, one.file) for one in WITHHELD[wildcards.chunk]},
            **WITHHELD_MEASURED[wildcards.chunk],
            **reads("gap"),
        },
        own_effects=own_effects_digests(),
        code=code("withheld_diagnose"),
    script:
        "../../scripts/withheld_diagnose.py"


rule withheld_score:
    input:
        **named(
            [f"withheld_{name}" for name in ("answers", "measurements", "verdicts", "stated", "states", "budget")],
            under("withheld/{chunk}"),
        ),
    output:
        **named(
            [f"withheld_{name}" for name in ("scores", "limits", "parts", "causes")],
            under("withheld/{chunk}"),
        ),
    log:
        f"{RESULTS}/logs/withheld_score/{{chunk}}.log",
    params:
        settings=lambda wildcards: {**WITHHELD_KNOWN[wildcards.chunk], **reads("motion", "gap")},
        own_effects=own_effects_digests(),
        code=code("withheld_score"),
    script:
        "../../scripts/withheld_score.py"


# like the diagnosis, it never reads the truth
rule withheld_beliefs:
    input:
        **named(["withheld_measurements"], under("withheld/{chunk}")),
    output:
        withheld_beliefs=f"{RESULTS}/timings/withheld/{{chunk}}.parquet",
    log:
        f"{RESULTS}/logs/withheld_beliefs/{{chunk}}.log",
    params:
        settings=lambda wildcards: {"robots": RIVALLED[wildcards.chunk], **WITHHELD_ROBOT, **reads("gap")},
        own_effects=own_effects_digests(),
        code=code("withheld_beliefs"),
    script:
        "../../scripts/withheld_beliefs.py"


rule withheld_methods:
    input:
        withheld_answers=[under(f"withheld/{chunk}")("withheld_answers") for chunk in RIVALLED],
        withheld_beliefs=[f"{RESULTS}/timings/withheld/{chunk}.parquet" for chunk in RIVALLED],
    output:
        withheld_methods=f"{RESULTS}/timings/withheld_methods.parquet",
    log:
        f"{RESULTS}/logs/withheld_methods.log",
    params:
        settings={},
        code=code("withheld_methods"),
    script:
        "../../scripts/withheld_methods.py"


rule withheld_summary:
    input:
        **{
            name: [under(f"withheld/{chunk}")(name) for chunk in WITHHELD]
            for name in (f"withheld_{name}" for name in WITHHELD_NAMES[:5])
        },
        field=[part("gap_verdicts", campaign) for campaign in config["withheld"]["field"]],
        field_answers=config["withheld"]["field_answers"] or [],
    output:
        **named(WITHHELD_TABLES),
    log:
        f"{RESULTS}/logs/withheld_summary.log",
    params:
        settings={},
        code=code("withheld_summary"),
    script:
        "../../scripts/withheld_summary.py"


# it drives the robots, so it reads their truth; the diagnosis that it calls has measurements alone
rule withheld_advice:
    input:
        **{
            name: [under(f"withheld/{chunk}")(name) for chunk in WITHHELD_HIDDEN]
            for name in ("withheld_answers", "withheld_measurements", "withheld_verdicts")
        },
    output:
        **named(WITHHELD_ADVICE),
    log:
        f"{RESULTS}/logs/withheld_advice.log",
    params:
        settings={**WITHHELD_ROBOT, **reads("motion", "gap", "withheld.noise_mm", "withheld.advice")},
        own_effects=own_effects_digests(),
        code=code("withheld_advice"),
    script:
        "../../scripts/withheld_advice.py"


# one job draws a robot and makes and judges its page: the diagnosis has files alone
rule withheld_statements:
    output:
        **named(["withheld_statements"], under("withheld/{chunk}")),
    log:
        f"{RESULTS}/logs/withheld_statements/{{chunk}}.log",
    params:
        settings=lambda wildcards: {
            "chunk": STATEMENTS[wildcards.chunk],
            **reads("seed", "gap", *PAGE_CALIBRATION),
            **reads("withheld.sentences.stops", "withheld.sentences.mujoco_share"),
        },
        own_effects=own_effects_digests(),
        code=code("withheld_statements"),
    script:
        "../../scripts/withheld_statements.py"


rule withheld_sentences:
    input:
        withheld_statements=[under(f"withheld/{chunk}")("withheld_statements") for chunk in STATEMENTS],
    output:
        **named(["sentences"]),
    log:
        f"{RESULTS}/logs/withheld_sentences.log",
    params:
        settings={},
        code=code("withheld_sentences"),
    script:
        "../../scripts/withheld_sentences.py"


# a separate part of the check
rule sentences:
    input:
        rules.withheld_sentences.output,


# not part of the default run
rule withheld:
    input:
        named([*WITHHELD_TABLES, *WITHHELD_ADVICE]).values(),
        rules.withheld_sentences.output,
        rules.withheld_methods.output,
        drawn(FIGURES["withheld"]).values(),
