"""Search for the Delta's twin: zero and length errors under which errors before and after come near paper C's.

The objective is the median over draws of everything from the plate to the tracker, so that no single draw matters, with
a penalty on the length errors. The errors of the optical centres are those of the configured robot's camera: they come
from the target's dots and the lens, and a robot with slightly different errors sees the same dots. A result far from
the configured robot replaces the configuration, and the search is repeated in a narrow range about it. Lengths in mm,
angles in rad.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import differential_evolution

from rrru.campaign.measurements import vectors
from rrru.estimation.observations.distances import Distances
from rrru.studies.delta.published import RESULTS
from rrru.studies.delta.variants import one_step

# paper C, 3.2 and 3.3: errors on the plane z = 0 in mm
_NAMES = ("before_mean", "before_max", "after_mean", "after_max")
_PUBLISHED_MM = np.array([number.value for name in _NAMES for number in RESULTS if number.item == name])
# ASSUME bounds of the zero errors and of every length's error
_ZERO_RAD, _LENGTH_MM = 0.02, 0.3
# ASSUME penalty, in units of the misfit, of length errors at their bound; the fourth power weights the longest most
_PENALTY = 0.05


def numbers(twin, command_mm, centre_errors_mm):
    """The four published values (4,) of a twin: mean and largest error before and after the paper's calibration.

    command_mm (n, 3): commands of the photographed poses; centre_errors_mm: errors (n, 3) of their optical centres in
    each draw. Medians over the draws.
    """
    actuators, places = twin.mechanism.inverse(command_mm), twin.drive(command_mm)
    draws = []
    for number, errors in enumerate(centre_errors_mm, 1):
        drawn = replace(twin, labels=("search", number))
        zero_rad = one_step(Distances(twin.mechanism, actuators, places + errors, alike=True))
        before, after = (
            np.linalg.norm(drawn.plane_errors(fed_back, drawn.generator("plane", variant))[0], axis=1)
            for variant, fed_back in (("none", None), ("paper", zero_rad))
        )
        draws.append([before.mean(), before.max(), after.mean(), after.max()])
    return np.median(draws, axis=0)


def misfit(reached_mm):
    """RMS of the relative deviations of the four values from the published ones."""
    return float(np.sqrt(((reached_mm / _PUBLISHED_MM - 1.0) ** 2).mean()))


def search(twin, truth, centre_errors, settings):
    """Deviations (12,) of the best twin by differential evolution and its misfit.

    truth: the table `delta_truth`; centre_errors: those of the draws, see `draws.drawn_errors`; settings: the
    configuration's `delta.search`: number of draws, generations, and the searched fraction of the bounds about the
    configured twin.
    """
    first = (truth["plane"] == "first").to_numpy()
    command, seen = vectors(truth, "command")[first], [errors["centre"][first] for errors in centre_errors]
    angle = np.array(twin.truth.parameters.units) == "rad"

    def misfit_of(deviations):
        return misfit(numbers(replace(twin, deviations=deviations), command, seen))

    def penalised(deviations):
        return misfit_of(deviations) + _PENALTY * ((deviations[~angle] / _LENGTH_MM) ** 4).mean() ** 0.25

    limit = np.where(angle, _ZERO_RAD, _LENGTH_MM)
    low, high = (np.clip(twin.deviations + side * settings["share"] * limit, -limit, limit) for side in (-1.0, 1.0))
    options = {"maxiter": settings["generations"], "popsize": 5, "tol": 0.0, "polish": False}
    bounds = list(zip(low, high, strict=True))
    result = differential_evolution(penalised, bounds, rng=twin.generator("search"), **options)
    return result.x, misfit_of(result.x)
