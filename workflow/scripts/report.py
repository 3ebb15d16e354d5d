"""One page of the results of a run, or of one campaign."""

from rrru.report import page
from rrru.store.job import run


def main(settings, inputs, outputs):
    """Write the page with the contents of the results' folder, from this run or an earlier one."""
    page.write(settings["results"], outputs["report"], settings["reproduced"], settings.get("campaign"))


if __name__ == "__main__":
    run(main, snakemake)
