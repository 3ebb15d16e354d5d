from rrru.studies.real import series as real_series
from rrru.studies.real.schemas import SERIES_TABLES as SERIES_SCHEMAS, TABLES as REAL_SCHEMAS

CHECKS.append("rrru.studies.real.series:check")
REAL_TABLES = [one.name for one in REAL_SCHEMAS]
REAL_PATHS = {one.name: f"{RESULTS}/{one.path}" for one in REAL_SCHEMAS}
REAL_SETS = real_series.used(config["real"])
# machines with measured lengths have separate figures
REAL_LENGTHS = [name for name, section in REAL_SETS.items() if "kind" in section]
REAL_ARMS = [name for name in REAL_SETS if name not in REAL_LENGTHS]
ARM_FIGURES = {
    "steps": ("rrru.studies.real.figures:steps", ["real_verdicts", "real_steps", "real_budget"]),
    "spectrum": ("rrru.studies.real.figures:spectrum", ["real_spectrum"]),
}
LENGTH_FIGURES = {"lengths": ("rrru.studies.real.figures:lengths", ["real_points", "real_parameters"])}


# series of the arms' sets by name of the set
REAL_SERIES = {name: [one.name for one in real_series.found(config["real"], name)] for name in REAL_ARMS}
ONE_SERIES = under("real/{set}/{series}")


rule study_series:
    input:
        files=lambda wildcards: real_series.files(config, wildcards.set, wildcards.series),
    output:
        **named([one.name for one in SERIES_SCHEMAS], ONE_SERIES),
        measurements=ONE_SERIES("measurements"),
        model=f"{RESULTS}/real/{{set}}/{{series}}/model.json",
    log:
        f"{RESULTS}/logs/real/{{set}}/{{series}}.log",
    wildcard_constraints:
        set="|".join(REAL_ARMS) or "(?!)",
    params:
        settings=lambda wildcards: {
            "series": wildcards.series,
            **real_series.part(config, wildcards.set),
            **reads("seed", "gap"),
        },
        own_effects=own_effects_digests(),
        code=code("real_series"),
    script:
        "../../scripts/real_series.py"


rule study_arm:
    input:
        **{one.name: real_series.of_each(ONE_SERIES(one.name), REAL_SERIES) for one in SERIES_SCHEMAS},
        measurements=real_series.of_each(rules.study_series.output.measurements, REAL_SERIES),
        model=real_series.of_each(rules.study_series.output.model, REAL_SERIES),
    output:
        **named(REAL_TABLES, under("real/{set}")),
        **drawn(ARM_FIGURES, "figures/real/{set}"),
    log:
        f"{RESULTS}/logs/real/{{set}}.log",
    wildcard_constraints:
        set="|".join(REAL_ARMS) or "(?!)",
    params:
        settings=lambda wildcards: {
            "figures": ARM_FIGURES,
            **real_series.part(config, wildcards.set),
            **reads("seed", "gap"),
        },
        own_effects=own_effects_digests(),
        code=code("real_arm", ARM_FIGURES),
    script:
        "../../scripts/real_arm.py"


rule study_lengths:
    input:
        files=lambda wildcards: real_series.files(config, wildcards.set),
    output:
        **named(REAL_TABLES, under("real/{set}")),
        **drawn(LENGTH_FIGURES, "figures/real/{set}"),
    log:
        f"{RESULTS}/logs/real/{{set}}.log",
    wildcard_constraints:
        set="|".join(REAL_LENGTHS) or "(?!)",
    params:
        settings=lambda wildcards: {"figures": LENGTH_FIGURES, **real_series.part(config, wildcards.set)},
        code=code("real_lengths", LENGTH_FIGURES),
    script:
        "../../scripts/real_lengths.py"


use rule gather as gather_real with:
    input:
        **{name: expand(under("real/{set}")(name), set=sorted(REAL_SETS)) for name in REAL_TABLES},
    output:
        **REAL_PATHS,
    log:
        f"{RESULTS}/logs/gather_real.log",


rule real:
    input:
        REAL_PATHS.values(),
