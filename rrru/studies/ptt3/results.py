"""Tables of one experiment: networks, corrected sliders, and the errors of the robot driven with the corrections.
Lengths in mm.
"""

import numpy as np
import pandas as pd

from rrru.compensate.jacobian import through_inverse, through_jacobian
from rrru.compensate.rbf import ROUNDING, grow, validation_mse
from rrru.studies.ptt3.controllers import relative

AXES = ("x", "y", "z", "z_mean", "z_absolute")


def along_axes(error_mm):
    """Errors (n, 5) along AXES from errors (n, 3): the height's relative to the first point's, relative to their mean,
    then as it is.
    """
    height = error_mm[:, 2]
    return np.column_stack([relative(error_mm), height - height.mean(), height])


def benefit(before_mm, after_mm):
    """Share (...,) in percent by which the mean absolute error over the last axis' points went down (eq. 21)."""
    return 100.0 * (1.0 - np.abs(after_mm).mean(axis=-1) / np.abs(before_mm).mean(axis=-1))


def benefits(learned, after):
    """Rows of `ptt_benefit` without the experiment and without the range over redraws; after: errors (n, 3) by
    method.
    """
    before, result = along_axes(learned.error_mm), []
    for method, error in after.items():
        errors = along_axes(error)
        for name, rows in (("train", learned.train), ("test", ~learned.train)):
            result.append(
                pd.DataFrame(
                    {
                        "method": method,
                        "set": name,
                        "axis": AXES,
                        "before_mm": np.abs(before[rows]).mean(axis=0),
                        "after_mm": np.abs(errors[rows]).mean(axis=0),
                        "benefit_percent": benefit(before[rows].T, errors[rows].T),
                    }
                )
            )
    return pd.concat(result, ignore_index=True)


def points(learned, after_mm):
    """Rows of `ptt_points` without the experiment; after_mm (n, 3): errors when driven again with the chosen
    network.
    """
    error = relative(learned.error_mm)
    columns = {
        "command": learned.command_mm,
        "measured": learned.measured_mm,
        "corrected": learned.command_mm - error,
        "network": error - learned.chosen(learned.command_mm),
        "before": error,
        "after": relative(after_mm),
    }
    return pd.DataFrame(
        {
            "point": np.arange(1, len(error) + 1),
            "set": np.where(learned.train, "train", "test"),
            **{f"{name}_{axis}_mm": values[:, k] for name, values in columns.items() for k, axis in enumerate("xyz")},
            "before_z_absolute_mm": learned.error_mm[:, 2],
            "after_z_absolute_mm": after_mm[:, 2],
        }
    )


def corrections(learned):
    """Rows of `ptt_corrections` without the experiment: what every slider is moved by, through eq. (11) and eq.
    (12).
    """
    command, mechanism = learned.command_mm, learned.mechanism
    nominal, error = mechanism.inverse(command), learned.chosen(command)
    exact, linear = (
        through_inverse(mechanism, command, error) - nominal,
        through_jacobian(mechanism, command, error) - nominal,
    )
    count = len(command)
    return pd.DataFrame(
        {
            "point": np.tile(np.arange(1, count + 1), 3),
            "leg": np.repeat([1, 2, 3], count),
            "nominal_mm": nominal.T.ravel(),
            "inverse_mm": exact.T.ravel(),
            "jacobian_mm": linear.T.ravel(),
            "difference_um": 1e3 * (exact - linear).T.ravel(),
        }
    )


def spreads(learned, training):
    """Rows of `ptt_spread` without the experiment: every spread of `trainings` with the number of neurons that
    validates best.
    """
    result = []
    for (source, learns, spread), part in training.groupby(["spread_from", "learns", "spread_mm"], sort=False):
        best = part.loc[part["validation_mse_mm2"].idxmin()]
        result.append(
            {
                "spread_from": source,
                "learns": learns,
                "spread_mm": spread,
                "chosen": source == "candidate" and spread == learned.choice.spread_mm,
                "neurons": int(best["neurons"]),
                **{f"{name}_rms_mm": np.sqrt(best[f"{name}_mse_mm2"]) for name in ("train", "validation", "test")},
            }
        )
    return pd.DataFrame(result)


def trainings(learned):
    """Rows of `ptt_training` without the experiment: mean squared errors neuron by neuron.

    A network that learns the "correction" answers with dp, as everywhere else here; one that learns the "position" with
    p - dp, as the paper has it; the latter is followed with the paper's spread only.
    """
    error = relative(learned.error_mm)
    frames = []
    for spread, validation in zip(learned.network["spreads_mm"], learned.choice.validation_mse, strict=True):
        growth = _growth(learned, error, spread, learned.network["new_share"], validation)
        frames.append(growth.assign(spread_from="candidate", learns="correction", spread_mm=spread))
    points_mm, most = learned.command_mm[learned.train], learned.network["neurons"]
    for source, spread in learned.paper_spreads_mm.items():
        for learns, targets in (("correction", error), ("position", learned.command_mm - error)):
            validation = validation_mse(points_mm, targets[learned.train], spread, most, learned.folds)
            growth = _growth(learned, targets, spread, ROUNDING, validation)
            frames.append(growth.assign(spread_from=source, learns=learns, spread_mm=spread))
    return pd.concat(frames, ignore_index=True)


def _growth(learned, targets, spread_mm, new_share, validation):
    """Mean squared errors of the training, cross-validation and test points after every neuron; validation: as of
    `validation_mse`.
    """
    points_mm, train = learned.command_mm, learned.train
    growth = grow(
        points_mm[train],
        targets[train],
        spread_mm,
        learned.network["neurons"],
        new_share,
        points_mm[~train],
        targets[~train],
    )
    count = len(growth.train_mse)
    return pd.DataFrame(
        {
            "neurons": np.arange(count),
            "train_mse_mm2": growth.train_mse,
            "validation_mse_mm2": validation[:count],
            "test_mse_mm2": growth.check_mse,
        }
    )
