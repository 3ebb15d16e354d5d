"""Whether the diagnosis' 95 % intervals hold the true numbers of what it names. Units of the laws' parameters."""

import json

import numpy as np

# laws whose numbers are what a part is bought by, and no phase or shape
_LAWS = ("backlash", "drive_compliance", "link_flexure", "joint_clearance", "thermal_growth", "servo_lag")
_SIGMAS = 1.96


def fitted(parameters):
    """JSON of the rows of `gap_parameters` with a standard error, not at a bound: effect, parameter, value, error."""
    kept = parameters[parameters["standard_error"].notna() & ~parameters["at_bound"].astype(bool)]
    return json.dumps(kept[["effect", "parameter", "value", "standard_error"]].to_numpy().tolist())


def held(told, truth):
    """How many true numbers have an interval, and how many of these are in it.

    told: as `fitted` writes it; truth: values by effect and parameter. What the robot lacks counts where it is named.
    """
    off = [
        abs(value - truth[effect][parameter]) / error
        for effect, parameter, value, error in json.loads(told)
        if effect in _LAWS and effect in truth
    ]
    return len(off), int((np.array(off) <= _SIGMAS).sum())
