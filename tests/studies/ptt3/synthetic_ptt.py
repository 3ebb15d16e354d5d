"""Tables of paper B's study as the figures read them, made up but shaped as real ones."""

from itertools import product

import numpy as np
import pandas as pd

from rrru.studies.ptt3.learning import METHODS as _METHODS
from tests.schemas import check, filled

METHODS = tuple(_METHODS)
EXPERIMENTS = tuple(f"ptt_{k}" for k in range(1, 6))
_POINTS = 24
_NO_RANGE = {"benefit_low_percent": np.nan, "benefit_high_percent": np.nan}
_AXES = ("x", "y", "z", "z_mean", "z_absolute")


def _points(generator):
    """Rows of `ptt_points` on a rising circle."""
    angle = np.linspace(0.0, 2.0 * np.pi, _POINTS)
    place = {"x": 80.0 * np.cos(angle), "y": 80.0 * np.sin(angle), "z": np.linspace(-270.0, -230.0, _POINTS)}
    rows = [
        {"experiment": name, "point": k + 1, "set": "train" if k % 5 else "test"}
        | {f"command_{axis}_mm": values[k] for axis, values in place.items()}
        for name, k in product(EXPERIMENTS, range(_POINTS))
    ]
    return filled("ptt_points", rows, generator)


def _grid():
    """Rows of `ptt_singularity` over a coarse grid, the corners out of reach."""
    rows = []
    steps = np.arange(-300.0, 301.0, 60.0)
    for plane, first, second in (*product(["xz"], steps, steps[:5]), *product(["xy"], steps, steps)):
        reachable = abs(first) + abs(second) < 480.0
        measure = 1.0 - np.hypot(first, second) / 600.0 if reachable else np.nan
        values = dict.fromkeys(("factored_determinant", "determinant", "height_factor_mm", "least_d_mm"), measure)
        rows.append(
            {
                "slice": plane,
                "x_mm": first,
                "y_mm": 0.0 if plane == "xz" else second,
                "z_mm": second if plane == "xz" else -250.0,
                "reachable": reachable,
                "translational_measure": measure,
                "constraint_measure": measure,
                "kappa_mm2": 200.0 - first if reachable else np.nan,
            }
            | values
        )
    return check("ptt_singularity", pd.DataFrame(rows))


def _bench(generator):
    """Rows of `ptt_encoder`, `ptt_backlash` and `ptt_repeatability`."""
    samples = (
        [("forward_1", u) for u in range(11)]
        + [("reverse", u) for u in range(10, -1, -1)]
        + [("forward_2", u) for u in range(11)]
    )
    encoder = [
        {
            "payload_kg": load,
            "leg": leg,
            "sample": k,
            "pass": name,
            "commanded_mm": float(u),
            "encoder_mm": u + 0.03 * (name == "reverse"),
        }
        for load, leg in product((0.0, 5.0), (1, 2, 3))
        for k, (name, u) in enumerate(samples, start=1)
    ]
    widths = [
        {"payload_kg": load, "leg": leg, "backlash_mm": 0.03 * leg, "standard_error_mm": 1e-3, "true_mm": 0.03 * leg}
        for load, leg in product((0.0, 5.0), (1, 2, 3))
    ]
    scatter = [
        {"leg": leg, "compensated": done, "per_travel_um_per_mm": 0.05 if done else 0.2, "noise_um_per_mm": 0.04}
        for leg, done in product((1, 2, 3), (False, True))
    ]
    tables = {"ptt_encoder": encoder, "ptt_backlash": widths, "ptt_repeatability": scatter}
    return {name: filled(name, rows, generator) for name, rows in tables.items()}


def _networks():
    """Rows of `ptt_training` and `ptt_spread`."""
    spreads = [("candidate", "correction", 60.0), ("candidate", "correction", 100.0)]
    spreads += list(product(("paper_scaled", "paper_mm"), ("correction", "position"), (3.6,)))
    training, spread = [], []
    for name, (source, learns, size) in product(EXPERIMENTS, spreads):
        label = {"experiment": name, "spread_from": source, "learns": learns, "spread_mm": size}
        errors = dict.fromkeys(("train_mse_mm2", "validation_mse_mm2", "test_mse_mm2"))
        training += [label | {"neurons": k} | dict.fromkeys(errors, 0.1 * 0.6**k) for k in range(15)]
        spread.append(label | {"chosen": source == "candidate" and size == 60.0, "neurons": 10})
    return {"ptt_training": filled("ptt_training", training), "ptt_spread": filled("ptt_spread", spread)}


def _benefits(generator):
    """Rows of `ptt_benefit`, `ptt_start` and `ptt_extrapolation`."""
    benefit = [
        {"experiment": name, "method": method, "set": part, "axis": axis, "benefit_percent": 95.0}
        | ({"benefit_low_percent": 93.0, "benefit_high_percent": 96.0} if method == "rbf_jacobian" else _NO_RANGE)
        for name, method, part, axis in product(EXPERIMENTS, METHODS, ("train", "test"), _AXES)
    ]
    changes = [("none", 0.0), ("reverse", 0.0), *product(("radius_mm", "height_mm", "payload_kg"), (-5.0, 5.0))]
    away = [
        {
            "experiment": name,
            "family": family,
            "size": size,
            "method": method,
            "axis": axis,
            "benefit_percent": 90.0 - 40.0 * abs(size),
        }
        for name, (family, size), method, axis in product(EXPERIMENTS, changes, METHODS[-3:], _AXES)
    ]
    start = [
        {"experiment": name, "start_deg": angle, "axis": axis, "benefit_percent": 90.0}
        for name, angle, axis in product(EXPERIMENTS, (0.0, 120.0, 240.0), _AXES)
    ]
    rows = {"ptt_benefit": benefit, "ptt_start": start, "ptt_extrapolation": away}
    return {name: filled(name, part, generator) for name, part in rows.items()}


def ptt_tables():
    """All of them by name."""
    generator = np.random.default_rng(5)
    corrections = [
        {"experiment": name, "point": k + 1, "leg": leg}
        for name, k, leg in product(EXPERIMENTS, range(_POINTS), (1, 2, 3))
    ]
    return {
        "ptt_points": _points(generator),
        "ptt_singularity": _grid(),
        "ptt_corrections": filled("ptt_corrections", corrections, generator),
        **_bench(generator),
        **_networks(),
        **_benefits(generator),
    }
