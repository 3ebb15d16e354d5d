"""Every number that paper C still prints, and its comparison with this study's.

Paper C is Sun, Wang, Mei, Zhang, Liu, Tianjin University: zero calibration of a Delta robot by vision. The scan has
lost its section numbers, the bodies of its displayed equations and the values of its Table 1; see `lost.csv`. The
numbers are in `numbers.csv`.
"""

from pathlib import Path

import numpy as np

from rrru.robots.delta import Delta
from rrru.studies import paper
from rrru.studies.paper import read_numbers

_PARTS = read_numbers(Path(__file__).with_name("numbers.csv"))
RESULTS = _PARTS["results"]
NUMBERS = _PARTS["design"] + RESULTS
# before calibration, and after the paper's single linear step in its own calibration frame
_VARIANTS = {"before": "none", "after": "paper"}


def published_rows(section, points, camera, draws):
    """Rows of `published` for paper C.

    section: the configuration's `delta`; points, camera, draws: the tables delta_points, delta_camera and delta_draws.
    """
    here, spread, drawn = _design(section, camera), {}, draws.set_index("variant")
    for label, variant in _VARIANTS.items():
        size = points.loc[points["variant"] == variant, "error_mm"].to_numpy()
        for item, value, kind in (
            ("max", size.max(), "max"),
            ("mean", size.mean(), "mean"),
            ("about", size.mean(), "mean"),
        ):
            here[f"{label}_{item}"] = value
            columns = [f"plane_{kind}_{end}_mm" for end in ("median", "low", "high")]
            spread[f"{label}_{item}"] = tuple(drawn.loc[variant, columns])
    return paper.published_rows("C", NUMBERS, here, spread)


def _design(section, camera):
    """Configured numbers of robot, target and poses, and the calibrated focal length."""
    azimuth = Delta().azimuth_rad
    focal_px = camera.set_index("parameter").loc["focal_x_px", "found"]
    return {
        **{f"beta{leg}_rad": angle for leg, angle in enumerate(azimuth, start=1)},
        "legs": len(azimuth),
        "target_dots_across": section["target"]["rows"],
        "target_dots_along": section["target"]["columns"],
        "dot_diameter_mm": section["target"]["diameter_mm"],
        "dot_pitch_mm": section["target"]["pitch_mm"],
        "focal_length_mm": focal_px * section["camera"]["pixel_mm"],
        "poses": np.prod(section["poses"]["counts"]),
        "calibration_height_mm": section["poses"]["z_mm"],
        "checked_height_mm": section["plane"]["z_mm"],
    }
