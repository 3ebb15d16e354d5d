"""Calibrations of one campaign, as frames: every set of trajectories by least squares and by least mean distance."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
import pandas as pd

from rrru.calibration.calibrate import Calibration, calibrate
from rrru.calibration.mean_distance import least_mean_distance
from rrru.campaign import measurements as rows
from rrru.errors import ConfigError, FitError
from rrru.estimation.observations.target_positions import TargetPositions
from rrru.estimation.starts import register_measurements
from rrru.kinematics.robot import Robot


@dataclass(frozen=True)
class CalibrationSettings:
    """Sets {name: patterns of trajectories}, loss and its scale as in `calibrate`, and which points may be used."""

    sets: Mapping[str, tuple[str, ...]]
    loss: str = "linear"
    loss_scale_mm: float = 0.1
    use_near_singularity: bool = True

    @classmethod
    def from_config(cls, section: Mapping[str, Any]) -> Self:
        """From the configuration's `calibration` section."""
        return cls(**{entry.name: section[entry.name] for entry in fields(cls) if entry.name in section})


def select(
    measurements: pd.DataFrame,
    mechanism: Robot,
    patterns: Iterable[str],
    use_near_singularity: bool = True,
    characteristic_length_mm: float = np.nan,
) -> TargetPositions | None:
    """The usable points on some trajectories, None where the campaign has too few of them to fit.

    characteristic_length_mm: length that makes measured orientations comparable with positions.
    """
    chosen = rows.on_trajectories(measurements, patterns) & rows.usable(measurements, use_near_singularity)
    if not chosen.any():
        return None
    frame = register_measurements(measurements.loc[chosen], mechanism)
    actuators, command = rows.actuators(frame, mechanism), rows.command(frame)
    readings = rows.readings(frame, characteristic_length_mm)
    mechanism = mechanism.with_identifiable_parameters(actuators, command, readings)
    if 3 * len(frame) < len(mechanism.parameters):
        return None
    return TargetPositions(mechanism, actuators, rows.measured(frame), command, readings)


def fit_sets(
    measurements: pd.DataFrame,
    mechanism: Robot,
    settings: CalibrationSettings,
    noise_mm: float | None = None,
    characteristic_length_mm: float = np.nan,
) -> dict[tuple[str, str], Calibration]:
    """{(set, method): Calibration} of all sets of the CalibrationSettings that the campaign has points for.

    By least squares, and by least mean distance where the genetic algorithm knows the robot. noise_mm,
    characteristic_length_mm: of the campaign, see `rrru.calibration.campaign_noise.Noise`. Raises ConfigError where no
    set matches.
    """
    fits = {}
    for name, patterns in settings.sets.items():
        residuals = select(measurements, mechanism, patterns, settings.use_near_singularity, characteristic_length_mm)
        if residuals is not None:
            fit = calibrate(residuals, noise_mm, settings.loss, settings.loss_scale_mm)
            fits[name, "least_squares"] = fit
            if mechanism.SEARCHED:
                # the optimum of the genetic algorithm is not needed where the algorithm is left out
                fits[name, "least_mean_distance"] = least_mean_distance(residuals, fit.deviations, noise_mm)
    if not fits:
        present = f"the campaign's trajectories ({', '.join(measurements['trajectory'].unique())})"
        raise ConfigError(f"calibration.sets: no set matches {present} with enough points")
    return fits


def tables(
    campaign: str, fits: Mapping[tuple[str, str], Calibration], truth: Mapping[str, float] | None = None
) -> dict[str, pd.DataFrame]:
    """Frames by table name: calibrations, parameters, correlations, observability.

    truth: the virtual robot's true deviations by the mechanism's names, or None where they are unknown.
    """
    names = ("calibrations", "parameters", "correlations", "observability")
    frames: dict[str, list[pd.DataFrame]] = {name: [] for name in names}
    for (calibration, method), fit in fits.items():
        label = {"campaign": campaign, "calibration": calibration}
        parts = {"calibrations": _calibration_row(fit), "parameters": _parameter_rows(fit, method, truth or {})}
        parts = {name: part.assign(**label, method=method) for name, part in parts.items()}
        if method == "least_squares":
            parts["correlations"] = _correlation_rows(fit).assign(**label)
            parts["observability"] = _observability_rows(fit).assign(**label)
        for name, part in parts.items():
            frames[name].append(part)
    return {name: pd.concat(parts, ignore_index=True) for name, parts in frames.items()}


def _calibration_row(fit: Calibration) -> pd.DataFrame:
    """One row of `calibrations`."""
    ident, distance = fit.identifiability, fit.distance_mm
    row = {
        "points": len(distance),
        "mean_mm": distance.mean(),
        "rms_mm": fit.rms_mm,
        "max_mm": distance.max(),
        "turn_rms_rad": fit.turn_rms_rad,
        "noise_mm": fit.noise_mm,
        # what a calibration is given is the noise of the campaign, which may itself be an estimate
        "noise_from": "campaign" if fit.noise_from == "given" else fit.noise_from,
        "rank": ident.rank,
        "condition": ident.condition,
        "evaluations": fit.evaluations,
        "parameters_at_bound": int(fit.at_bound.sum()),
    }
    return pd.DataFrame([row | {f"{key}_observability": value for key, value in ident.indices().items()}])


def _parameter_rows(fit: Calibration, method: str, truth: Mapping[str, float]) -> pd.DataFrame:
    """Rows of `parameters`; standard errors belong to least squares only."""
    ident, parameters = fit.identifiability, fit.parameters
    stated = np.isfinite(fit.standard_errors) & (method == "least_squares")
    return pd.DataFrame(
        {
            "parameter": parameters.names,
            "unit": parameters.units,
            "value": fit.deviations,
            "standard_error": np.where(stated, fit.standard_errors, np.nan),
            "seen": ~ident.unseen,
            "at_bound": fit.at_bound,
            "true_value": [truth.get(name, np.nan) for name in parameters.names],
        }
    )


def _correlation_rows(fit: Calibration) -> pd.DataFrame:
    """Rows of `correlations`: every pair of parameters once."""
    names, matrix = np.array(fit.identifiability.names), fit.identifiability.correlations()
    second, first = np.tril_indices(len(names), -1)
    columns = {"parameter_a": names[first], "parameter_b": names[second], "correlation": matrix[second, first]}
    return pd.DataFrame(columns)


def _observability_rows(fit: Calibration) -> pd.DataFrame:
    """Rows of `observability`: singular value of each direction of parameter space, and its entries."""
    ident = fit.identifiability
    count, values = len(ident.names), ident.singular_values
    with np.errstate(divide="ignore"):
        along = np.where(np.arange(count) < ident.rank, fit.noise_mm / values, np.nan)
    return pd.DataFrame(
        {
            "direction": np.repeat(np.arange(1, count + 1), count),
            "singular_value": np.repeat(values, count),
            "standard_error_mm": np.repeat(along, count),
            "parameter": np.tile(ident.names, count),
            "weight": ident.directions.ravel(),
        }
    )


def deviation_vector(parameters: pd.DataFrame, calibration: str, method: str, mechanism: Robot) -> np.ndarray:
    """Deviations (p,) of one calibration out of a `parameters` frame; raises FitError where it is not there."""
    chosen = parameters[(parameters["calibration"] == calibration) & (parameters["method"] == method)]
    if chosen.empty:
        raise FitError(f"no calibration {calibration!r} by {method!r}")
    return mechanism.parameters.vector(dict(zip(chosen["parameter"], chosen["value"], strict=True)))
