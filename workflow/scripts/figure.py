"""Figures of the study as PDF and PNG."""

from rrru.figures.drawing import draw_all


def main(settings, inputs, outputs):
    """Draw the figures of the settings from the tables that they need."""
    draw_all(settings["figures"], inputs, settings["options"], outputs)
