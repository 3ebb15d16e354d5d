"""A folder of its own to run snakemake in, which sees the project's files through links."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SNAKEMAKE = str(Path(sys.executable).parent / "snakemake")


def link(folder):
    """Link what a run needs into a folder, once."""
    for name in ("Snakefile", "config.yaml", "profiles", "workflow", "tests", "data"):
        place = folder / name
        if not place.exists():
            place.symlink_to(ROOT / name)
