"""What the corrections of one experiment are worth away from the curve that they were learned on. Lengths in mm."""

import numpy as np
import pandas as pd

from rrru.errors import UnreachableError
from rrru.studies.ptt3 import experiments as robot
from rrru.studies.ptt3.driving import driven
from rrru.studies.ptt3.results import AXES, along_axes, benefit

METHODS = ("rbf_inverse", "rbf_paper_mm", "parameters", "rbf_after_parameters")


def changes(config, payload_kg):
    """Changed tasks as (family, size, plan of one pass): the curve again, wider, higher or lower, backwards, under
    another payload.
    """
    section = config["ptt"]["extrapolation"]
    yield "none", 0.0, robot.plan(config, payload_kg, repeats=1)
    for size in section["radius_mm"]:
        yield "radius_mm", size, robot.plan(config, payload_kg, robot.curve(config, radius_mm=size), repeats=1)
    for size in section["height_mm"]:
        yield "height_mm", size, robot.plan(config, payload_kg, robot.curve(config, height_mm=size), repeats=1)
    yield "reverse", 0.0, robot.plan(config, payload_kg, reverse=(True,), repeats=1)
    for load in section["payload_kg"]:
        if load != payload_kg:
            yield "payload_kg", load - payload_kg, robot.plan(config, load, repeats=1)


def extrapolations(config, experiment, widths_mm, controllers):
    """Rows of `ptt_extrapolation` without the experiment: benefits on every changed task that is within reach, all
    points together.
    """
    nominal, result = experiment.robot.mechanism.inverse, []
    used = {"before": nominal} | {name: controllers[name] for name in METHODS}
    for family, size, plan in changes(config, experiment.payload_kg):
        try:
            errors = driven(config, experiment, widths_mm, used, plan=plan)
        except UnreachableError:
            # a larger curve may leave the workspace; its rows are absent
            continue
        before = along_axes(errors["before"])
        for method in METHODS:
            after = along_axes(errors[method])
            result.append(
                pd.DataFrame(
                    {
                        "family": family,
                        "size": size,
                        "method": method,
                        "axis": AXES,
                        "before_mm": np.abs(before).mean(axis=0),
                        "after_mm": np.abs(after).mean(axis=0),
                        "benefit_percent": benefit(before.T, after.T),
                    }
                )
            )
    return pd.concat(result, ignore_index=True)
