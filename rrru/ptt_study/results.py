"""Tables of one experiment: networks, corrected sliders, and the errors of the robot driven with the corrections. Lengths in mm."""

import numpy as np
import pandas as pd

from rrru.compensate.jacobian import through_inverse, through_jacobian
from rrru.compensate.rbf import ROUNDING, grow, validation_mse
from rrru.ptt_study import robot
from rrru.ptt_study.methods import METHODS, relative

AXES = ("x", "y", "z", "z_absolute")
_LEVELS = (2.5, 97.5)


def along_axes(error_mm):
    """Errors (n, 4) along AXES from errors (n, 3): the height's relative to the first point's, then as it is."""
    return np.column_stack([relative(error_mm), error_mm[:, 2]])


def driven(config, experiment, widths_mm, controllers, plan=None):
    """Errors (n, 3) of the point means with every controller, the virtual robot driven again, by name.

    Every method gets the same draws of the tracker's noise, so that differences are the methods'.
    """
    result = {}
    for name, sliders in controllers.items():
        command, _, measured = robot.point_means(config, experiment.run(widths_mm, experiment.generator("closed_loop"), sliders, plan))
        result[name] = measured - command
    return result


def benefit(before_mm, after_mm):
    """Share (...,) in percent by which the mean absolute error over the last axis' points went down (eq. 21)."""
    return 100.0 * (1.0 - np.abs(after_mm).mean(axis=-1) / np.abs(before_mm).mean(axis=-1))


def benefits(learned, after, draws, generator):
    """Rows of `ptt_benefit` without the experiment; after: errors (n, 3) by method. Intervals are of resampled points."""
    before, result = along_axes(learned.error_mm), []
    sets = {"train": learned.train, "test": ~learned.train}
    picks = {name: generator.integers(rows.sum(), size=(draws, rows.sum())) for name, rows in sets.items()}
    for method in METHODS:
        errors = along_axes(after[method])
        for name, rows in sets.items():
            for k, axis in enumerate(AXES):
                old, new = before[rows, k], errors[rows, k]
                low, high = np.percentile(benefit(old[picks[name]], new[picks[name]]), _LEVELS)
                result.append(
                    {
                        "method": method,
                        "set": name,
                        "axis": axis,
                        "before_mm": np.abs(old).mean(),
                        "after_mm": np.abs(new).mean(),
                        "benefit_percent": benefit(old, new),
                        "benefit_low_percent": low,
                        "benefit_high_percent": high,
                    }
                )
    return pd.DataFrame(result)


def points(learned, after_mm):
    """Rows of `ptt_points` without the experiment; after_mm (n, 3): errors when driven again with the chosen network."""
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
    """Rows of `ptt_corrections` without the experiment: what every slider is moved by, through eq. (11) and eq. (12)."""
    command, mechanism = learned.command_mm, learned.mechanism
    nominal, error = mechanism.inverse(command), learned.chosen(command)
    exact, linear = through_inverse(mechanism, command, error) - nominal, through_jacobian(mechanism, command, error) - nominal
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
    """Rows of `ptt_spread` without the experiment: every spread of `trainings` with the number of neurons that validates best."""
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

    A network that learns the "correction" answers with dp, as everywhere else here; one that learns the "position" with p - dp, as the paper
    has it; the latter is followed with the paper's spread only.
    """
    error = relative(learned.error_mm)
    wanted = [("candidate", "correction", spread) for spread in learned.network["spreads_mm"]]
    for source, spread in learned.paper_spreads_mm.items():
        wanted += [(source, "correction", spread), (source, "position", spread)]
    frames = []
    for source, learns, spread in wanted:
        targets = error if learns == "correction" else learned.command_mm - error
        share = learned.network["new_share"] if source == "candidate" else ROUNDING
        frames.append(_growth(learned, targets, spread, share).assign(spread_from=source, learns=learns, spread_mm=spread))
    return pd.concat(frames, ignore_index=True)


def _growth(learned, targets, spread_mm, new_share):
    """Mean squared errors of the training, cross-validation and test points after every neuron."""
    points_mm, train, most = learned.command_mm, learned.train, learned.network["neurons"]
    growth = grow(points_mm[train], targets[train], spread_mm, most, new_share, points_mm[~train], targets[~train])
    count = len(growth.train_mse)
    validation = validation_mse(points_mm[train], targets[train], spread_mm, most, learned.folds, new_share)
    return pd.DataFrame(
        {
            "neurons": np.arange(count),
            "train_mse_mm2": growth.train_mse,
            "validation_mse_mm2": validation[:count],
            "test_mse_mm2": growth.check_mse,
        }
    )
