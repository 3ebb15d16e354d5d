"""Calibrations of one campaign, as frames: every set of trajectories by least squares and by least mean distance (the
GA's objective).
"""

import numpy as np
import pandas as pd

from rrru.campaign import measurements as rows
from rrru.errors import ConfigError, FitError
from rrru.fit.least_squares import least_squares
from rrru.fit.mean_distance import least_mean_distance
from rrru.fit.residuals import Residuals


def select(measurements, mechanism, patterns, use_near_singularity=True):
    """Residuals of the usable points on the trajectories of a set, or None where the campaign has too few of them to
    fit.
    """
    chosen = rows.on_trajectories(measurements, patterns) & rows.usable(measurements, use_near_singularity)
    if 3 * chosen.sum() < len(mechanism.parameters):
        return None
    frame = measurements.loc[chosen]
    return Residuals(mechanism, rows.actuators(frame), rows.measured(frame), rows.command(frame))


def fit_sets(measurements, mechanism, settings, noise_mm=None):
    """Fits {(set, method): Fit} of all sets of the configuration's `calibration` section that the campaign has points
    for.

    Raises ConfigError where no set matches.
    """
    fits = {}
    for name, patterns in settings["sets"].items():
        residuals = select(measurements, mechanism, patterns, settings["use_near_singularity"])
        if residuals is None:
            continue
        fit = least_squares(residuals, noise_mm, settings["loss"], settings["loss_scale_mm"])
        fits[name, "least_squares"] = fit
        fits[name, "least_mean_distance"] = least_mean_distance(residuals, fit.deviations, noise_mm)
    if not fits:
        present = ", ".join(measurements["trajectory"].unique())
        raise ConfigError(
            f"calibration.sets: no set matches the campaign's trajectories ({present}) with enough points"
        )
    return fits


def tables(campaign, fits, true_errors=None):
    """Frames by table name: calibrations, parameters, correlations, observability.

    true_errors: the virtual robot's true errors by the mechanism's names, or None where nobody knows them.
    """
    truth = true_errors or {}
    calibrations, parameters, correlations, observability = [], [], [], []
    for (name, method), fit in fits.items():
        label = {"campaign": campaign, "calibration": name, "method": method}
        calibrations.append(label | _calibration_row(fit))
        parameters.append(_parameter_rows(fit, method, truth).assign(**label))
        if method == "least_squares":
            correlations.append(_correlation_rows(fit).assign(campaign=campaign, calibration=name))
            observability.append(_observability_rows(fit).assign(campaign=campaign, calibration=name))
    return {
        "calibrations": pd.DataFrame(calibrations),
        "parameters": pd.concat(parameters, ignore_index=True),
        "correlations": pd.concat(correlations, ignore_index=True),
        "observability": pd.concat(observability, ignore_index=True),
    }


def _calibration_row(fit):
    """One row of `calibrations`."""
    ident, distance = fit.identifiability, np.linalg.norm(fit.residual_mm, axis=1)
    return {
        "points": len(distance),
        "mean_mm": distance.mean(),
        "rms_mm": fit.rms_mm,
        "max_mm": distance.max(),
        "noise_mm": fit.noise_mm,
        "noise_from": fit.noise_from,
        "rank": ident.rank,
        "condition": ident.condition,
        **{f"{key}_observability": value for key, value in ident.indices().items()},
        "evaluations": fit.evaluations,
        "parameters_at_bound": int(fit.at_bound.sum()),
    }


def _parameter_rows(fit, method, truth):
    """Rows of `parameters`; standard errors belong to least squares only."""
    names = fit.identifiability.names
    errors = fit.standard_errors if method == "least_squares" else np.full(len(names), np.nan)
    return pd.DataFrame(
        {
            "parameter": names,
            "unit": ["rad" if name.startswith("dtheta") else "mm" for name in names],
            "value": fit.deviations,
            "standard_error": np.where(np.isfinite(errors), errors, np.nan),
            "seen": [
                bool((fit.identifiability.directions[fit.identifiability.rank :, k] ** 2).sum() < 1e-8)
                for k in range(len(names))
            ],
            "at_bound": fit.at_bound,
            "true_value": [truth.get(name, np.nan) for name in names],
        }
    )


def _correlation_rows(fit):
    """Rows of `correlations`: every pair of parameters once."""
    names, matrix = fit.identifiability.names, fit.identifiability.correlations()
    pairs = [(a, b) for a in range(len(names)) for b in range(a)]
    return pd.DataFrame(
        {
            "parameter_a": [names[b] for a, b in pairs],
            "parameter_b": [names[a] for a, b in pairs],
            "correlation": [matrix[a, b] for a, b in pairs],
        }
    )


def _observability_rows(fit):
    """Rows of `observability`: how each direction of parameter space is seen, and what it is made of."""
    ident = fit.identifiability
    count = len(ident.names)
    return pd.DataFrame(
        {
            "direction": np.repeat(np.arange(1, count + 1), count),
            "singular_value": np.repeat(ident.singular_values, count),
            "standard_error_mm": np.repeat(
                [fit.noise_mm / s if k < ident.rank else np.nan for k, s in enumerate(ident.singular_values)], count
            ),
            "parameter": np.tile(ident.names, count),
            "weight": ident.directions.ravel(),
        }
    )


def errors_vector(parameters, calibration, method, mechanism):
    """Errors (p,) of one calibration out of a `parameters` frame; raises FitError where it is not there."""
    chosen = parameters[(parameters["calibration"] == calibration) & (parameters["method"] == method)]
    if chosen.empty:
        raise FitError(f"no calibration {calibration!r} by {method!r}")
    return mechanism.parameters.vector(dict(zip(chosen["parameter"], chosen["value"], strict=True)))
