"""One page of what a run has written, or of one campaign."""

from rrru.report import page
from rrru.store.job import run


def main(settings, inputs, outputs):
    """Write the page; what lies in the results' folder is shown, whether this run has made it or an earlier one."""
    page.write(settings["results"], outputs["report"], settings["reproduced"], settings.get("campaign"))


if __name__ == "__main__":
    run(main, snakemake)
