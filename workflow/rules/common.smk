from rrru.report.digest import code_digest

RESULTS = config["results_dir"].rstrip("/")
CAMPAIGNS = sorted(config["campaigns"])
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
STUDY_TABLES = [*CAMPAIGN_TABLES, "sweep_runs", "sweep_history", "sweep_effect", "sweep_pairs", "published", "audit"]


wildcard_constraints:
    campaign="[A-Za-z0-9_-]+",


def part(name, campaign="{campaign}"):
    """Path of one campaign's part of a table."""
    return f"{RESULTS}/campaigns/{campaign}/{name}.parquet"


def table(name):
    """Path of a table of the whole study."""
    return f"{RESULTS}/tables/{name}.parquet"


def settings(*keys):
    """What a rule depends on in the configuration: its text, so that a change reruns the rule."""
    return {key: config[key] for key in keys}
