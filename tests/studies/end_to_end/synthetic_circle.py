"""Made-up tables of the whole circle, for drawing them without driving anything."""

import numpy as np
import pandas as pd

from rrru.studies.end_to_end.models import sizes
from tests.schemas import check

_SIZES_MM = {"given": 0.3, "calibrated": 0.1, "corrected": 0.02}


def circle_tables():
    """`circle` and `circle_points` of 20 points."""
    wave, number = 1.0 + 0.4 * np.sin(np.arange(20.0)), np.arange(1, 21)
    named = pd.DataFrame({"run": 1, "trajectory": "line_1", "point": number})
    frames = []
    for model, size in _SIZES_MM.items():
        error = {"error_x_mm": size * wave, "error_y_mm": 0.0, "error_z_mm": 0.0, "error_mm": size * wave}
        frames.append(named.assign(model=model, **error))
    points = check("circle_points", pd.concat(frames, ignore_index=True))
    whole = sizes(points, "backlash", 0.01).assign(diagnosed="second", fresh="third")
    return {"circle": check("circle", whole), "circle_points": points}
