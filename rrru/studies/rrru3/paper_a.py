"""Every number that paper A prints: Zhao, Yan, Luan, Zhao, Li, Transactions of the Chinese Society for Agricultural
Machinery 52 (11), 2021.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Number:
    """One printed number: item, where it stands, unit and value, and what a reader has to know about it."""

    item: str
    source: str
    unit: str
    value: float
    note: str = ""


CROSSOVER = (0.5544, 0.5293, 0.5171, 0.5160, 0.5149, 0.5115, 0.5118, 0.5114, 0.5128, 0.6516)
MIGRATION = (0.5115, 0.5114, 0.5113, 0.5113, 0.5114, 0.5113, 0.5112, 0.5114, 0.5113, 0.5113)
VALUES = tuple(f"{k / 10:.1f}" for k in range(1, 11))
TABLE_5 = {
    "dtheta1": 0.0012,
    "dtheta2": -0.0003,
    "dtheta3": 0.0003,
    "dL1": 0.3092,
    "dL2": 0.2405,
    "dL3": -0.1761,
    "dR": -1.2090,
    "dr": 0.8865,
}
# the drive angles are printed in "rad"; see the audit
TABLE_6 = {
    "dtheta1": 0.0162,
    "dtheta2": -0.0143,
    "dtheta3": 0.0201,
    "dL1": 0.2211,
    "dL2": 0.1956,
    "dL3": -0.1612,
    "dR": -1.1248,
    "dr": 1.6752,
}
_ABSTRACT = "abstract; the body says otherwise, see the audit"

DESIGN = (
    Number("L1_mm", "Table 2", "mm", 400.0),
    Number("L2_mm", "Table 2", "mm", 100.0),
    Number("L3_mm", "Table 2", "mm", 800.0),
    Number("R_mm", "Table 2", "mm", 400.0),
    Number("r_mm", "Table 2", "mm", 400.0),
    Number("speed_mm_s", "section 3.2", "mm/s", 80.0),
    Number("acceleration_mm_s2", "section 3.2", "mm/s^2", 40.0),
    Number("line_start_x_mm", "section 3.2", "mm", -800.0),
    Number("line_start_y_mm", "section 3.2", "mm", 0.0),
    Number("line_start_z_mm", "section 3.2", "mm", 600.0),
    Number("line_end_x_mm", "section 3.2", "mm", -300.0),
    Number("line_end_y_mm", "section 3.2", "mm", 0.0),
    Number("line_end_z_mm", "section 3.2", "mm", 600.0),
    Number("points_per_line", "section 3.2", "1", 26.0),
    Number("line_groups", "section 3.2", "1", 7.0),
    Number("points_on_spiral", "section 3.3", "1", 40.0),
    Number("population", "section 3.1", "1", 30.0),
    Number("crossover_fraction", "section 3.1", "1", 0.8, "chosen from Table 3"),
    Number("migration_fraction", "section 3.1", "1", 0.7, "chosen from Table 4"),
    Number("errors", "section 2.2", "1", 14.0, "tied across the legs to 8, of which 7 can be identified"),
)
ERRORS = (
    Number("group1_before_min", "section 3.2, Fig. 9", "mm", 4.232),
    Number("group1_before_max", "section 3.2, Fig. 9", "mm", 8.356),
    Number("group1_after_min", "section 3.2, Fig. 9", "mm", 0.294),
    Number("group1_after_max", "section 3.2, Fig. 9", "mm", 1.220),
    Number("lines_after_min", "section 3.2, Fig. 10", "mm", 0.14),
    Number("lines_after_max", "section 3.2, Fig. 10", "mm", 1.34),
    Number("lines_before_max", "section 3.2, Fig. 10", "mm", 9.36, "in group 6"),
    Number("spiral_under_lines_x_min", "section 3.3, Fig. 11", "mm", -5.03),
    Number("spiral_under_lines_x_max", "section 3.3, Fig. 11", "mm", 4.78),
    Number("spiral_under_lines_z_abs_max", "section 3.3, Fig. 11", "mm", 3.0, "printed as 'less than'"),
    Number("spiral_under_lines_max", "abstract", "mm", 5.08),
    Number(
        "spiral_under_spiral_component_min",
        "section 3.3, Fig. 11",
        "mm",
        -1.63,
        "larger than the largest error that the abstract gives",
    ),
    Number("spiral_under_spiral_component_max", "section 3.3, Fig. 11", "mm", 1.52),
    Number("spiral_under_spiral_max", "abstract", "mm", 1.56),
    Number("lines_2_7_under_spiral_min", "section 3.3, Fig. 12", "mm", 0.08),
    Number("lines_2_7_under_spiral_max", "section 3.3, Fig. 12", "mm", 1.12),
    Number("lines_objective", "Table 4 at P_m = 0.7", "mm", 0.5112, "mean distance after the line calibration"),
)
# printed a second time with another value or only as a bound; not part of the twin's search
REPEATED = (
    Number("lines_2_7_under_spiral_max", _ABSTRACT, "mm", 1.18),
    Number("tolerance_mm", "section 3.1", "mm", 2.0, "allowed error of the task"),
)
SWEEPS = (
    *(Number(f"P_c={v}", "Table 3, Fig. 6", "mm", f, "a single run") for v, f in zip(VALUES, CROSSOVER, strict=True)),
    *(Number(f"P_m={v}", "Table 4, Fig. 7", "mm", f, "a single run") for v, f in zip(VALUES, MIGRATION, strict=True)),
)
TIED_TO_PRINTED = {"dL1": ("dL11", "dL21", "dL31"), "dL2": ("dL12", "dL22", "dL32"), "dL3": ("dL13", "dL23", "dL33")}


def _fitted(label, source, values, angle_note=""):
    """The 14 printed errors of Table 5 or 6."""
    result = []
    for name, value in values.items():
        unit, note = ("rad", angle_note) if name.startswith("dtheta") else ("mm", "")
        if name in ("dR", "dr"):
            note = "only dr - dR can be identified; dR and dr alone depend on where the search happened to stop"
        result += [
            Number(f"{label}_{printed}", source, unit, value, note) for printed in TIED_TO_PRINTED.get(name, (name,))
        ]
    da = values["dr"] - values["dR"]
    result.append(
        Number(f"{label}_da", f"{source}, dr - dR", "mm", round(da, 4), "the part of both that can be identified")
    )
    return tuple(result)


FITTED = _fitted("lines", "Table 5", TABLE_5) + _fitted(
    "spiral", "Table 6", TABLE_6, "printed as rad, very likely degrees; see the audit"
)
NUMBERS = DESIGN + SWEEPS + FITTED + ERRORS + REPEATED
ERRORS_MM = {number.item: number.value for number in ERRORS}
