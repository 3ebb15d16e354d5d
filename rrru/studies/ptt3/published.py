"""Every number that paper B still prints, and its comparison with this study's.

Paper B is Chen, Huang, Wei, Zheng, Chen, Trans. Chinese Society for Agricultural Machinery 54 (2), 2023. The scan has
lost its tables and the bodies of its displayed equations; what is lost is in the audit.
"""

import numpy as np
import pandas as pd

from rrru.studies import paper
from rrru.studies.paper import Number, numbers

EXPERIMENTS = (1, 2, 3, 4, 5)
SPREADS = (3.8, 3.4, 3.4, 3.6, 3.5)
# "reduced by at least": x and y, z, in every experiment
LEAST_BENEFIT_PERCENT = {"x": 90.0, "y": 90.0, "z": 80.0}

DESIGN = (
    *numbers("section 1, Fig. 1", "deg", "between the links, seen from above", leg_angle_deg=120.0),
    *numbers("section 1.2, Table 2", "1", "the positions themselves are lost", solved_positions=5.0),
    *numbers("section 2.2", "1", "ways in which det J vanishes; see the audit", singular_cases=4.0),
    *numbers("section 2.4, Fig. 5", "1", network_inputs=3.0, network_outputs=3.0),
    *numbers("eq. (16)", "1", learning_rate_min=0.0, learning_rate_max=1.0),
    *numbers("section 3, Table 3", "1", experiments=5.0),
    *numbers("section 3.2", "1", "experiments 3 to 5; their masses are lost", loads=3.0),
    *numbers("sections 3.1.1 and 3.2", "1", "of every measured position", repeats=7.0),
    *numbers("eq. (19)", "1", "forwards, before the screw turns back", screw_turns=10.0),
    *numbers("section 3.1.1", "mm", "linear encoder that measures the backlash", encoder_range_mm=300.0),
    *numbers("section 3.1.1", "um", encoder_accuracy_um=1.0),
    *numbers("section 3.3", "1", "drawn at random", training_points=160.0),
    *numbers("section 3.3", "1", "the others", test_points=20.0),
    *numbers("section 3.3, training and test", "1", "the sum; not printed as such", points=180.0),
    *numbers("section 3.3", "1", "unit not printed", target_mse=0.0),
)
RESULTS = (
    *(
        Number(f"spread_{k}", "section 3.3", "1", spread, "unit not printed; that of the network's inputs")
        for k, spread in zip(EXPERIMENTS, SPREADS, strict=True)
    ),
    *numbers("section 3.3, Fig. 13", "1", "after which the network approximates well", training_steps=20.0),
    *(
        Number(
            f"benefit_{k}_{axis}",
            "eq. (21), section 3.3, Fig. 17",
            "%",
            value,
            "printed as 'at least'; the compensated error is computed",
        )
        for k in EXPERIMENTS
        for axis, value in LEAST_BENEFIT_PERCENT.items()
    ),
    Number(
        "order_repeatability",
        "section 3.1.1, Table 6",
        "1",
        1.0,
        "1 where a slider repeats better with its backlash compensated",
    ),
)
NUMBERS = DESIGN + RESULTS
# relative excess of the cross-validated error over its minimum at which a network has converged
_CONVERGED = 0.1


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
    half_mm = max(curve["radius_mm"], 0.5 * np.ptp(curve["z_mm"]))
    keys = ["experiment", "spread_from", "learns", "spread_mm"]
    curves = pd.merge(chosen[keys], training, on=keys, how="left").sort_values("neurons").groupby(keys)
    steps = [_steps(part["neurons"].to_numpy(), np.sqrt(part["validation_mse_mm2"].to_numpy())) for _, part in curves]
    spreads = {f"spread_{order[row.experiment]}": row.spread_mm / half_mm for row in chosen.itertuples()}
    return spreads | {"training_steps": float(np.median(steps))}


def _steps(neurons, error):
    """Fewest neurons (n,) with an error (n,) near the minimum."""
    return neurons[np.argmax(error <= (1.0 + _CONVERGED) * error.min())]
