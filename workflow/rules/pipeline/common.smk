import hashlib
from pathlib import Path

import rrru.report
from rrru.errors import ConfigError
from rrru.plugins import module_files, own_code_digest
from rrru.store.digest import code_digest
from rrru.pipeline import config as parts
from rrru.figures.files import figure_paths
from rrru.pipeline.jobs.outputs import (
    CALIBRATION_TABLES,
    CAMPAIGN_FIGURES,
    CAMPAIGN_TABLES,
    GAP_FIGURES,
    GAP_TABLES,
    GENETIC_TABLES,
    READ_TABLES,
    part_path,
)

RESULTS = config["results_dir"].rstrip("/")
CAMPAIGNS = sorted(config["campaigns"])
# sections of all that is diagnosed, by name; a study adds its own campaigns
DIAGNOSED = {name: config["campaigns"][name] for name in CAMPAIGNS}
# default targets; every study adds its own
TARGETS = []
# figures {name: ("module:function", tables)} by study; every study adds its own
FIGURES = {}
# functions that check a configuration; every study adds its own
CHECKS = ["rrru.pipeline.config:check"]
# studies of papers by the paper's letter: package with `published` and `audit`, tables with the study's numbers, and
# its part of the configuration
PAPERS = {}
# tables of studies outside the default run: a page shows those that exist, and makes none
OPTIONAL = ["withheld_summary", "withheld_advice_summary", "real_verdicts", "real_steps", "real_budget"]


wildcard_constraints:
    campaign="[A-Za-z0-9_-]+",


def part(name, campaign="{campaign}"):
    """Path of one campaign's part of a table."""
    return part_path(RESULTS, campaign, name)


def verdict(campaign="{campaign}"):
    """Path of one campaign's answer as JSON."""
    return f"{RESULTS}/campaigns/{campaign}/verdict.json"


def table(name):
    """Path of a table of the whole study."""
    return f"{RESULTS}/tables/{name}.parquet"


def under(folder):
    """The paths of tables in a folder of the results, as a function of their names."""
    return lambda name: f"{RESULTS}/{folder}/{name}.parquet"


def named(names, place=table):
    """Paths by name."""
    return {name: place(name) for name in names}


def drawn(figures, folder="figures"):
    """Paths of figures as PDF, PNG and SVG, by name."""
    return figure_paths(f"{RESULTS}/{folder}", figures)


def shown(figures):
    """Names of all tables that figures {name: (function, tables)} show."""
    return sorted({name for _, tables in figures.values() for name in tables})


def code(script, *figures):
    """Digest of a script and of all that it imports, the functions of figures {name: (function, tables)} included."""
    modules = sorted({function.partition(":")[0] for group in figures for function, _ in group.values()})
    return code_digest(f"workflow/scripts/{script}.py", *modules)


def reads(*keys):
    """The part of the configuration under dotted keys: the settings of a rule's script."""
    return parts.part(config, *keys)


def campaign_file(wildcards):
    """The files of an ingested campaign, nothing for a virtual one."""
    return parts.ingested_files(config["campaigns"][wildcards.campaign])


def campaign_advice(wildcards, name):
    """A table of the diagnosis whose advice a virtual campaign follows, or nothing."""
    followed = config["campaigns"][wildcards.campaign].get("advised_by")
    return part(name, followed) if followed else []


def campaign_settings(wildcards):
    """Settings of the job of one campaign."""
    return parts.read_settings(config, wildcards.campaign)


def calibrated(*keys, driven=False):
    """Settings of a job about one campaign's calibrations, as a function of the wildcards."""
    return lambda wildcards: parts.calibration_settings(config, wildcards.campaign, *keys, driven=driven)


def diagnosed(wildcards):
    """Settings of a diagnosis."""
    return parts.diagnosis_settings(config, wildcards.campaign, DIAGNOSED[wildcards.campaign])


def own_effects_digests():
    """Digest of these files, so that editing one reruns the affected jobs."""
    return own_code_digest(parts.own_effects(config)) if own_effects() else []


def own_effects():
    """The files that hold the user's own effects."""
    return module_files(parts.own_effects(config))


def paper_options():
    """Options of the figures of paper A."""
    reproduce = config["reproduce"]
    return {
        **parts.figure_options(config, REPRODUCED),
        "calibration_lines": reproduce["line_calibration"],
        "calibration_spiral": reproduce["spiral_calibration"],
        "sweep_campaign": REPRODUCED,
        "sweep_operators": config["genetic"]["operators"],
        "sweep_calibration": reproduce["line_calibration"],
    }


def redraw_settings(count):
    """Settings of a job about draws of the reproduced campaign; count: the key of `reproduce` with their number."""
    chosen = {config["reproduce"][key] for key in ("line_calibration", "spiral_calibration")}
    keys = ("line_calibration", "spiral_calibration", "method", count)
    return {
        "nominal": parts.nominal(config, REPRODUCED),
        "virtual": parts.virtual(config, REPRODUCED),
        "sets": {name: patterns for name, patterns in parts.sets(config, REPRODUCED).items() if name in chosen},
        **reads("calibration.use_near_singularity", *(f"reproduce.{key}" for key in keys)),
    }


def template_digests():
    """Digests of a page's templates, by name."""
    files = sorted(Path(rrru.report.__file__).parent.glob("templates/*"))
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def optional_digests(_):
    """Digests of the existing tables of optional studies."""
    files = [Path(table(name)) for name in OPTIONAL]
    return {file.stem: hashlib.sha256(file.read_bytes()).hexdigest() for file in files if file.is_file()}


def campaign_page(wildcards):
    """Input files of the page of one campaign."""
    name = wildcards.campaign
    if name not in DIAGNOSED:
        raise ConfigError(f"there is no campaign {name!r}; allowed: {', '.join(DIAGNOSED)}")
    calibrated = name in CAMPAIGNS
    tables = [*GAP_TABLES, *(CAMPAIGN_TABLES if calibrated else [])]
    own = drawn(CAMPAIGN_FIGURES, "figures" if name == REPRODUCED else f"figures/{name}") if calibrated else {}
    drawings = (own | drawn(GAP_FIGURES, f"figures/{name}")).values()
    return [verdict(name), *(part(one, name) for one in tables), *drawings]


def diagnosed_as(kind):
    """Pattern of the campaigns whose corrected robot file has this ending, "" for those without one."""
    names = (name for name, section in DIAGNOSED.items() if parts.corrected_kind(config, section) == kind)
    return "|".join(names) or "(?!)"
