"""Messages for a search that did not converge: which parameters are not determined, and what to do."""

import numpy as np

from rrru.estimation.estimate import Estimate

# a parameter has diverged where it is so many standard deviations of its prior from the prior's mean
_MAX_PRIOR_SDS = 5.0
# a parameter is not determined where this share of it is in directions that the readings do not determine
_MIN_SHARE_UNSEEN = 0.5
_MAX_NAMED = 4
_ADVICE = (
    ("reflector", "state the target's place (`targets`)"),
    ("world", "register the frame (`frame: register`)"),
    ("tool", "state the tool's place in the robot's description"),
)


def explain_end(estimate: Estimate, what: str) -> str:
    """A message for an Estimate of `what` whose search did not converge.

    It names parameters that diverged, are at a bound or are not determined, what is allowed, and what to do.
    """
    suspects = suspicious(estimate)
    found = ", ".join(f"{name} {reason}" for name, reason in list(suspects.items())[:_MAX_NAMED])
    more = f" and {len(suspects) - _MAX_NAMED} others" if len(suspects) > _MAX_NAMED else ""
    problem = f"{found}{more}" if suspects else "every parameter is determined, but no step fits the readings better"
    advice = "; ".join(dict.fromkeys(_advice(name) for name in suspects)) or (
        "check that the readings are of this robot: its lengths, the units and signs of its drives, the targets' names"
    )
    return (
        f"{what} does not converge ({estimate.end.evaluations} evaluations, {estimate.end.message}): {problem}; "
        f"allowed: readings that determine every parameter near its nominal value: {advice}"
    )


def suspicious(estimate: Estimate) -> dict[str, str]:
    """Reasons by parameter's name for which an Estimate may not be trusted: bounds, distances from the prior, rank."""
    parameters, result = estimate.parameters, {}
    off = np.abs(estimate.values - parameters.mean)
    with np.errstate(invalid="ignore"):
        far = off > _MAX_PRIOR_SDS * np.fmax(parameters.sd, parameters.wide_sd)
    unseen = undetermined(estimate)
    units = [unit for block in parameters.blocks for unit in block.units]
    for number, name in enumerate(parameters.names):
        value = f"{estimate.values[number]:.3g} {units[number]}".strip()
        if estimate.at_bound[number]:
            result[name] = f"is at its bound, {value}"
        elif far[number]:
            result[name] = f"runs away to {value}"
        elif unseen[number]:
            result[name] = "is not determined"
    return result


def undetermined(estimate: Estimate) -> np.ndarray:
    """Which parameters (p,) the readings determine no better than the prior."""
    rank = estimate.rank
    scale = np.linalg.norm(estimate.directions, axis=0)
    shares = (estimate.directions[rank:] / np.maximum(scale, 1e-300)) ** 2
    return np.asarray(shares.sum(axis=0) > _MIN_SHARE_UNSEEN)


def _advice(name: str) -> str:
    """What to do about a parameter that is not determined."""
    for site, advice in _ADVICE:
        if name.startswith(site):
            return advice
    return f"check the drives and lengths at {name}, measure poses that turn more, or fix it (`parameter_set`)"
