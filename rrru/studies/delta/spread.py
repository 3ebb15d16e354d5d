"""The same calibrations with other plates and on other robots: one draw may be lucky with a variant. Lengths in mm,
angles in rad.
"""

from dataclasses import replace

import numpy as np
import pandas as pd

from rrru.studies.delta import fits

_SIZES = ("plane_mean", "plane_max", "base_mean", "base_max")


def other_draws(twin, truth, errors):
    """Rows of `delta_draws`: errors on the plane before and after every variant, over draws of everything that is
    random.

    truth: the table `delta_truth`; errors: those of the optical centres in every draw, see `rrru.studies.delta.draws`.
    Plate, views and the noise of camera and tracker are drawn anew, the robot stays.
    """
    sizes = {}
    for number, draw in enumerate(errors, 1):
        _measure(replace(twin, labels=("draws", number)), truth, draw, sizes)
    shares = {"low": 5.0, "median": 50.0, "high": 95.0}
    return pd.DataFrame(
        [{"variant": name, "draws": len(errors)} | _percentiles(rows, _SIZES, shares) for name, rows in sizes.items()]
    )


def other_robots(twin, truth, errors, section):
    """Rows of `delta_robots`: errors on the plane before and after every variant, over robots with drawn zero and
    length errors.

    truth, errors: as in `other_draws`; the robots take the draws in turn, since their cameras see nearly the same dots.
    section: `spread` of the configuration. Every size of length errors has the same zero errors, directions and noise.
    """
    rows = []
    for length in section["lengths_mm"]:
        sizes = {}
        for robot in range(section["robots"]):
            own = replace(twin, labels=("robots", robot))
            unit = own.generator().standard_normal(len(twin.deviations))
            own = replace(own, deviations=np.concatenate([section["zero_rad"] * unit[:3], length * unit[3:]]))
            _measure(own, truth, errors[robot % len(errors)], sizes)
        shares = {"median": 50.0, "high": 90.0}
        for name, of in sizes.items():
            columns = {
                column.replace("_mean", ""): value
                for column, value in _percentiles(of, _SIZES, shares).items()
                if "_max" not in column
            }
            rows.append({"variant": name, "length_error_mm": length, "robots": len(of)} | columns)
    return pd.DataFrame(rows)


def _measure(twin, truth, draw, sizes):
    """Adds the sizes (4,) of the errors on the plane of a robot before and after every variant to the lists by
    variant.
    """
    seen = _seen(twin, truth, draw)
    found = {"none": None}
    for variant in fits.VARIANTS:
        found[variant.name] = fits.fit(variant, twin.mechanism, *fits.places(variant, twin, *seen))[0].deviations
    for name, deviations in found.items():
        lengths = [
            np.linalg.norm(error, axis=1) for error in twin.plane_errors(deviations, twin.generator("plane", name))
        ]
        sizes.setdefault(name, []).append([of(length) for length in lengths for of in (np.mean, np.max)])


def _percentiles(rows, names, shares):
    """Percentiles by column, of rows of one size per name."""
    return {
        f"{name}_{label}_mm": np.percentile([row[k] for row in rows], share)
        for k, name in enumerate(names)
        for label, share in shares.items()
    }


def _seen(twin, truth, draw):
    """The tables `delta_centres` and `delta_truth` of a robot, in the base frame."""
    places = twin.drive(fits.columns(truth, "command"))
    centres = {
        f"{name}_{axis}_mm": (places + error)[:, k] for name, error in draw.items() for k, axis in enumerate("xyz")
    }
    return pd.DataFrame(centres), truth.assign(**{f"true_{axis}_mm": places[:, k] for k, axis in enumerate("xyz")})
