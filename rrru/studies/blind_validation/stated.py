"""What a diagnosis states of a robot, made without the truth: its causes, corrected model and numbers. mm, rad."""

import json

import numpy as np
import pandas as pd

from rrru.diagnosis.state import ModelState

# between members of a group, as in gap_verdicts
BETWEEN = " | "
# columns that a verdict is scored by, and columns that show whether it is ambiguous
VERDICT = [
    "effects",
    "probability",
    "leg",
    "gap_rms_mm",
    "noise_rms_mm",
    "share_closed",
    "confounded_with",
    "next_runs",
]
# effect models whose parameters specify a machine part; phases and shapes do not
_EFFECTS = ("backlash", "drive_compliance", "link_flexure", "joint_clearance", "thermal_growth", "servo_lag")
_SIGMAS = 1.96


def stated(robot, diagnosis):
    """Frame `withheld_stated` of a robot, one row for each tested effect, from its Diagnosis.

    The probability is the posterior probability, whatever the decision is.
    """
    inference, verdict = diagnosis.inference, diagnosis.decided
    rows = []
    for name in inference.problem.effects:
        group = verdict.group_of(name)
        probability = min(inference.posterior.marginal(name), 1.0)
        rows.append((robot, name, probability, verdict.decision(name), BETWEEN.join(group.names) if group else ""))
    return pd.DataFrame(rows, columns=["robot", "effect", "probability", "decision", "group"])


def state_row(robot, calibrated, state, library, numbers="[]"):
    """Row of `withheld_states` from calibrated deviations (p,), state of the corrected model and its fitted numbers.

    library: effects by name as the diagnosis fitted them.
    """
    effects = [
        [name, int(shape), _saved(library[name].coordinates, value).tolist(), library[name].waves]
        for (name, shape), value in sorted(state.effects.items())
    ]
    return {
        "robot": robot,
        "calibrated": json.dumps(np.asarray(calibrated).tolist()),
        "deviations": json.dumps(np.asarray(state.deviations).tolist()),
        "fitted_effects": json.dumps(effects),
        "shapes": json.dumps(state.shape_values, sort_keys=True),
        "numbers": numbers,
    }


def state_of(row, library):
    """Calibrated deviations (p,), state of the corrected model and its effects by name from a row of `withheld_states`.

    library: effects by name; those with waves that a campaign has chosen are made from them.
    """
    saved = {key: json.loads(row[key]) for key in ("calibrated", "deviations", "fitted_effects", "shapes")}
    values = {(name, shape): np.array(value) for name, shape, value, _ in saved["fitted_effects"]}
    effects = {
        name: library[name].with_waves(tuple(map(tuple, waves))) if waves else library[name]
        for name, _, _, waves in saved["fitted_effects"]
    }
    return np.array(saved["calibrated"]), ModelState(np.array(saved["deviations"]), values, saved["shapes"]), effects


def _saved(coordinates, value):
    """Values of an effect's coordinates; of coordinates that a campaign has chosen, those that they represent."""
    return np.asarray(coordinates.to_values(value, coordinates.shapes[0]) if coordinates.sized else value)


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
