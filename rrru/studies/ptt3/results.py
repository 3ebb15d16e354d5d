"""Tables of one experiment: networks, corrected sliders, and errors of the robot driven with them. Lengths in mm."""

import numpy as np
import pandas as pd

from rrru.campaign.measurements import vector_columns
from rrru.compensation.jacobian import through_inverse, through_jacobian
from rrru.compensation.rbf import ROUNDING, grow, validation_mse
from rrru.studies.ptt3.learning import relative

AXES = ("x", "y", "z", "z_mean", "z_absolute")


def along_axes(error_mm):
    """Errors (n, 5) along AXES from errors (n, 3): heights minus the first one, minus their mean, unchanged."""
    height = error_mm[:, 2]
    return np.column_stack([relative(error_mm), height - height.mean(), height])


def mean_errors(before_mm, after_mm, sets):
    """Mean absolute errors before and after, and the benefit P_g (eq. 21), per method, set and axis.

    before_mm (n, 3); after_mm: errors (n, 3) by method; sets: rows (n,) by name.
    """
    means = [
        [np.abs(along_axes(error)[rows]).mean(axis=0) for rows in sets.values()]
        for error in (before_mm, *after_mm.values())
    ]
    before, after = np.array(means[:1]), np.array(means[1:])
    columns = {
        "method": np.repeat(list(after_mm), len(sets) * len(AXES)),
        "set": np.tile(np.repeat(list(sets), len(AXES)), len(after_mm)),
        "axis": np.tile(AXES, len(sets) * len(after_mm)),
        "before_mm": np.broadcast_to(before, after.shape).ravel(),
        "after_mm": after.ravel(),
        "benefit_percent": (100.0 * (1.0 - after / before)).ravel(),
    }
    return pd.DataFrame(columns)


def benefits(learned, after_mm):
    """Rows of `ptt_benefit` without the experiment and the ranges; after_mm: errors (n, 3) by method."""
    return mean_errors(learned.error_mm, after_mm, {"train": learned.train, "test": ~learned.train})


def points(learned, after_mm):
    """Rows of `ptt_points` without the experiment; after_mm (n, 3): driven again with the chosen network."""
    error = relative(learned.error_mm)
    vectors = {
        "command": learned.command_mm,
        "measured": learned.measured_mm,
        "corrected": learned.command_mm - error,
        "network": error - learned.chosen(learned.command_mm),
        "before": error,
        "after": relative(after_mm),
    }
    frame = pd.DataFrame({k: v for name, values in vectors.items() for k, v in vector_columns(name, values).items()})
    return frame.assign(
        point=np.arange(1, len(error) + 1),
        set=np.where(learned.train, "train", "test"),
        before_z_absolute_mm=learned.error_mm[:, 2],
        after_z_absolute_mm=after_mm[:, 2],
    )


def corrections(learned):
    """Rows of `ptt_corrections` without the experiment: corrections of every slider by eq. (11) and eq. (12)."""
    command, mechanism = learned.command_mm, learned.mechanism
    nominal, error = mechanism.inverse(command), learned.chosen(command)
    exact = through_inverse(mechanism, command, error) - nominal
    linear = through_jacobian(mechanism, command, error) - nominal
    columns = {
        "nominal_mm": nominal,
        "inverse_mm": exact,
        "jacobian_mm": linear,
        "difference_um": 1e3 * (exact - linear),
    }
    index = pd.MultiIndex.from_product([(1, 2, 3), range(1, len(command) + 1)], names=["leg", "point"])
    return pd.DataFrame({name: values.T.ravel() for name, values in columns.items()}, index).reset_index()


def spreads(learned, training):
    """Rows of `ptt_spread` without the experiment: every spread of `trainings` with its best number of neurons."""
    keys = ["spread_from", "learns", "spread_mm"]
    best = training.loc[training.groupby(keys, sort=False)["validation_mse_mm2"].idxmin()].reset_index(drop=True)
    chosen = (best["spread_from"] == "candidate") & (best["spread_mm"] == learned.choice.spread_mm)
    rms = {f"{name}_rms_mm": np.sqrt(best[f"{name}_mse_mm2"]) for name in ("train", "validation", "test")}
    return best[[*keys, "neurons"]].assign(chosen=chosen, **rms)


def trainings(learned):
    """Rows of `ptt_training` without the experiment: mean squared errors neuron by neuron.

    A network that learns the "correction" has the output dp, as everywhere else here; one that learns the "position"
    has p - dp, as in the paper. The latter is computed with the paper's spread only.
    """
    error, network = relative(learned.error_mm), learned.network
    frames = []
    for spread, validation in zip(network.spreads_mm, learned.choice.validation_mse, strict=True):
        growth = _growth(learned, error, spread, network.new_share, validation)
        frames.append(growth.assign(spread_from="candidate", learns="correction", spread_mm=spread))
    points_mm = learned.command_mm[learned.train]
    for source, spread in learned.paper_spreads_mm.items():
        for learns, targets in (("correction", error), ("position", learned.command_mm - error)):
            validation = validation_mse(points_mm, targets[learned.train], spread, network.neurons, learned.folds)
            growth = _growth(learned, targets, spread, ROUNDING, validation)
            frames.append(growth.assign(spread_from=source, learns=learns, spread_mm=spread))
    return pd.concat(frames, ignore_index=True)


def _growth(learned, targets, spread_mm, new_share, validation):
    """Mean squared errors of training, validation (`validation_mse`) and test points after every neuron."""
    known = [values[learned.train] for values in (learned.command_mm, targets)]
    test = [values[~learned.train] for values in (learned.command_mm, targets)]
    growth = grow(*known, spread_mm, learned.network.neurons, new_share, *test)
    columns = {"train": growth.train_mse, "validation": validation[: len(growth.train_mse)], "test": growth.check_mse}
    frame = pd.DataFrame({f"{name}_mse_mm2": values for name, values in columns.items()})
    return frame.assign(neurons=np.arange(len(frame)))
