from rrru.studies.withheld.chunks import check as check_withheld, chunks

check_withheld(config)
WITHHELD = chunks(config["withheld"])
# the robots are drawn and driven by these alone
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
