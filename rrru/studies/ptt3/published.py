"""Every number that paper B still prints, and its comparison with this study's.

Paper B is Chen, Huang, Wei, Zheng, Chen, Trans. Chinese Society for Agricultural Machinery 54 (2), 2023. The scan has
lost its tables and the bodies of its displayed equations; what is lost is in `lost.csv`, the numbers in `numbers.csv`.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from rrru.studies import paper
from rrru.studies.paper import read_numbers

NUMBERS = sum(read_numbers(Path(__file__).with_name("numbers.csv")).values(), ())
# relative excess of the cross-validated error over its minimum at which a network has converged
_MAX_EXCESS_ERROR = 0.1


def published_rows(section, benefit, spread, training, repeatability):
    """Rows of `published` for paper B.

    section: the configuration's `ptt`; benefit, spread, training, repeatability: the tables ptt_benefit, ptt_spread,
    ptt_training and ptt_repeatability. Benefits are those of the correction through the Jacobian on test points.
    """
    order = {name: number for number, name in enumerate(section["experiments"], start=1)}
    paper_method = (
        (benefit["method"] == "rbf_jacobian") & (benefit["set"] == "test") & benefit["axis"].isin(list("xyz"))
    )
    by_leg = repeatability.pivot(index="leg", columns="compensated", values="per_travel_um_per_mm")
    here = {
        **_design(section),
        **_networks(section["curve"], spread[spread["chosen"]], training, order),
        **{
            f"benefit_{order[row.experiment]}_{row.axis}": row.benefit_percent
            for row in benefit[paper_method].itertuples()
        },
        "order_repeatability": float((by_leg[True] < by_leg[False]).all()),
    }
    return paper.published_rows("B", NUMBERS, here)


def _design(section):
    """The configured numbers of the experiments."""
    loads = {entry["payload_kg"] for entry in section["experiments"].values() if entry["payload_kg"] > 0.0}
    points, train = section["curve"]["points"], section["network"]["train"]
    return {
        # a network from positions to positions
        "network_inputs": 3,
        "network_outputs": 3,
        "solved_positions": len(section["positions_mm"]),
        "experiments": len(section["experiments"]),
        "loads": len(loads),
        "repeats": section["repeats"],
        "screw_turns": section["bench"]["turns"],
        "encoder_range_mm": section["bench"]["range_mm"],
        "encoder_accuracy_um": 1e3 * section["bench"]["resolution_mm"],
        "training_points": train,
        "test_points": points - train,
        "points": points,
    }


def _networks(curve, chosen, training, order):
    """Spreads of the chosen networks for inputs scaled to -1..1 over the largest range, and their median steps."""
    half_range_mm = max(curve["radius_mm"], 0.5 * np.ptp(curve["z_mm"]))
    keys = ["experiment", "spread_from", "learns", "spread_mm"]
    curves = pd.merge(chosen[keys], training, on=keys, how="left").sort_values("neurons").groupby(keys)
    steps = []
    for _, part in curves:
        error = np.sqrt(part["validation_mse_mm2"].to_numpy())
        # the fewest neurons with an error near the minimum
        steps.append(part["neurons"].to_numpy()[np.argmax(error <= (1.0 + _MAX_EXCESS_ERROR) * error.min())])
    spreads = {f"spread_{order[row.experiment]}": row.spread_mm / half_range_mm for row in chosen.itertuples()}
    return spreads | {"training_steps": float(np.median(steps))}
