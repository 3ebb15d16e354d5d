"""Numbers of the sister studies for papers B and C, out of the tables of the 3-PTT and the Delta. Lengths in mm, angles
in rad.
"""

import numpy as np

from rrru.studies.rrru3.published_sisters import here_b, here_c

# of the columns of ptt_benefit, those that follow the paper: Jacobian's route, points that were not learned
_PAPERS_WAY = {"method": "rbf_jacobian", "set": "test"}
# a network has converged where its cross-validated error is within this share of the least
_CONVERGED = 0.1
_BEFORE, _AFTER = "none", "paper"


def study_b(config, benefit, spread, training, repeatability):
    """Numbers for paper B by item, from the configuration and the tables ptt_benefit, ptt_spread, ptt_training and
    ptt_repeatability.

    Spreads are in half the curve's largest range, which is that of inputs scaled to -1 .. 1.
    """
    section = config["ptt"]
    numbers = {name: number for number, name in enumerate(section["experiments"], start=1)}
    rows = benefit[
        np.logical_and.reduce([benefit[key] == value for key, value in _PAPERS_WAY.items()])
        & benefit["axis"].isin(("x", "y", "z"))
    ]
    half = max(section["curve"]["radius_mm"], 0.5 * np.ptp(section["curve"]["z_mm"]))
    chosen = spread[spread["chosen"]]
    networks = chosen.assign(
        experiment=chosen["experiment"].map(numbers),
        spread=chosen["spread_mm"] / half,
        steps=[_steps(training, row) for row in chosen.itertuples()],
    )
    by_leg = repeatability.pivot(index="leg", columns="compensated", values="per_travel_um_per_mm")
    return here_b(_design_b(section, numbers), rows.assign(experiment=rows["experiment"].map(numbers)), networks) | {
        "order_repeatability": float((by_leg[True] < by_leg[False]).all())
    }


def spread_c(draws):
    """Item of paper C to its (low, high) over draws, from the table delta_draws."""
    rows = draws.set_index("variant")
    return {
        f"{label}_{kind}": tuple(rows.loc[variant, f"plane_{of}_{side}_mm"] for side in ("low", "high"))
        for label, variant in (("before", _BEFORE), ("after", _AFTER))
        for kind, of in (("mean", "mean"), ("max", "max"), ("about", "mean"))
    }


def study_c(config, points, camera):
    """Numbers for paper C by item, from the configuration and the tables delta_points and delta_camera.

    Errors are those of the paper's own calibration frame, after its single linear step.
    """
    section = config["delta"]
    size = points.set_index("variant")["error_mm"]
    found = camera.set_index("parameter")["found"]
    design = {
        "target_dots_across": float(section["target"]["rows"]),
        "target_dots_along": float(section["target"]["columns"]),
        "dot_diameter_mm": section["target"]["diameter_mm"],
        "dot_pitch_mm": section["target"]["pitch_mm"],
        "focal_length_mm": float(found["focal_x_px"] * section["camera"]["pixel_mm"]),
        "poses": float(np.prod(section["poses"]["counts"])),
        "calibration_height_mm": section["poses"]["z_mm"],
        "checked_height_mm": section["plane"]["z_mm"],
    }
    return here_c(design, size[_BEFORE].to_numpy(), size[_AFTER].to_numpy())


def _design_b(section, numbers):
    """What is configured of paper B's experiments."""
    loads = {entry["payload_kg"] for entry in section["experiments"].values() if entry["payload_kg"] > 0.0}
    points, train = section["curve"]["points"], section["network"]["train"]
    # a network from positions to positions
    return {
        "network_inputs": 3.0,
        "network_outputs": 3.0,
        "solved_positions": float(len(section["positions_mm"])),
        "experiments": float(len(numbers)),
        "loads": float(len(loads)),
        "repeats": float(section["repeats"]),
        "screw_turns": float(section["bench"]["turns"]),
        "encoder_range_mm": section["bench"]["range_mm"],
        "encoder_accuracy_um": 1e3 * section["bench"]["resolution_mm"],
        "training_points": float(train),
        "test_points": float(points - train),
        "points": float(points),
    }


def _steps(training, row):
    """Fewest neurons with which a chosen network is within a share of its least cross-validated error."""
    keys = ("experiment", "spread_from", "learns", "spread_mm")
    curve = training[np.logical_and.reduce([training[key] == getattr(row, key) for key in keys])].sort_values("neurons")
    error = np.sqrt(curve["validation_mse_mm2"].to_numpy())
    return float(curve["neurons"].to_numpy()[np.argmax(error <= (1.0 + _CONVERGED) * error.min())])
