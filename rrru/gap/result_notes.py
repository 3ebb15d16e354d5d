"""Sentences on what a fit found of the robot apart from its effects."""

from rrru.campaign.noise import repeat_noise
from rrru.gap.options import OPTIONS

# said where a part of the gap looks like random error and no pose was measured under the same conditions again
REPEATABILITY_UNKNOWN = "repeatability is unknown: no pose was measured twice"


def weight_notes(attribution):
    """Sentences on what the weight is surely off by."""
    for name, unit, value, error in attribution.fit.weight:
        if abs(value) > OPTIONS.min_nuisance_z * error:
            what = "more at the platform" if unit == "kg" else f"that the base leans about {name[-1]}"
            yield f"weight not as told: {value:.3g} +- {error:.2g} {unit} {what}"


def measured_again(case):
    """Whether poses of a Case were measured more than once under the same conditions."""
    return repeat_noise(case.measurements[case.used])[1] > 0


def noise_notes(case, stated_mm, contradicted):
    """Sentences on a noise that contradicts the stated one (mm per axis) by more than a factor."""
    if not stated_mm:
        return
    found = f"noise stated {stated_mm:.3g} mm per axis, found {case.noise_mm:.3g}"
    if case.noise_mm > contradicted * stated_mm:
        if measured_again(case):
            yield f"{found}: the robot does not repeat, or the instrument is worse"
        else:
            yield f"{found}: the instrument is worse, or the robot has errors that are not in the model"
            yield REPEATABILITY_UNKNOWN
    elif case.noise_mm < stated_mm / contradicted:
        yield f"{found}: the instrument is better"


def fit_notes(attribution):
    """Sentences on a fit that did not converge."""
    end, terms = attribution.fit.estimate.end, attribution.fit.terms
    if not end.converged:
        names = ", ".join(term.effect for term in terms) or "the calibration"
        yield f"the fit of {names} did not converge ({end.message}): its numbers are preliminary"
