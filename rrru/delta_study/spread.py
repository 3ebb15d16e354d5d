"""The same calibrations on other robots: one twin may be lucky with a variant. Lengths in mm, angles in rad."""

from dataclasses import replace

import numpy as np
import pandas as pd

from rrru.delta_study import fits


def other_robots(twin, centres, truth, section):
    """Rows of `delta_robots`: errors on the plane before and after every variant, over robots with drawn zero and length errors.

    centres, truth: the tables `delta_centres` and `delta_truth`; the optical centres of other robots get normal errors of the size that the
    images' have. section: `spread` of the configuration. Every size of length errors has the same zero errors, directions and noise.
    """
    rows = []
    for length in section["lengths_mm"]:
        sizes = {}
        for robot in range(section["robots"]):
            generator = twin.generator("robots", robot)
            unit = generator.standard_normal(len(twin.errors))
            other = replace(twin, errors=np.concatenate([section["zero_rad"] * unit[:3], length * unit[3:]]))
            for name, found in _found(other, *_seen(other, centres, truth, generator)).items():
                errors = other.plane_errors(found, twin.generator("robots", robot, "plane", name))
                sizes.setdefault(name, []).append([np.linalg.norm(error, axis=1).mean() for error in errors])
        for name, means in sizes.items():
            columns = {
                f"{frame}_{label}_mm": np.percentile([mean[k] for mean in means], share)
                for k, frame in enumerate(("plane", "base"))
                for label, share in (("median", 50.0), ("high", 90.0))
            }
            rows.append({"variant": name, "length_error_mm": length, "robots": len(means)} | columns)
    return pd.DataFrame(rows)


def _found(twin, centres, truth):
    """Zero errors (3,) that every variant finds, and None before."""
    found = {"none": None}
    for variant in fits.VARIANTS:
        result, _ = fits.fit(variant, twin.mechanism, *fits.places(variant, twin, centres, truth))
        found[variant.name] = result.errors
    return found


def _seen(twin, centres, truth, generator):
    """The tables `delta_centres` and `delta_truth` of another robot, in the base frame."""
    places = twin.drive(fits.columns(truth, "command"))
    true = {f"true_{axis}_mm": places[:, k] for k, axis in enumerate("xyz")}
    found = {}
    for name in fits.FOUND.values():
        size = (fits.columns(centres, name) - fits.columns(truth, "true")).std(axis=0)
        found |= dict(
            zip((f"{name}_{axis}_mm" for axis in "xyz"), (places + size * generator.standard_normal(places.shape)).T, strict=True)
        )
    return centres.assign(**found), truth.assign(**true)
