"""Corrected models as rows of a table. Lengths mm, angles rad."""

import json

import numpy as np

from rrru.diagnosis.state import State

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


def state_row(robot, calibrated, state, library, numbers="[]"):
    """Row of `withheld_states` from calibrated deviations (p,), State of the corrected model and its fitted numbers.

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
    """Calibrated deviations (p,), State of the corrected model and its effects by name from a row of `withheld_states`.

    library: effects by name; those with waves that a campaign has chosen are made from them.
    """
    saved = {key: json.loads(row[key]) for key in ("calibrated", "deviations", "fitted_effects", "shapes")}
    values = {(name, shape): np.array(value) for name, shape, value, _ in saved["fitted_effects"]}
    effects = {
        name: library[name].with_waves(tuple(map(tuple, waves))) if waves else library[name]
        for name, _, _, waves in saved["fitted_effects"]
    }
    return np.array(saved["calibrated"]), State(np.array(saved["deviations"]), values, saved["shapes"]), effects


def _saved(coordinates, value):
    """Values of an effect's coordinates; of mixtures that a campaign has chosen, of the effect as the library has it."""
    return np.asarray(coordinates.to_values(value, coordinates.shapes[0]) if coordinates.sized else value)
