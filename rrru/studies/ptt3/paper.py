"""Every number that paper B still prints: Chen, Huang, Wei, Zheng, Chen, Trans. Chinese Society for Agricultural
Machinery 54 (2), 2023.

The scan has lost its tables and the bodies of its displayed equations; what is lost is in the audit.
"""

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
