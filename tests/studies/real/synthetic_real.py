"""Made-up tables of real robots, for drawing them without studying any."""

from itertools import product

import numpy as np

from tests.schemas import filled

_SERIES = ("arm_A", "arm_B")
_CORNERS = {"bl": (0.0, 0.0), "br": (3000.0, 0.0), "tr": (3000.0, 2000.0), "tl": (0.0, 2000.0)}
_PARTS = {"drive_error_function": ("effect", 0.8), "scatter": ("scatter", 0.1), "unexplained": ("unexplained", 0.1)}


def real_tables():
    """Tables by name: an arm of two series, and one machine of which lengths are known."""
    rows = {
        "real_verdicts": [
            {"campaign": name, "effects": "drive_error_function+unexplained", "probability": 0.97} for name in _SERIES
        ],
        "real_steps": [
            {"campaign": name, "number": k, "model": model, "held_out_rms_mm": 1.0 / k}
            for name, (k, model) in product(_SERIES, enumerate(("a", "b", "c", "c2", "d", "e", "verdict"), 1))
        ],
        "real_budget": [
            {"campaign": name, "part": part, "kind": kind, "share": share, "share_low": 0.05, "share_high": 0.9}
            for name, (part, (kind, share)) in product(_SERIES, _PARTS.items())
        ],
        "real_spectrum": [
            {"campaign": name, "joint": f"joint {joint}", "order": order}
            | {"before_rad": 1e-4 * (1 + joint), "after_rad": np.nan if order == 1 else 1e-6, "found_rad": 5e-5}
            for name, joint, order in product(_SERIES, range(1, 7), range(1, 41))
        ],
        "real_points": [
            {"campaign": "belts", "row": row, "reading": reading, "residual_mm": 0.1 * row, "bare_residual_mm": row}
            | {f"{prefix}{axis}_mm": 500.0 + 100.0 * row for prefix in ("", "bare_") for axis in "xyz"}
            for row, reading in product(range(1, 13), _CORNERS)
        ],
        "real_parameters": [
            {"campaign": "belts", "effect": "calibration", "parameter": f"{prefix}{name}_{axis}", "unit": "mm"}
            | {"value": value, "nominal": np.nan}
            for prefix, (name, place) in product(("", "bare_"), _CORNERS.items())
            for axis, value in zip("xy", place, strict=True)
        ],
    }
    return {name: filled(name, part) for name, part in rows.items()}
