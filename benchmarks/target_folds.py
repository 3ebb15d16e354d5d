"""Predicted errors of held-out readings where each of two targets was read in one run: synthetic columns.

Four parameters are shared, three are the place of a target that was read in one run alone. A fold that is this run
leaves its target's place undetermined: the prediction of the fold says nothing about the model. The error of a fit to
all readings is known exactly, sigma^2 trace((X' X)^-1 X_i' X_i) at reading i, and predictions from the complement of a
fold are somewhat less sure.
"""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from rrru.diagnosis.evidence import ModelEvidence
from rrru.diagnosis.heldout import HeldOut
from rrru.diagnosis.state import LinearizedProblem
from rrru.estimation.noise_model import NoiseModel

_SHARED, _PLACE = 4, 3


def held_out_of_targets(generator, noise_mm=0.02, poses=120):
    """A HeldOut of two targets measured in sequence over the same poses, and the columns (n, 3, p)."""
    count, generic = 2 * poses, generator.standard_normal((poses, 3, _SHARED))
    columns = np.zeros((count, 3, _SHARED + 2 * _PLACE))
    for target in range(2):
        own = slice(target * poses, (target + 1) * poses)
        columns[own, :, :_SHARED] = generic + 0.3 * generator.standard_normal(generic.shape)
        turns = np.linalg.qr(generator.standard_normal((poses, 3, 3)))[0]
        columns[own, :, _SHARED + target * _PLACE : _SHARED + (target + 1) * _PLACE] = turns
    run = np.repeat([1, 2], poses)
    data = noise_mm * generator.standard_normal((count, 3))
    linear = LinearizedProblem(data, columns, {}, {}, {}, np.zeros((count, 3, 0)))
    points = pd.DataFrame({"trajectory": "poses", "run": run})
    case = SimpleNamespace(points=points, run=run, stop=np.arange(count), series=run, noise_mm=noise_mm)
    return HeldOut(case, ModelEvidence({}, linear, run, NoiseModel.white(noise_mm), False)), columns


def predicted_and_exact_mm(generator, noise_mm=0.02, poses=120):
    """Rms error of predictions without noise: as predicted for held-out readings, and of a fit to all readings."""
    held_out, columns = held_out_of_targets(generator, noise_mm, poses)
    stated = held_out.predict((), [], 0).uncertainty_mm2.mean()
    flat = columns.reshape(-1, columns.shape[-1])
    inverse = np.linalg.inv(flat.T @ flat)
    exact = noise_mm**2 * np.einsum("ij,jk,ik->", flat, inverse, flat) / len(columns)
    return float(np.sqrt(stated)), float(np.sqrt(exact))


if __name__ == "__main__":
    predicted, fitted = predicted_and_exact_mm(np.random.default_rng(0))
    print(f"predicted for held-out readings {predicted:.4g} mm, of a fit to all readings {fitted:.4g} mm")
