"""Made-up tables of real robots, for drawing them without studying any."""

import numpy as np
import pandas as pd

from rrru.studies.real.schemas import TABLES
from tests.schemas import check


def real_tables():
    """Tables by name: an arm of two series, and one machine of which lengths are known."""
    frames = {
        "real_verdicts": pd.DataFrame([_verdict("arm_A"), _verdict("arm_B")]),
        "real_steps": pd.concat([_steps("arm_A"), _steps("arm_B")], ignore_index=True),
        "real_budget": pd.concat([_budget("arm_A"), _budget("arm_B")], ignore_index=True),
        "real_spectrum": pd.concat([_spectrum("arm_A"), _spectrum("arm_B")], ignore_index=True),
        "real_points": _points(),
        "real_parameters": _parameters(),
    }
    return {name: check(name, frame) for name, frame in frames.items()}


def _empty(table, **stated):
    """A row of a table with defaults: 1 for numbers, empty for texts."""
    columns = next(one for one in TABLES if one.name == table).columns
    values = {"str": "", "float64": 1.0, "int64": 1, "bool": True}
    return {column.name: values[column.kind] for column in columns} | stated


def _verdict(name):
    return _empty("real_verdicts", campaign=name, effects="drive_error_function+unexplained", probability=0.97)


def _steps(name):
    models = ("a", "b", "c", "c2", "d", "e", "verdict")
    return pd.DataFrame(
        [
            _empty("real_steps", campaign=name, number=k, model=model, held_out_rms_mm=1.0 / k)
            for k, model in enumerate(models, 1)
        ]
    )


def _budget(name):
    parts = {"drive_error_function": ("effect", 0.8), "scatter": ("scatter", 0.1), "unexplained": ("unexplained", 0.1)}
    return pd.DataFrame(
        [
            _empty("real_budget", campaign=name, part=part, kind=kind, share=share, share_low=0.05, share_high=0.9)
            for part, (kind, share) in parts.items()
        ]
    )


def _spectrum(name):
    return pd.DataFrame(
        [
            _empty("real_spectrum", campaign=name, joint=f"joint {joint}", order=order)
            | {"before_rad": 1e-4 * (1 + joint), "after_rad": np.nan if order == 1 else 1e-6, "found_rad": 5e-5}
            for joint in range(1, 7)
            for order in range(1, 41)
        ]
    )


def _points():
    corners = {"bl": (0.0, 0.0), "br": (3000.0, 0.0), "tr": (3000.0, 2000.0), "tl": (0.0, 2000.0)}
    return pd.DataFrame(
        [
            _empty(
                "real_points", campaign="belts", row=row, reading=reading, residual_mm=0.1 * row, bare_residual_mm=row
            )
            | {f"{prefix}{axis}_mm": 500.0 + 100.0 * row for prefix in ("", "bare_") for axis in "xyz"}
            for row in range(1, 13)
            for reading in corners
        ]
    )


def _parameters():
    corners = {"bl": (0.0, 0.0), "br": (3000.0, 0.0), "tr": (3000.0, 2000.0), "tl": (0.0, 2000.0)}
    return pd.DataFrame(
        [
            _empty(
                "real_parameters", campaign="belts", effect="calibration", parameter=f"{prefix}{name}_{axis}", unit="mm"
            )
            | {"value": value, "nominal": np.nan}
            for prefix in ("", "bare_")
            for name, place in corners.items()
            for axis, value in zip("xy", place, strict=True)
        ]
    )
