"""All groups, each in a separate process; then the table, the figure and the page: `make bench`."""

import subprocess
import sys
from pathlib import Path

from benchmarks import harness, page
from rrru.store import tables

GROUPS = ("objective", "genetic", "least_squares", "solver", "kinematics", "sysid", "diagnosis", "workflow")
# run only by name: they take an hour or more, and have separate tables
LONG_GROUPS = ("coverage", "noise_found")


def main(groups):
    """Run groups, by default all except the long ones, and write the page with the last results of the others."""
    if unknown := set(groups) - set(GROUPS):
        sys.exit(f"no group {unknown.pop()!r}; allowed: {', '.join(GROUPS)}")
    here = Path(__file__).parent
    for group in groups or [name for name in GROUPS if (here / f"{name}.py").exists()]:
        print(f"{group} ..", flush=True)
        subprocess.run([sys.executable, "-m", f"benchmarks.{group}"], cwd=here.parent, check=True)
    parts = [path for path in map(harness.part, GROUPS) if path.exists()]
    whole = harness.RESULTS / harness.TABLE.path
    tables.gather(parts, whole)
    page.write_page(tables.read(whole))


if __name__ == "__main__":
    main(sys.argv[1:])
