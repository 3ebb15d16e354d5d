from rrru.studies.real import series as real_series
from rrru.studies.real.schemas import TABLES as REAL_SCHEMAS

CHECKS.append("rrru.studies.real.series:check")
REAL_TABLES = [one.name for one in REAL_SCHEMAS]
REAL_PATHS = {one.name: f"{RESULTS}/{one.path}" for one in REAL_SCHEMAS}
REAL_SETS = real_series.used(config["real"])
# machines of which only lengths are known have figures of their own
REAL_LENGTHS = [name for name, section in REAL_SETS.items() if "kind" in section]
REAL_ARMS = [name for name in REAL_SETS if name not in REAL_LENGTHS]
ARM_FIGURES = {
    "steps": ("rrru.studies.real.figures:steps", ["real_verdicts", "real_steps", "real_budget"]),
    "spectrum": ("rrru.studies.real.figures:spectrum", ["real_spectrum"]),
}
LENGTH_FIGURES = {"lengths": ("rrru.studies.real.figures_lengths:lengths", ["real_points", "real_parameters"])}


def real_files(wildcards):
    """The files of a data set and of what describes its robot, none where they are not here."""
    series, section = real_series.found(config["real"], wildcards.set), REAL_SETS[wildcards.set]
    files = [one.file for one in series]
    if "chain" in section:
        files += sorted({one.parent / section["chain"] for one in files})
    elif "robot" in section:
        files += [parts.own_robot_file(config["robots"][section["robot"]])]
    return [str(file) for file in files if file is not None and file.exists()]


def real_settings(figures):
    """What is told of a data set: its own part of the configuration, and the robot that it names."""

    def settings(wildcards):
        section = REAL_SETS[wildcards.set]
        real = {key: config["real"][key] for key in ("folder", "gap")} | {"sets": {wildcards.set: section}}
        robots = parts.part(config, f"robots.{section['robot']}").get("robots", {}) if "robot" in section else {}
        return {"set": wildcards.set, "real": real, "robots": robots, "figures": figures, **reads("seed", "gap")}

    return settings


rule study_arm:
    input:
        files=real_files,
    output:
        **named(REAL_TABLES, under("real/{set}")),
        **drawn(ARM_FIGURES, "figures/real/{set}"),
    log:
        f"{RESULTS}/logs/real/{{set}}.log",
    wildcard_constraints:
        set="|".join(REAL_ARMS) or "(?!)",
    params:
        settings=real_settings(ARM_FIGURES),
        own_effects=own_effects_digests(),
        code=code("real", ARM_FIGURES),
    script:
        "../../scripts/real.py"


use rule study_arm as study_lengths with:
    output:
        **named(REAL_TABLES, under("real/{set}")),
        **drawn(LENGTH_FIGURES, "figures/real/{set}"),
    wildcard_constraints:
        set="|".join(REAL_LENGTHS) or "(?!)",
    params:
        settings=real_settings(LENGTH_FIGURES),
        own_effects=own_effects_digests(),
        code=code("real", LENGTH_FIGURES),


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
