"""Whether the best answer of a diagnosis describes its readings at all. Lengths in mm, angles in rad."""

import numpy as np

from rrru.campaign.noise import repeat_noise
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.problem import GEOMETRY


def why_no_answer(inference, stated_mm=None):
    """Why no cause can be named, in words; empty where the fit of the best answer may be read.

    A fit whose geometric errors end at their bounds has its minimum outside of all plausible robots. A fit with
    residuals of many times the noise has a model of another robot, or readings of another campaign. stated_mm: noise
    per axis, None where it is not stated.
    """
    return "; ".join(filter(None, (_at_bounds(inference), _far_off(inference, stated_mm))))


def _at_bounds(inference):
    """Which geometric errors end at bounds, in words; empty where none."""
    estimate, parameters = inference.fit.estimate, inference.case.mechanism.parameters
    held = np.flatnonzero(estimate.at_bound[estimate.parameters.places[GEOMETRY]])
    if not len(held):
        return ""
    values = estimate.block(GEOMETRY)
    shown = [
        f"{parameters.names[k]} = {values[k]:.3g} {parameters.units[k]}" for k in held[: OPTIONS.max_listed_numbers]
    ]
    more = f" and {len(held) - len(shown)} more" if len(held) > len(shown) else ""
    return f"the fit ends at bounds of calibration parameters ({', '.join(shown)}{more})"


def _far_off(inference, stated_mm):
    """How far the best answer is from the readings, in words; empty where that is less than many times the noise."""
    case = inference.case
    left = float(np.sqrt((case.residual(inference.state) ** 2).sum(axis=1).mean()))
    repeated, count = repeat_noise(case.measurements[case.used])
    axis_mm = max(stated_mm or case.noise_mm, repeated if count else 0.0)
    noise = float(np.sqrt(3.0) * axis_mm)
    if left <= OPTIONS.max_left_per_noise * noise:
        return ""
    return f"the residual of the best answer is {left:.3g} mm rms, {left / noise:.0f} times the noise of {noise:.2g} mm"
