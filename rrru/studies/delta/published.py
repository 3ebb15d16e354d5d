"""Every number that paper C still prints, and its comparison with this study's.

Paper C is Sun, Wang, Mei, Zhang, Liu, Tianjin University: zero calibration of a Delta robot by vision. The scan has
lost its section numbers, the bodies of its displayed equations and the values of its Table 1; see the audit.
"""

from math import pi

import numpy as np

from rrru.robots.delta import Delta
from rrru.studies import paper
from rrru.studies.paper import numbers

_SIGN = "the scan prints the minus sign as a question mark; see the audit"
_ANGLES = {"beta1_rad": -pi / 6.0, "beta2_rad": pi / 2.0, "beta3_rad": 7.0 * pi / 6.0}

DESIGN = (
    *numbers("Fig. 1", "1", legs=3.0),
    *numbers("structure angles, Fig. 2", "rad", _SIGN, **_ANGLES),
    *numbers("eq. (15)", "1", "printed as 'at least'", least_poses=4.0),
    *numbers("Fig. 6", "1", "the scan prints '4055x'", target_dots_across=40.0, target_dots_along=55.0),
    *numbers("Fig. 6", "mm", dot_diameter_mm=5.0, dot_pitch_mm=10.0),
    *numbers("lens M1614-MP", "mm", "from the lens's name", focal_length_mm=16.0),
    *numbers("calibration experiment", "1", "spread evenly", poses=20.0),
    *numbers("calibration experiment", "mm", calibration_height_mm=100.0),
    *numbers("Figs. 7 and 8", "mm", checked_height_mm=0.0),
)
RESULTS = (
    *numbers("text at Fig. 7", "mm", "z = 0, laser tracker", before_max=1.442, before_mean=0.932),
    *numbers("text at Fig. 8", "mm", "z = 0, laser tracker", after_max=0.374, after_mean=0.211),
    *numbers("conclusion (2)", "mm", "the mean, rounded", before_about=0.9, after_about=0.2),
)
NUMBERS = DESIGN + RESULTS
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
