"""Search for the Delta's twin: zero and length errors under which errors before and after come near paper C's. Lengths
in mm, angles in rad.

What counts is the median over draws of the chain from the plate to the tracker, so that no draw is special, the
configured one included; the shorter the length errors, the better. The optical centres' errors are those that the
configured robot's camera has: they come from the target's dots and the lens, and a robot that stands a little off sees
the same dots. What is found far from the configured robot becomes the configuration's, and is searched again in a
narrow range about it.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.optimize import differential_evolution

from rrru.studies.delta.fits import columns
from rrru.studies.delta.zero_offset import Distances, one_step

# paper C, 3.2 and 3.3: errors on the plane z = 0 in mm
PUBLISHED_MM = {"before_mean": 0.932, "before_max": 1.442, "after_mean": 0.211, "after_max": 0.374}
# ASSUME bounds of the zero errors and of every length's error
_ZERO_RAD, _LENGTH_MM = 0.02, 0.3
# ASSUME misfit that length errors of the bound's size are worth; the fourth power counts the longest most
_PRICE = 0.05


def numbers(twin, command_mm, centre_errors_mm):
    """The published four of a twin: mean and largest error before and after the paper's calibration, as the tracker
    measures them.

    command_mm (n, 3): commands of the photographed poses; centre_errors_mm: errors (n, 3) of their optical centres in
    each draw. Medians over the draws.
    """
    actuators, places = twin.mechanism.inverse(command_mm), twin.drive(command_mm)
    draws = []
    for number, errors in enumerate(centre_errors_mm, 1):
        own = replace(twin, labels=("search", number))
        found = one_step(Distances(twin.mechanism, actuators, places + errors, alike=True))
        sizes = {
            label: np.linalg.norm(own.plane_errors(deviations, own.generator("plane", variant))[0], axis=1)
            for label, variant, deviations in (("before", "none", None), ("after", "paper", found))
        }
        draws.append(
            {
                f"{label}_{name}": of(size)
                for label, size in sizes.items()
                for name, of in (("mean", np.mean), ("max", np.max))
            }
        )
    return pd.DataFrame(draws).median().to_dict()


def misfit(reached):
    """RMS of the four numbers' relative deviations from the published ones."""
    return float(np.sqrt(np.mean([(reached[key] / value - 1.0) ** 2 for key, value in PUBLISHED_MM.items()])))


def search(twin, truth, centre_errors, section):
    """Errors (12,) of the best twin by differential evolution and its misfit.

    truth: the table `delta_truth`; centre_errors: those of the draws, see `rrru.studies.delta.draws`; section: `search`
    of the configuration.
    """
    first = (truth["plane"] == "first").to_numpy()
    command, seen = columns(truth, "command")[first], [errors["centre"][first] for errors in centre_errors]
    angle = np.array(twin.truth.parameters.units) == "rad"

    def price(deviations):
        lengths = deviations[~angle] / _LENGTH_MM
        return (
            misfit(numbers(replace(twin, deviations=deviations), command, seen)) + _PRICE * (lengths**4).mean() ** 0.25
        )

    limit = np.where(angle, _ZERO_RAD, _LENGTH_MM)
    low, high = (np.clip(twin.deviations + side * section["share"] * limit, -limit, limit) for side in (-1.0, 1.0))
    bounds = list(zip(low, high, strict=True))
    generator = twin.generator("search")
    result = differential_evolution(
        price, bounds, maxiter=section["generations"], popsize=5, tol=0.0, polish=False, rng=generator
    )
    return result.x, misfit(numbers(replace(twin, deviations=result.x), command, seen))
