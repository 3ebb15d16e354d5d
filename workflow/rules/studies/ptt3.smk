from rrru.studies.ptt3 import parts as ptt_parts

ptt_parts.check(config)
CHECKS.append("rrru.studies.ptt3.parts:check_robot")

PTT_EXPERIMENTS = sorted(config["ptt"]["experiments"])
# experiments that are diagnosed together, as one campaign
PTT_JOINT = sorted(config["ptt"]["joint"])
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
# settings of every experiment
_MEASURED = ["seed", "robots.ptt3", "loads"]
_MEASURED += [f"ptt.{key}" for key in ("curve", "motion", "repeats", "noise_mm", "parameters", "robot", "experiments")]
_PTT = "rrru.studies.ptt3.figures"
PTT_FIGURES = {
    "ptt_singularity": (f"{_PTT}.robot:ptt_singularity", ["ptt_singularity", "ptt_points"]),
    "ptt_backlash": (f"{_PTT}.robot:ptt_backlash", ["ptt_encoder", "ptt_backlash", "ptt_repeatability"]),
    "ptt_path": (f"{_PTT}.paths:ptt_path", ["ptt_points"]),
    "ptt_errors": (f"{_PTT}.paths:ptt_errors", ["ptt_points"]),
    "ptt_network": (f"{_PTT}.paths:ptt_network", ["ptt_points"]),
    "ptt_training": (f"{_PTT}.learning:ptt_training", ["ptt_training", "ptt_spread"]),
    "ptt_corrections": (f"{_PTT}.learning:ptt_corrections", ["ptt_corrections"]),
    "ptt_benefit": (f"{_PTT}.learning:ptt_benefit", ["ptt_benefit", "ptt_start"]),
    "ptt_extrapolation": (f"{_PTT}.learning:ptt_extrapolation", ["ptt_extrapolation"]),
}
FIGURES["ptt"] = PTT_FIGURES
# they are diagnosed like every campaign
DIAGNOSED |= {name: ptt_parts.campaign_section(config, name) for name in (*PTT_EXPERIMENTS, *PTT_JOINT)}
PAPERS["B"] = {
    "study": "rrru.studies.ptt3",
    "tables": ["ptt_benefit", "ptt_spread", "ptt_training", "ptt_repeatability"],
    "settings": parts.part(
        config["ptt"],
        *("bench.range_mm", "bench.resolution_mm", "bench.turns", "curve.points", "curve.radius_mm", "curve.z_mm"),
        *("network.train", "positions_mm", "repeats"),
        *(f"experiments.{name}.payload_kg" for name in config["ptt"]["experiments"]),
    ),
}


# measured and, where experiments are diagnosed together, also as one campaign
rule ptt_measure:
    output:
        **named(PTT_BENCH_TABLES),
        **{name: part("measurements", name) for name in (*PTT_EXPERIMENTS, *PTT_JOINT)},
    log:
        f"{RESULTS}/logs/ptt_measure.log",
    params:
        settings=reads(*_MEASURED, "ptt.joint", "ptt.bench", "ptt.positions_mm"),
        own_effects=own_effects_digests(),
        code=code("ptt_measure"),
    script:
        "../../scripts/ptt_measure.py"


# one job, because starting five takes longer than the work
rule ptt_compensate:
    input:
        **{name: part("measurements", name) for name in PTT_EXPERIMENTS},
        backlash=table("ptt_backlash"),
    output:
        **named(PTT_STUDY_TABLES),
    log:
        f"{RESULTS}/logs/ptt_compensate.log",
    params:
        settings=reads(*_MEASURED, "ptt.network", "ptt.extrapolation", "ptt.redraws", "ptt.starts_deg"),
        own_effects=own_effects_digests(),
        code=code("ptt_compensate"),
    script:
        "../../scripts/ptt_compensate.py"


rule ptt:
    input:
        named([*PTT_BENCH_TABLES, *PTT_STUDY_TABLES]).values(),
        drawn(PTT_FIGURES).values(),
        # their figures are of `gap`
        [part("gap_verdicts", name) for name in (*PTT_EXPERIMENTS, *PTT_JOINT)],


TARGETS += rules.ptt.input
