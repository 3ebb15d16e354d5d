"""Corrected sims as rows of a table. Lengths mm, angles rad."""

import json

import numpy as np

from rrru.diagnosis.state import State

# what a verdict is scored by, and what tells whether it is ambiguous
VERDICT = [
    "effects",
    "probability",
    "leg",
    "gap_rms_mm",
    "noise_rms_mm",
    "share_closed",
    "confusable_with",
    "next_runs",
]


def state_row(robot, calibrated, state, library, numbers="[]"):
    """Row of `withheld_states` from the calibrated deviations (p,), the corrected sim and its numbers' errors.

    library: effects by name as the diagnosis fitted them.
    """
    effects = [
        [name, int(shape), np.asarray(value).tolist(), library[name].waves]
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
    """Calibrated deviations (p,) and corrected sim of a row of `withheld_states`, and its effects by name.

    library: effects by name, from which those are made that a campaign has chosen the waves of.
    """
    told = {key: json.loads(row[key]) for key in ("calibrated", "deviations", "fitted_effects", "shapes")}
    effects = {(name, shape): np.array(value) for name, shape, value, _ in told["fitted_effects"]}
    laws = {name: _as_fitted(library[name], len(value), waves) for name, _, value, waves in told["fitted_effects"]}
    return np.array(told["calibrated"]), State(np.array(told["deviations"]), effects, told["shapes"]), laws


def _as_fitted(effect, count, waves):
    """The effect with the waves that were found, or with so many coefficients."""
    if waves:
        return effect.with_waves(tuple(map(tuple, waves)))
    return effect if effect.coarser is None else effect.coarser(count)
