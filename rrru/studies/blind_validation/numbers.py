"""Coverage of the diagnosis' 95 % intervals for the parameters of the causes that it names, in their own units."""

import json

import numpy as np

# effect models whose parameters specify a machine part; phases and shapes do not
_EFFECTS = ("backlash", "drive_compliance", "link_flexure", "joint_clearance", "thermal_growth", "servo_lag")
_SIGMAS = 1.96


def fitted(parameters):
    """JSON of the rows of `gap_parameters` with a standard error, not at a bound: effect, parameter, value, error."""
    estimated = parameters[parameters["standard_error"].notna() & ~parameters["at_bound"].astype(bool)]
    return json.dumps(estimated[["effect", "parameter", "value", "standard_error"]].to_numpy().tolist())


def held(estimates, truth):
    """How many true numbers have an interval, and how many of these lie inside it.

    estimates: as `fitted` writes them; truth: values by effect and parameter.
    """
    off = [
        abs(value - truth[effect][parameter]) / error
        for effect, parameter, value, error in json.loads(estimates)
        if effect in _EFFECTS and effect in truth
    ]
    return len(off), int((np.array(off) <= _SIGMAS).sum())
