from rrru.store.digest import code_digest
from rrru.studies import config as parts
from rrru.studies.checks import check_once

RESULTS = config["results_dir"].rstrip("/")
CAMPAIGNS = sorted(config["campaigns"])
# sections of all that is diagnosed, by name; a study adds its own campaigns
DIAGNOSED = {name: config["campaigns"][name] for name in CAMPAIGNS}
# what `snakemake` makes; every study adds its own
TARGETS = []
# figures {name: ("module:function", tables)} by study; every study adds its own
FIGURES = {}
# functions that refuse a configuration; every study adds its own
CHECKS = ["rrru.studies.config:check"]
# what a study has of a paper's numbers, by the paper's letter: its package with `published` and `audit`, the tables
# that hold its own numbers, and what it reads of the configuration
PAPERS = {}


wildcard_constraints:
    campaign="[A-Za-z0-9_-]+",


def part(name, campaign="{campaign}"):
    """Path of one campaign's part of a table."""
    return f"{RESULTS}/campaigns/{campaign}/{name}.parquet"


def table(name):
    """Path of a table of the whole study."""
    return f"{RESULTS}/tables/{name}.parquet"


def named(names, place=table):
    """Paths by name."""
    return {name: place(name) for name in names}


def drawn(figures, folder="figures"):
    """Paths of figures as PDF and PNG, by name."""
    return {f"{name}_{kind}": f"{RESULTS}/{folder}/{name}.{kind}" for name in figures for kind in ("pdf", "png")}


def shown(figures):
    """Names of all tables that figures {name: (function, tables)} show."""
    return sorted({name for _, tables in figures.values() for name in tables})


def code(script, *figures):
    """Digest of a script and of all that it imports, the functions of figures {name: (function, tables)} included."""
    modules = sorted({function.partition(":")[0] for group in figures for function, _ in group.values()})
    return code_digest(f"workflow/scripts/{script}.py", *modules)


def reads(*keys):
    """The part of the configuration under dotted keys: all that a rule's script is given of it."""
    return parts.part(config, *keys)
