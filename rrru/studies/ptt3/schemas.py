"""Tables of paper B's study: the 3-PTT, its backlash, and its compensation through the Jacobian and a network."""

from rrru.store.schema import Column, Table, numbers, xyz

_AXES = ("x", "y", "z", "z_mean", "z_absolute")
_FAMILIES = ("none", "radius_mm", "height_mm", "reverse", "payload_kg")

_EXPERIMENT = Column("experiment", "str", "name of the experiment in the configuration")
_POINT = Column("point", "int64", "number of the point along the curve, from 1")
_LEG = Column("leg", "int64", "1 to 3")
_PAYLOAD = numbers(payload_kg="payload on the platform")
_SET = Column("set", "str", "train: learned from; test: the others", allowed=("train", "test"))
_AXIS_TEXT = (
    "z: heights count from the first point's error, as the paper's; z_mean: from the mean error of all points; "
    "z_absolute: as they are"
)
_AXIS = Column("axis", "str", _AXIS_TEXT, allowed=_AXES)
_METHOD_TEXT = (
    "rbf_inverse, rbf_jacobian: cross-validated network through eq. (11) or eq. (12); rbf_absolute: with the common "
    "height error; rbf_paper, rbf_paper_mm: the paper's spread of scaled inputs or in mm, all neurons; interpolator: "
    "biharmonic spline; parameters: calibrated model; rbf_after_parameters: network on what the calibration leaves"
)
_METHOD = Column("method", "str", _METHOD_TEXT)
_SOURCE_TEXT = (
    "candidate: of the configuration; paper_scaled, paper_mm: the paper's, read as of inputs scaled to -1 .. 1 or as mm"
)
_LEARNS_TEXT = "correction: the network answers with dp; position: with p - dp, as the paper's does"
_SPREAD = (
    Column("spread_from", "str", _SOURCE_TEXT, allowed=("candidate", "paper_scaled", "paper_mm")),
    Column("learns", "str", _LEARNS_TEXT, allowed=("correction", "position")),
    *numbers(spread_mm="distance at which a neuron answers with one half"),
)
_FACTORS = numbers(
    nullable=True,
    factored_determinant="- height_factor kappa / (D1 D2 D3); null out of reach or with inclined rails",
    height_factor_mm="Z: zero with the platform in the plane of the rails",
    kappa_mm2="zero where the three links' horizontal parts meet in a point or are parallel",
    least_d_mm="least D_i: zero with a link across its rail, where J has no bound",
)
_BENEFIT = numbers(before_mm="A_b", after_mm="A_a", benefit_percent="P_g")


def _table(name, description, columns, *key):
    """A table of the study; key: the columns that name a row."""
    return Table(f"ptt_{name}", f"tables/ptt_{name}.parquet", description, columns, key)


TABLES = (
    _table(
        "kinematics",
        "Inverse and forward kinematics of given positions (paper B, Table 2), and det J there, directly and by its "
        "factors (eq. 5).",
        (
            Column("position", "int64", "number of the position"),
            *xyz("given", "mm", "given position"),
            *numbers(**{f"slider{k}_mm": f"position of slider {k} by eq. (2)" for k in (1, 2, 3)}),
            *xyz("forward", "mm", "position that these give by the forward kinematics"),
            *numbers(difference_mm="distance between the two", determinant="det J of eq. (10), numerically"),
            *_FACTORS,
        ),
        "position",
    ),
    _table(
        "singularity",
        "Regular grid over two slices of the 3-PTT's workspace: xz at y = 0, and xy at half the curve's height.",
        (
            Column("slice", "str", "plane", allowed=("xz", "xy")),
            *numbers(**{f"{axis}_mm": f"grid point, {axis}" for axis in "xyz"}),
            Column("reachable", "bool", "true where all three links reach"),
            *numbers(
                nullable=True,
                translational_measure="0 where the platform can move with locked drives; null out of reach",
                constraint_measure="0 where the platform can turn with locked drives; null out of reach",
                determinant="det J, numerically; null out of reach",
            ),
            *_FACTORS,
        ),
        *("slice", "x_mm", "y_mm", "z_mm"),
    ),
    _table(
        "encoder",
        "What the linear encoder read on the bench (paper B, Fig. 7 and Table 4): every screw turned forwards, back "
        "and forwards again.",
        (
            *_PAYLOAD,
            _LEG,
            Column("sample", "int64", "number of the reading, from 1"),
            Column("pass", "str", "direction of the screw", allowed=("forward_1", "reverse", "forward_2")),
            *numbers(
                commanded_mm="slider position that the screw was turned to",
                encoder_mm="slider position that the encoder read",
            ),
        ),
        *("payload_kg", "leg", "sample"),
    ),
    _table(
        "backlash",
        "Backlash of every screw under every load by eq. (19) (paper B, Table 5).",
        (
            *_PAYLOAD,
            _LEG,
            *numbers(
                backlash_mm="e_j: mean of the next two",
                first_mm="e_j1: reverse pass less the first forward one, mean over the same places",
                second_mm="e_j2: reverse pass less the second forward one",
                standard_error_mm="of backlash_mm, from the scatter over the places",
                true_mm="the virtual screw's",
            ),
        ),
        *("payload_kg", "leg"),
    ),
    _table(
        "repeatability",
        "Repeatability of the sliders per unit travel, the curve passed forwards and backwards in turn (paper B, "
        "eq. 20 and Table 6).",
        (
            _LEG,
            Column("compensated", "bool", "whether the command jumped by the measured backlash at a reversal"),
            *numbers(
                travel_mm="K: between the slider's outermost places",
                scatter_mm="standard deviation over the repeats, pooled over the places",
                per_travel_um_per_mm="sigma_1 or sigma_2: scatter over travel",
                noise_um_per_mm="what the tracker's noise alone would give",
            ),
        ),
        *("leg", "compensated"),
    ),
    _table(
        "points",
        "Every point of every experiment: measured, corrected, and driven again with the chosen network (paper B, "
        "Tables 7 and 8, Figs. 10, 12, 14, 16 and 18). Positions are means over the repeats.",
        (
            *(_EXPERIMENT, _POINT, _SET),
            *xyz("command", "mm", "commanded position"),
            *xyz("measured", "mm", "measured position before compensation"),
            *xyz("corrected", "mm", "p - dp: command less error"),
            *xyz("network", "mm", "the network's corrected position less that one"),
            *xyz("before", "mm", "error before compensation, z from the first point's"),
            *xyz("after", "mm", "error when driven again with the network's correction, z from the first point's"),
            *numbers(
                before_z_absolute_mm="height error before compensation",
                after_z_absolute_mm="height error when driven again",
            ),
        ),
        *("experiment", "point"),
    ),
    _table(
        "benefit",
        "Mean absolute errors before and after every kind of compensation, driven again, and the benefit P_g (paper B, "
        "eq. 21 and Fig. 17).",
        (
            *(_EXPERIMENT, _METHOD, _SET, _AXIS),
            *_BENEFIT,
            *numbers(
                nullable=True,
                benefit_low_percent="5 % quantile over redraws: fresh noise in the measurements and when driven again, "
                "fresh split into training and test points; null for methods that are not redrawn",
                benefit_high_percent="95 % quantile",
            ),
        ),
        *("experiment", "method", "set", "axis"),
    ),
    _table(
        "start",
        "ptt_benefit of rbf_jacobian on the test points, the curve begun at other azimuths, one draw each. The paper's "
        "z hangs on the first point. The configured start was chosen where no slider reverses; other starts do worse "
        "by the paper's measure, hardly by z_mean.",
        (_EXPERIMENT, *numbers(start_deg="azimuth of the first point"), _AXIS, *_BENEFIT),
        *("experiment", "start_deg", "axis"),
    ),
    _table(
        "training",
        "Mean squared error of the network as neurons are added (paper B, Fig. 13).",
        (
            _EXPERIMENT,
            *_SPREAD,
            Column("neurons", "int64", "hidden neurons"),
            *numbers(
                train_mse_mm2="on the training points, mean over the axes",
                validation_mse_mm2="on training points held back in turn",
                test_mse_mm2="on the test points",
            ),
        ),
        *("experiment", "spread_from", "learns", "spread_mm", "neurons"),
    ),
    _table(
        "spread",
        "Every spread with the number of neurons that cross-validation finds best for it (paper B, 3.3, prints 3.4 to "
        "3.8 without a unit).",
        (
            _EXPERIMENT,
            *_SPREAD,
            Column("chosen", "bool", "true for the candidate that is used"),
            Column("neurons", "int64", "with the least cross-validated error"),
            *numbers(
                train_rms_mm="error per axis on the training points",
                validation_rms_mm="error per axis on training points held back in turn",
                test_rms_mm="error per axis on the test points",
            ),
        ),
        *("experiment", "spread_from", "learns", "spread_mm"),
    ),
    _table(
        "corrections",
        "What the chosen network moves every slider by, through the exact inverse kinematics and through the Jacobian "
        "(paper B, Fig. 15).",
        (
            *(_EXPERIMENT, _POINT, _LEG),
            *numbers(
                nominal_mm="slider position without correction",
                inverse_mm="correction by eq. (11)",
                jacobian_mm="correction by eq. (12)",
                difference_um="the former less the latter",
            ),
        ),
        *("experiment", "point", "leg"),
    ),
    _table(
        "extrapolation",
        "What a correction is worth where it was not learned: the curve changed, errors without and with the "
        "correction, all points.",
        (
            _EXPERIMENT,
            Column("family", "str", "what is changed; reverse: the same curve backwards", allowed=_FAMILIES),
            *numbers(size="by how much, in the unit that the family names"),
            *(_METHOD, _AXIS),
            *numbers(
                before_mm="mean absolute error of the changed curve without correction",
                after_mm="with correction",
                benefit_percent="as in ptt_benefit; below zero where the correction harms",
            ),
        ),
        *("experiment", "family", "size", "method", "axis"),
    ),
)
