"""What else an experiment might have shown: other noise and another split, and the curve begun elsewhere. Lengths in
mm.
"""

import pandas as pd

from rrru.studies.ptt3 import experiments as robot
from rrru.studies.ptt3.controllers import learning
from rrru.studies.ptt3.driving import driven, mean_noise, true_errors
from rrru.studies.ptt3.results import benefits

# those that the study rests on; all eight would take three times as long
METHODS = ("rbf_inverse", "rbf_jacobian", "rbf_absolute", "parameters")
_LEVELS = {"benefit_low_percent": 0.05, "benefit_high_percent": 0.95}
_KEYS = ["method", "set", "axis"]


def drawn(config, experiment, widths_mm, names, labels):
    """`results.benefits` of some methods, everything that is random drawn from the experiment's streams of those
    labels.

    That is the noise before and after, the training points, and the folds.
    """
    plan = robot.plan(config, experiment.payload_kg, repeats=1)
    inverse, extra = experiment.robot.mechanism.inverse, config["ptt"]["curve"]["run_up_points"]
    command = plan.targets()[extra : -extra or None]
    error = true_errors(config, experiment, widths_mm, inverse, plan) + mean_noise(
        config, experiment.generator("measure", *labels)
    )
    learned = learning(config, experiment, (command, inverse(command), command + error), labels)
    controllers = learned.controllers()
    return benefits(
        learned, driven(config, experiment, widths_mm, {name: controllers[name] for name in names}, labels, plan)
    )


def with_ranges(config, experiment, widths_mm, benefit):
    """Rows of `ptt_benefit` without the experiment: `results.benefits` with the range over redraws, null for the
    methods not redrawn.
    """
    frames = [
        drawn(config, experiment, widths_mm, METHODS, ("redraw", draw)) for draw in range(config["ptt"]["redraws"])
    ]
    groups = pd.concat(frames).groupby(_KEYS)["benefit_percent"]
    ranges = pd.DataFrame({name: groups.quantile(level) for name, level in _LEVELS.items()})
    return benefit.merge(ranges, "left", left_on=_KEYS, right_index=True)


def starts(config, name, widths_mm):
    """Rows of `ptt_start` for an experiment: the paper's way with the curve begun at other azimuths, one draw each,
    test points.
    """
    frames = []
    for start in config["ptt"]["starts_deg"]:
        curve = config["ptt"]["curve"] | {"start_deg": start}
        other = config | {"ptt": config["ptt"] | {"curve": curve}}
        frame = drawn(other, robot.experiment(other, name), widths_mm, ("rbf_jacobian",), ("start", start))
        frames.append(frame[frame["set"] == "test"].assign(start_deg=start))
    return pd.concat(frames, ignore_index=True).drop(columns=["method", "set"])
