"""Sentences on what a fit found of the robot beside its effects."""

# standard errors from which on the weight is surely off
_SURE = 3.0


def weight_notes(attribution):
    """Sentences on what the weight is surely off by."""
    for name, unit, value, error in attribution.fit.weight:
        if abs(value) > _SURE * error:
            what = "more at the platform" if unit == "kg" else f"that the base leans about {name[-1]}"
            yield f"weight not as told: {value:.3g} +- {error:.2g} {unit} {what}"


def fit_notes(attribution):
    """Sentences on a fit that did not converge."""
    end, terms = attribution.fit.estimate.end, attribution.fit.terms
    if not end.converged:
        names = ", ".join(term.effect for term in terms) or "the calibration"
        yield f"the fit of {names} did not converge ({end.message}): its numbers are preliminary"
