"""Tables of paper B's study: the 3-PTT, its backlash, and its compensation through the Jacobian and a network."""

from rrru.store.schema import NUMBER, Column, Table, xyz

_EXPERIMENT = Column("experiment", "str", "name of the experiment in the configuration")
_POINT = Column("point", "int64", "number of the point along the curve, from 1")
_LEG = Column("leg", "int64", "1 to 3")
_PAYLOAD = Column("payload_kg", NUMBER, "payload on the platform")
_SET = Column("set", "str", "train: learned from; test: the others", allowed=("train", "test"))
_AXIS = Column(
    "axis",
    "str",
    "z: heights count from the first point's error, as the paper's; z_mean: from the mean error of all points; z_absolute: as they are",
    allowed=("x", "y", "z", "z_mean", "z_absolute"),
)
_METHOD = Column(
    "method",
    "str",
    "rbf_inverse, rbf_jacobian: cross-validated network through eq. (11) or eq. (12); rbf_absolute: with the common height error; rbf_paper, "
    "rbf_paper_mm: the paper's spread of scaled inputs or in mm, all neurons; interpolator: biharmonic spline; parameters: calibrated "
    "model; rbf_after_parameters: network on what the calibration leaves",
)
_SPREAD = (
    Column(
        "spread_from",
        "str",
        "candidate: of the configuration; paper_scaled, paper_mm: the paper's, read as of inputs scaled to -1 .. 1 or as mm",
        allowed=("candidate", "paper_scaled", "paper_mm"),
    ),
    Column(
        "learns",
        "str",
        "correction: the network answers with dp; position: with p - dp, as the paper's does",
        allowed=("correction", "position"),
    ),
    Column("spread_mm", NUMBER, "distance at which a neuron answers with one half"),
)
_FACTORS = (
    Column(
        "factored_determinant",
        NUMBER,
        "- height_factor kappa / (D1 D2 D3); null out of reach or with inclined rails",
        True,
    ),
    Column("height_factor_mm", NUMBER, "Z: zero with the platform in the plane of the rails", True),
    Column("kappa_mm2", NUMBER, "zero where the three links' horizontal parts meet in a point or are parallel", True),
    Column("least_d_mm", NUMBER, "least D_i: zero with a link across its rail, where J has no bound", True),
)

TABLES = (
    Table(
        "ptt_kinematics",
        "tables/ptt_kinematics.parquet",
        "Inverse and forward kinematics of given positions (paper B, Table 2), and det J there, directly and by its factors (eq. 5).",
        (
            Column("position", "int64", "number of the position"),
            *xyz("given", "mm", "given position"),
            *(Column(f"slider{k}_mm", NUMBER, f"position of slider {k} by eq. (2)") for k in (1, 2, 3)),
            *xyz("forward", "mm", "position that these give by the forward kinematics"),
            Column("difference_mm", NUMBER, "distance between the two"),
            Column("determinant", NUMBER, "det J of eq. (10), numerically"),
            *_FACTORS,
        ),
        ("position",),
    ),
    Table(
        "ptt_singularity",
        "tables/ptt_singularity.parquet",
        "Regular grid over two slices of the 3-PTT's workspace: xz at y = 0, and xy at half the curve's height.",
        (
            Column("slice", "str", "plane", allowed=("xz", "xy")),
            *(Column(f"{axis}_mm", NUMBER, f"grid point, {axis}") for axis in "xyz"),
            Column("reachable", "bool", "true where all three links reach"),
            Column(
                "translational_measure",
                NUMBER,
                "0 where the platform can move with locked drives; null out of reach",
                True,
            ),
            Column(
                "constraint_measure",
                NUMBER,
                "0 where the platform can turn with locked drives; null out of reach",
                True,
            ),
            Column("determinant", NUMBER, "det J, numerically; null out of reach", True),
            *_FACTORS,
        ),
        ("slice", "x_mm", "y_mm", "z_mm"),
    ),
    Table(
        "ptt_encoder",
        "tables/ptt_encoder.parquet",
        "What the linear encoder read on the bench (paper B, Fig. 7 and Table 4): every screw turned forwards, back and forwards again.",
        (
            _PAYLOAD,
            _LEG,
            Column("sample", "int64", "number of the reading, from 1"),
            Column("pass", "str", "direction of the screw", allowed=("forward_1", "reverse", "forward_2")),
            Column("commanded_mm", NUMBER, "slider position that the screw was turned to"),
            Column("encoder_mm", NUMBER, "slider position that the encoder read"),
        ),
        ("payload_kg", "leg", "sample"),
    ),
    Table(
        "ptt_backlash",
        "tables/ptt_backlash.parquet",
        "Backlash of every screw under every load by eq. (19) (paper B, Table 5).",
        (
            _PAYLOAD,
            _LEG,
            Column("backlash_mm", NUMBER, "e_j: mean of the next two"),
            Column("first_mm", NUMBER, "e_j1: reverse pass less the first forward one, mean over the same places"),
            Column("second_mm", NUMBER, "e_j2: reverse pass less the second forward one"),
            Column("standard_error_mm", NUMBER, "of backlash_mm, from the scatter over the places"),
            Column("true_mm", NUMBER, "the virtual screw's"),
        ),
        ("payload_kg", "leg"),
    ),
    Table(
        "ptt_repeatability",
        "tables/ptt_repeatability.parquet",
        "Repeatability of the sliders per unit travel, the curve passed forwards and backwards in turn (paper B, eq. 20 and Table 6).",
        (
            _LEG,
            Column("compensated", "bool", "whether the command jumped by the measured backlash at a reversal"),
            Column("travel_mm", NUMBER, "K: between the slider's outermost places"),
            Column("scatter_mm", NUMBER, "standard deviation over the repeats, pooled over the places"),
            Column("per_travel_um_per_mm", NUMBER, "sigma_1 or sigma_2: scatter over travel"),
            Column("noise_um_per_mm", NUMBER, "what the tracker's noise alone would give"),
        ),
        ("leg", "compensated"),
    ),
    Table(
        "ptt_points",
        "tables/ptt_points.parquet",
        "Every point of every experiment: measured, corrected, and driven again with the chosen network (paper B, Tables 7 and 8, Figs. 10, 12, "
        "14, 16 and 18). Positions are means over the repeats.",
        (
            _EXPERIMENT,
            _POINT,
            _SET,
            *xyz("command", "mm", "commanded position"),
            *xyz("measured", "mm", "measured position before compensation"),
            *xyz("corrected", "mm", "p - dp: command less error"),
            *xyz("network", "mm", "the network's corrected position less that one"),
            *xyz("before", "mm", "error before compensation, z from the first point's"),
            *xyz("after", "mm", "error when driven again with the network's correction, z from the first point's"),
            Column("before_z_absolute_mm", NUMBER, "height error before compensation"),
            Column("after_z_absolute_mm", NUMBER, "height error when driven again"),
        ),
        ("experiment", "point"),
    ),
    Table(
        "ptt_benefit",
        "tables/ptt_benefit.parquet",
        "Mean absolute errors before and after every kind of compensation, driven again, and the benefit P_g (paper B, eq. 21 and Fig. 17).",
        (
            _EXPERIMENT,
            _METHOD,
            _SET,
            _AXIS,
            Column("before_mm", NUMBER, "A_b"),
            Column("after_mm", NUMBER, "A_a"),
            Column("benefit_percent", NUMBER, "P_g"),
            Column(
                "benefit_low_percent",
                NUMBER,
                "5 % quantile over redraws: fresh noise in the measurements and when driven again, fresh split into training and test points; "
                "null for methods that are not redrawn",
                True,
            ),
            Column("benefit_high_percent", NUMBER, "95 % quantile", True),
        ),
        ("experiment", "method", "set", "axis"),
    ),
    Table(
        "ptt_start",
        "tables/ptt_start.parquet",
        "ptt_benefit of rbf_jacobian on the test points, the curve begun at other azimuths, one draw each. The paper's z hangs on the first "
        "point. The configured start was chosen where no slider reverses; other starts do worse by the paper's measure, hardly by z_mean.",
        (
            _EXPERIMENT,
            Column("start_deg", NUMBER, "azimuth of the first point"),
            _AXIS,
            Column("before_mm", NUMBER, "A_b"),
            Column("after_mm", NUMBER, "A_a"),
            Column("benefit_percent", NUMBER, "P_g"),
        ),
        ("experiment", "start_deg", "axis"),
    ),
    Table(
        "ptt_training",
        "tables/ptt_training.parquet",
        "Mean squared error of the network as neurons are added (paper B, Fig. 13).",
        (
            _EXPERIMENT,
            *_SPREAD,
            Column("neurons", "int64", "hidden neurons"),
            Column("train_mse_mm2", NUMBER, "on the training points, mean over the axes"),
            Column("validation_mse_mm2", NUMBER, "on training points held back in turn"),
            Column("test_mse_mm2", NUMBER, "on the test points"),
        ),
        ("experiment", "spread_from", "learns", "spread_mm", "neurons"),
    ),
    Table(
        "ptt_spread",
        "tables/ptt_spread.parquet",
        "Every spread with the number of neurons that cross-validation finds best for it (paper B, 3.3, prints 3.4 to 3.8 without a unit).",
        (
            _EXPERIMENT,
            *_SPREAD,
            Column("chosen", "bool", "true for the candidate that is used"),
            Column("neurons", "int64", "with the least cross-validated error"),
            Column("train_rms_mm", NUMBER, "error per axis on the training points"),
            Column("validation_rms_mm", NUMBER, "error per axis on training points held back in turn"),
            Column("test_rms_mm", NUMBER, "error per axis on the test points"),
        ),
        ("experiment", "spread_from", "learns", "spread_mm"),
    ),
    Table(
        "ptt_corrections",
        "tables/ptt_corrections.parquet",
        "What the chosen network moves every slider by, through the exact inverse kinematics and through the Jacobian (paper B, Fig. 15).",
        (
            _EXPERIMENT,
            _POINT,
            _LEG,
            Column("nominal_mm", NUMBER, "slider position without correction"),
            Column("inverse_mm", NUMBER, "correction by eq. (11)"),
            Column("jacobian_mm", NUMBER, "correction by eq. (12)"),
            Column("difference_um", NUMBER, "the former less the latter"),
        ),
        ("experiment", "point", "leg"),
    ),
    Table(
        "ptt_extrapolation",
        "tables/ptt_extrapolation.parquet",
        "What a correction is worth where it was not learned: the curve changed, errors without and with the correction, all points.",
        (
            _EXPERIMENT,
            Column(
                "family",
                "str",
                "what is changed; reverse: the same curve backwards",
                allowed=("none", "radius_mm", "height_mm", "reverse", "payload_kg"),
            ),
            Column("size", NUMBER, "by how much, in the unit that the family names"),
            _METHOD,
            _AXIS,
            Column("before_mm", NUMBER, "mean absolute error of the changed curve without correction"),
            Column("after_mm", NUMBER, "with correction"),
            Column("benefit_percent", NUMBER, "as in ptt_benefit; below zero where the correction harms"),
        ),
        ("experiment", "family", "size", "method", "axis"),
    ),
)
