"""A made-up table of printers, for drawing it without calibrating any."""

import numpy as np

from tests.schemas import filled


def printers(count=8, verdicts=("reproduced", "does not belong", "reproduced", "not fitted")):
    """`printers`: the verdicts in turn; every second one has distances, one that was not fitted has no numbers."""
    rows = []
    for k in range(count):
        verdict, distances = verdicts[k % len(verdicts)], 12 * (k % 2)
        size = 1e-5 if verdict == "reproduced" else 0.5
        numbers = {
            "condition": 20.0,
            "radius_fitted_mm": 150.0,
            "radius_saved_mm": 150.0 + size,
            "noise_mm": 0.03,
            "largest_difference": size * (k + 1),
            "largest_over_stop": 1e4 * size,
            "common_arm_standard_error_mm": 3.0 + k,
            "dense_common_arm_standard_error_mm": 0.8,
            "height_rms_fitted_mm": 0.02 + 0.01 * k,
            "height_rms_saved_mm": 0.03 + 0.01 * k + size,
        }
        caliper = {"distance_rms_fitted_mm": 0.08, "distance_rms_saved_mm": 0.08 + size, "arm_standard_error_mm": 0.9}
        untested = dict.fromkeys(("suspect_p", "effector_tilt_p", "effector_tilt_power"), np.nan)
        numbers |= untested | (caliper if distances else dict.fromkeys(caliper, np.nan))
        if verdict == "not fitted":
            numbers = dict.fromkeys(numbers, np.nan)
        rows.append({"printer": f"printer_{k + 1:02d}", "verdict": verdict, "distances": distances} | numbers)
    return filled("printers", rows)
