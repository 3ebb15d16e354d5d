"""Every number that paper B still prints: Chen, Huang, Wei, Zheng, Chen, Trans. Chinese Society for Agricultural
Machinery 54 (2), 2023.

The scan has lost its tables and the bodies of its displayed equations; what that takes away is in the audit.
"""

from rrru.studies.rrru3.paper_a import Number

EXPERIMENTS = (1, 2, 3, 4, 5)
SPREADS = (3.8, 3.4, 3.4, 3.6, 3.5)
# "reduced by at least": x and y, z, in every experiment
LEAST_BENEFIT_PERCENT = {"x": 90.0, "y": 90.0, "z": 80.0}

DESIGN = (
    Number("leg_angle_deg", "section 1, Fig. 1", "deg", 120.0, "between the links, seen from above"),
    Number("solved_positions", "section 1.2, Table 2", "1", 5.0, "the positions themselves are lost"),
    Number("singular_cases", "section 2.2", "1", 4.0, "ways in which det J vanishes; see the audit"),
    Number("network_inputs", "section 2.4, Fig. 5", "1", 3.0),
    Number("network_outputs", "section 2.4, Fig. 5", "1", 3.0),
    Number("learning_rate_min", "eq. (16)", "1", 0.0),
    Number("learning_rate_max", "eq. (16)", "1", 1.0),
    Number("experiments", "section 3, Table 3", "1", 5.0),
    Number("loads", "section 3.2", "1", 3.0, "experiments 3 to 5; their masses are lost"),
    Number("repeats", "sections 3.1.1 and 3.2", "1", 7.0, "of every measured position"),
    Number("screw_turns", "eq. (19)", "1", 10.0, "forwards, before the screw turns back"),
    Number("encoder_range_mm", "section 3.1.1", "mm", 300.0, "linear encoder that measures the backlash"),
    Number("encoder_accuracy_um", "section 3.1.1", "um", 1.0),
    Number("training_points", "section 3.3", "1", 160.0, "drawn at random"),
    Number("test_points", "section 3.3", "1", 20.0, "the others"),
    Number("points", "section 3.3, training and test", "1", 180.0, "the sum; not printed as such"),
    Number("target_mse", "section 3.3", "1", 0.0, "unit not printed"),
)
RESULTS = (
    *(
        Number(f"spread_{k}", "section 3.3", "1", spread, "unit not printed; that of the network's inputs")
        for k, spread in zip(EXPERIMENTS, SPREADS, strict=True)
    ),
    Number("training_steps", "section 3.3, Fig. 13", "1", 20.0, "after which the network approximates well"),
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
