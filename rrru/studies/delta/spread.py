"""The same calibrations with other plates and on other robots, since one draw may favour a variant. mm and rad."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from rrru.campaign.measurements import vectors
from rrru.studies.delta.variants import VARIANTS, Seen

_SIZES = ("plane_mean", "plane_max", "base_mean", "base_max")


@dataclass(frozen=True)
class Spread:
    """Draws of plate and noise; robots, with 1 sigma of their zero errors and of all lengths (several values)."""

    draws: int
    robots: int
    zero_rad: float
    lengths_mm: tuple[float, ...]


def other_draws(twin, truth, errors):
    """Rows of `delta_draws`: errors on the plane before and after every variant, over random draws.

    truth: the table `delta_truth`; errors: those of the optical centres in every draw, see `draws.drawn_errors`. Plate,
    views and noise of camera and tracker are drawn again; the robot stays the same.
    """
    poses = truth["plane"].to_numpy(), vectors(truth, "command")
    measured = [
        plane_sizes(replace(twin, labels=("draws", number)), *poses, draw) for number, draw in enumerate(errors, 1)
    ]
    rows = []
    for name in measured[0]:
        low, median, high = np.percentile([sizes[name] for sizes in measured], [5.0, 50.0, 95.0], axis=0)
        shares = {"low": low, "median": median, "high": high}
        columns = {f"{size}_{share}_mm": values[k] for k, size in enumerate(_SIZES) for share, values in shares.items()}
        rows.append({"variant": name, "draws": len(errors)} | columns)
    return pd.DataFrame(rows)


def other_robots(twin, truth, errors, spread):
    """Rows of `delta_robots`: errors on the plane over robots with drawn zero and length errors; spread: `Spread`.

    truth, errors: as in `other_draws`; the robots use the draws in turn, since their cameras see nearly the same dots.
    Every size of length errors has the same zero errors, directions and noise.
    """
    poses, rows = (truth["plane"].to_numpy(), vectors(truth, "command")), []
    for length in spread.lengths_mm:
        measured = []
        for number in range(spread.robots):
            robot = replace(twin, labels=("robots", number))
            unit = robot.generator().standard_normal(len(twin.deviations))
            robot = replace(robot, deviations=unit * np.where(np.arange(len(unit)) < 3, spread.zero_rad, length))
            measured.append(plane_sizes(robot, *poses, errors[number % len(errors)]))
        for name in measured[0]:
            median, high = np.percentile([sizes[name] for sizes in measured], [50.0, 90.0], axis=0)
            columns = {"plane_median_mm": median[0], "plane_high_mm": high[0]}
            columns |= {"base_median_mm": median[2], "base_high_mm": high[2]}
            rows.append({"variant": name, "length_error_mm": length, "robots": len(measured)} | columns)
    return pd.DataFrame(rows)


def plane_sizes(twin, planes, command_mm, draw):
    """Sizes (4,), as in `_SIZES`, of a robot's errors on the plane before ("none") and after every variant, by name.

    draw: errors (n, 3) of the optical centres by source.
    """
    places = twin.drive(command_mm)
    seen = Seen(planes, command_mm, places + draw["centre"], places + draw["one_rotation"], places)
    zero_rad = {"none": None}
    for variant in VARIANTS:
        zero_rad[variant.name] = variant.zero_errors(twin.mechanism, *variant.places(twin, seen))
    sizes = {}
    for name, fed_back in zero_rad.items():
        plane, base = (np.linalg.norm(e, axis=1) for e in twin.plane_errors(fed_back, twin.generator("plane", name)))
        sizes[name] = [plane.mean(), plane.max(), base.mean(), base.max()]
    return sizes
