"""The robot driven again, with what was learned. Lengths in mm.

# ASSUME passes in one direction differ by the tracker's noise alone: the run-up takes up the play, and no effect
drifts. So one pass is driven # and gets the noise of a mean over the configured repeats.
"""

import numpy as np

from rrru.studies.ptt3 import experiments as robot


def mean_noise(config, generator):
    """Tracker noise (n, 3) of the curve's points, each the mean over the configured repeats."""
    section = config["ptt"]
    return (
        section["noise_mm"] / np.sqrt(section["repeats"]) * generator.standard_normal((section["curve"]["points"], 3))
    )


def true_errors(config, experiment, widths_mm, sliders, plan):
    """Errors (n, 3) without noise of the curve's points in a plan of one pass; raises UnreachableError."""
    extra = config["ptt"]["curve"]["run_up_points"]
    return (experiment.positions(widths_mm, sliders, plan) - plan.targets())[extra : -extra or None]


def driven(config, experiment, widths_mm, controllers, labels=(), plan=None):
    """Errors (n, 3) of the point means with every controller, by name; raises UnreachableError.

    plan: one pass along another curve or under another payload. Every method gets the same noise, from the experiment's
    stream of that label, so that differences are the methods'.
    """
    plan = plan or robot.plan(config, experiment.payload_kg, repeats=1)
    noise = mean_noise(config, experiment.generator("closed_loop", *labels))
    return {
        name: true_errors(config, experiment, widths_mm, sliders, plan) + noise for name, sliders in controllers.items()
    }
