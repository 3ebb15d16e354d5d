"""Every number that paper C still prints: Sun, Wang, Mei, Zhang, Liu, Tianjin University: zero calibration of a Delta
robot by vision.

The scan has lost its section numbers, the bodies of its displayed equations and the values of its Table 1; see the
audit.
"""

from math import pi

from rrru.studies.rrru3.paper_a import Number

_SIGN = "the scan prints the minus sign as a question mark; see the audit"

DESIGN = (
    Number("legs", "Fig. 1", "1", 3.0),
    Number("beta1_rad", "structure angles, Fig. 2", "rad", -pi / 6.0, _SIGN),
    Number("beta2_rad", "structure angles, Fig. 2", "rad", pi / 2.0, _SIGN),
    Number("beta3_rad", "structure angles, Fig. 2", "rad", 7.0 * pi / 6.0, _SIGN),
    Number("least_poses", "eq. (15)", "1", 4.0, "printed as 'at least'"),
    Number("target_dots_across", "Fig. 6", "1", 40.0, "the scan prints '4055x'"),
    Number("target_dots_along", "Fig. 6", "1", 55.0, "the scan prints '4055x'"),
    Number("dot_diameter_mm", "Fig. 6", "mm", 5.0),
    Number("dot_pitch_mm", "Fig. 6", "mm", 10.0),
    Number("focal_length_mm", "lens M1614-MP", "mm", 16.0, "from the lens's name"),
    Number("poses", "calibration experiment", "1", 20.0, "spread evenly"),
    Number("calibration_height_mm", "calibration experiment", "mm", 100.0),
    Number("checked_height_mm", "Figs. 7 and 8", "mm", 0.0),
)
RESULTS = (
    Number("before_max", "text at Fig. 7", "mm", 1.442, "z = 0, laser tracker"),
    Number("before_mean", "text at Fig. 7", "mm", 0.932, "z = 0, laser tracker"),
    Number("after_max", "text at Fig. 8", "mm", 0.374, "z = 0, laser tracker"),
    Number("after_mean", "text at Fig. 8", "mm", 0.211, "z = 0, laser tracker"),
    Number("before_about", "conclusion (2)", "mm", 0.9, "the mean, rounded"),
    Number("after_about", "conclusion (2)", "mm", 0.2, "the mean, rounded"),
)
NUMBERS = DESIGN + RESULTS
