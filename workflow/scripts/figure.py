"""Figures of the study as PDF and PNG."""

from rrru.figures.drawing import draw_all, requests
from rrru.store.job import run


def main(settings, inputs, outputs):
    """Draw the figures of the settings from the tables that they need."""
    draw_all(requests(settings["figures"], inputs, settings["options"], outputs))


if __name__ == "__main__":
    run(main, snakemake)
