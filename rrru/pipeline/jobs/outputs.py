"""Names of the tables that the jobs of a campaign write, and of the figures drawn from them."""

from pathlib import Path

READ_TABLES = ("measurements", "truth", "singularity", "campaigns", "registration", "workspace")
CALIBRATION_TABLES = ("calibrations", "parameters", "gauge", "correlations", "observability")
GENETIC_TABLES = ("genetic", "genetic_history", "genetic_parameters", "genetic_against_least_squares")
# tables of the whole study: the concatenated parts of the campaigns
CAMPAIGN_TABLES = (
    "campaigns",
    "registration",
    "singularity",
    *CALIBRATION_TABLES,
    *GENETIC_TABLES,
    "errors",
    "error_summary",
)
GAP_TABLES = (
    "gap_verdicts",
    "gap_left_out",
    "gap_budget",
    "gap_locate",
    "gap_identifiability",
    "gap_attribute",
    "gap_remainder",
    "gap_sets",
    "gap_shrink",
    "gap_parameters",
    "gap_drive_functions",
    "gap_next_runs",
    "gap_next_poses",
)
# figures {name: ("module:function", tables)}
CAMPAIGN_FIGURES = {
    "workspace": ("rrru.figures.workspace:workspace", ["workspace", "singularity", "measurements", "campaigns"]),
    "observability": ("rrru.figures.observability:observability", ["observability"]),
    "convergence": ("rrru.figures.convergence:convergence", ["genetic_history", "genetic"]),
    "cross": ("rrru.figures.cross:cross", ["error_summary"]),
}
GAP_FIGURES = {
    "gap": ("rrru.figures.gap:gap", ["gap_verdicts", "gap_budget", "gap_attribute", "gap_shrink", "gap_points"]),
    "drive_functions": ("rrru.figures.drive_functions:drive_functions", ["gap_drive_functions"]),
    "gap_map": ("rrru.figures.gap:gap_map", ["gap_verdicts", "gap_points"]),
}


def part_path(folder: str | Path, campaign: str, name: str) -> str:
    """Path of one campaign's part of a table in a folder of results."""
    return f"{folder}/campaigns/{campaign}/{name}.parquet"
