"""Search for the Delta's twin: zero and length errors under which errors before and after come near paper C's. Lengths in mm, angles in rad.

Searched within what assembly by eye and a workshop hold. The optical centres have the errors that the configured robot's images gave: they come
from the target's dots and the camera, and a robot that stands a little off sees the same dots. What is found far from the configured robot
becomes the configuration's, and is searched again in a narrow range about it.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import differential_evolution

from rrru.calibrate.zero_offset import Distances, one_step
from rrru.delta_study.fits import columns

# paper C, 3.2 and 3.3: errors on the plane z = 0 in mm
PUBLISHED_MM = {"before_mean": 0.932, "before_max": 1.442, "after_mean": 0.211, "after_max": 0.374}
# ASSUME bounds of the zero errors and of every length's error
_ZERO_RAD, _LENGTH_MM = 0.02, 0.3


def numbers(twin, command_mm, centre_errors_mm):
    """The published four of a twin: mean and largest error before and after the paper's calibration, as the tracker measures them.

    command_mm, centre_errors_mm: (n, 3) commands of the photographed poses and errors of their optical centres.
    """
    seen = twin.drive(command_mm) + centre_errors_mm
    found = one_step(Distances(twin.mechanism, twin.mechanism.inverse(command_mm), seen, alike=True))
    sizes = {
        label: np.linalg.norm(twin.plane_errors(errors, twin.generator("plane", variant))[0], axis=1)
        for label, variant, errors in (("before", "none", None), ("after", "paper", found))
    }
    return {f"{label}_{name}": float(of(size)) for label, size in sizes.items() for name, of in (("mean", np.mean), ("max", np.max))}


def search(twin, centres, truth, generations, share):
    """Errors (12,) of the best twin by differential evolution and its misfit, the RMS of the four numbers' relative deviations.

    centres, truth: the tables `delta_centres` and `delta_truth` of the configured robot; share: range about its errors, 1 for half the bounds.
    """
    first = (truth["plane"] == "first").to_numpy()
    command, seen, true = (columns(table, name)[first] for table, name in ((truth, "command"), (centres, "centre"), (truth, "true")))

    def misfit(errors):
        reached = numbers(replace(twin, errors=errors), command, seen - true)
        return float(np.sqrt(np.mean([(reached[key] / value - 1.0) ** 2 for key, value in PUBLISHED_MM.items()])))

    limit = np.where(np.array(twin.truth.parameters.units) == "rad", _ZERO_RAD, _LENGTH_MM)
    low, high = (np.clip(twin.errors + side * share * limit, -limit, limit) for side in (-1.0, 1.0))
    result = differential_evolution(
        misfit, list(zip(low, high, strict=True)), maxiter=generations, popsize=5, tol=0.0, polish=False, rng=twin.generator("search")
    )
    return result.x, result.fun
