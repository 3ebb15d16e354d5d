import hashlib
import json
from pathlib import Path

from rrru.store.digest import code_digest
from rrru.figures.catalogue import FIGURES

RESULTS = config["results_dir"].rstrip("/")
CAMPAIGNS = sorted(config["campaigns"])
# the experiments of paper B, and those that are diagnosed together
PTT_EXPERIMENTS = sorted(config["ptt"]["experiments"])
PTT_JOINT = sorted(config["ptt"]["joint"])
DIAGNOSED = [*CAMPAIGNS, *PTT_EXPERIMENTS, *PTT_JOINT]
# tables of the whole study that are the campaigns' parts, one below the other
CAMPAIGN_TABLES = [
    "campaigns",
    "singularity",
    "calibrations",
    "parameters",
    "correlations",
    "observability",
    "errors",
    "error_summary",
    "genetic",
    "genetic_history",
    "genetic_against_least_squares",
]
SWEEP_TABLES = ["sweep_runs", "sweep_history", "sweep_effect", "sweep_pairs"]
GAP_TABLES = [
    "gap_verdicts",
    "gap_locate",
    "gap_identifiability",
    "gap_attribute",
    "gap_sets",
    "gap_shrink",
    "gap_parameters",
    "gap_next_runs",
]
STUDY_TABLES = [*CAMPAIGN_TABLES, *SWEEP_TABLES, "published", "audit"]

# figures that every campaign gets; the others show the reproduced study
CAMPAIGN_FIGURES = ["workspace", "observability", "convergence", "cross"]

# figures of the gap diagnosis and of its check, which have rules of their own
GAP_FIGURES = ["gap", "withheld"]

# figures of paper B's study, drawn in one job
PTT_FIGURES = sorted(name for name in FIGURES if name.startswith("ptt_"))

SWEPT = ("crossover_fraction", "migration_fraction")


wildcard_constraints:
    campaign="[A-Za-z0-9_-]+",


def part(name, campaign="{campaign}"):
    """Path of one campaign's part of a table."""
    return f"{RESULTS}/campaigns/{campaign}/{name}.parquet"


def table(name):
    """Path of a table of the whole study."""
    return f"{RESULTS}/tables/{name}.parquet"


def script_code(name):
    """Digest of a script and of all it imports."""
    return code_digest(f"workflow/scripts/{name}.py")


def settings(*keys):
    """Digests of what a rule depends on in the configuration, so that a change reruns the rule."""
    return {key: hashlib.sha256(json.dumps(config[key], sort_keys=True).encode()).hexdigest()[:12] for key in keys}


def campaign_file(wildcards):
    """The file of an ingested campaign, nothing for a virtual one."""
    return config["campaigns"][wildcards.campaign].get("ingest", [])


def campaign_settings(wildcards):
    """The campaign's own section of the configuration."""
    return json.dumps(config["campaigns"][wildcards.campaign], sort_keys=True)


def measured_campaign(name):
    """What the configuration says of a campaign, or of an experiment of paper B, that is diagnosed."""
    experiment = {"robot": "ptt3", "noise_mm": config["ptt"]["noise_mm"], "errors": config["ptt"]["parameters"]}
    return config["campaigns"].get(name, experiment)


def campaign_robot(wildcards):
    """Name and dimensions of the robot that a campaign was measured on, and the error parameters where a choice was made."""
    section = measured_campaign(wildcards.campaign)
    chosen = {key: section[key] for key in ("errors",) if key in section}
    return {
        "name": section["robot"],
        **config["robots"].get(section["robot"], {}),
        **section.get("dimensions", {}),
        **chosen,
    }


def campaign_noise(wildcards):
    """The campaign's stated noise per axis in mm, None where it is to be estimated."""
    return measured_campaign(wildcards.campaign).get("noise_mm") or None


def campaign_masses(wildcards):
    """Masses in kg, the platform's own where the campaign states it."""
    loads = config["loads"]
    platform = measured_campaign(wildcards.campaign).get("platform_mass_kg", loads["platform_mass_kg"])
    return {"platform_kg": platform, "forearm_kg": loads["forearm_mass_kg"], "arm_kg": loads["arm_mass_kg"]}


def own_effects_digest():
    """Digest of the files that hold the user's own effects, so that editing one reruns what it changes."""
    files = [f"{name.partition(':')[0].replace('.', '/')}.py" for name in config["gap"]["own_effects"]]
    return [hashlib.sha256(Path(file).read_bytes()).hexdigest()[:12] for file in files if Path(file).exists()]


def figure_campaign(wildcards):
    """Whose figure it is: the reproduced study's lie in figures/ itself, the others' in a folder of the campaign."""
    return wildcards.get("campaign", config["reproduce"]["campaign"])


def figure_tables(wildcards):
    """The tables that a figure reads, by name."""
    campaign = figure_campaign(wildcards)
    own = {"paths": part("measurements", campaign), "workspace": part("workspace", campaign)}
    return {name: own.get(name, table(name)) for name in FIGURES[wildcards.figure][1]}


def z_down(campaign):
    """Whether the frame of the campaign's robot has its z pointing down."""
    return config["campaigns"].get(campaign, {}).get("robot") == "rrru3"


def figure_options(wildcards):
    """What a figure shows."""
    reproduce = config["reproduce"]
    return {
        "campaign": figure_campaign(wildcards),
        "z_down": z_down(figure_campaign(wildcards)),
        "calibration_lines": reproduce["line_calibration"],
        "calibration_spiral": reproduce["spiral_calibration"],
        "sweep_campaign": reproduce["campaign"],
        "sweep_calibration": reproduce["line_calibration"],
        "method": reproduce["method"],
        "mode": "closed_loop",
    }
