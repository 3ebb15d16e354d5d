"""Every number that paper C still prints: Sun, Wang, Mei, Zhang, Liu, Tianjin University: zero calibration of a Delta
robot by vision.

The scan has lost its section numbers, the bodies of its displayed equations and the values of its Table 1; see the
audit.
"""

from math import pi

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
