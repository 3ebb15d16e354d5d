"""Every number that paper A prints: Zhao, Yan, Luan, Zhao, Li, Trans. Chinese Society for Agricultural Machinery
52 (11), 2021.
"""

from rrru.studies.paper import Number, numbers

SETTINGS = tuple(f"{k / 10:.1f}" for k in range(1, 11))
CROSSOVER = (0.5544, 0.5293, 0.5171, 0.5160, 0.5149, 0.5115, 0.5118, 0.5114, 0.5128, 0.6516)
MIGRATION = (0.5115, 0.5114, 0.5113, 0.5113, 0.5114, 0.5113, 0.5112, 0.5114, 0.5113, 0.5113)
ANGLES = ("dtheta1", "dtheta2", "dtheta3")
TIED = (*ANGLES, "dL1", "dL2", "dL3", "dR", "dr")
TIED_TO_PRINTED = {f"dL{link}": tuple(f"dL{leg}{link}" for leg in (1, 2, 3)) for link in (1, 2, 3)}
TABLE_5 = dict(zip(TIED, (0.0012, -0.0003, 0.0003, 0.3092, 0.2405, -0.1761, -1.2090, 0.8865), strict=True))
# the drive angles are printed in "rad"; see the audit
TABLE_6 = dict(zip(TIED, (0.0162, -0.0143, 0.0201, 0.2211, 0.1956, -0.1612, -1.1248, 1.6752), strict=True))
_ONLY_DIFFERENCE = "only dr - dR can be identified; dR and dr alone depend on where the search happened to stop"

DESIGN = (
    *numbers("Table 2", "mm", L1_mm=400.0, L2_mm=100.0, L3_mm=800.0, R_mm=400.0, r_mm=400.0),
    *numbers("section 3.2", "mm/s", speed_mm_s=80.0),
    *numbers("section 3.2", "mm/s^2", acceleration_mm_s2=40.0),
    *numbers("section 3.2", "mm", line_start_x_mm=-800.0, line_start_y_mm=0.0, line_start_z_mm=600.0),
    *numbers("section 3.2", "mm", line_end_x_mm=-300.0, line_end_y_mm=0.0, line_end_z_mm=600.0),
    *numbers("section 3.2", "1", points_per_line=26.0, line_groups=7.0),
    *numbers("section 3.3", "1", points_on_spiral=40.0),
    *numbers("section 3.1", "1", population=30.0),
    *numbers("section 3.1", "1", "chosen from Table 3", crossover_fraction=0.8),
    *numbers("section 3.1", "1", "chosen from Table 4", migration_fraction=0.7),
    *numbers("section 2.2", "1", "tied across the legs to 8, of which 7 can be identified", errors=14.0),
)
ERRORS = (
    *numbers("section 3.2, Fig. 9", "mm", group1_before_min=4.232, group1_before_max=8.356),
    *numbers("section 3.2, Fig. 9", "mm", group1_after_min=0.294, group1_after_max=1.220),
    *numbers("section 3.2, Fig. 10", "mm", lines_after_min=0.14, lines_after_max=1.34),
    *numbers("section 3.2, Fig. 10", "mm", "in group 6", lines_before_max=9.36),
    *numbers("section 3.3, Fig. 11", "mm", spiral_under_lines_x_min=-5.03, spiral_under_lines_x_max=4.78),
    *numbers("section 3.3, Fig. 11", "mm", "printed as 'less than'", spiral_under_lines_z_abs_max=3.0),
    *numbers("abstract", "mm", spiral_under_lines_max=5.08),
    *numbers(
        "section 3.3, Fig. 11",
        "mm",
        "larger than the largest error that the abstract gives",
        spiral_under_spiral_component_min=-1.63,
    ),
    *numbers("section 3.3, Fig. 11", "mm", spiral_under_spiral_component_max=1.52),
    *numbers("abstract", "mm", spiral_under_spiral_max=1.56),
    *numbers("section 3.3, Fig. 12", "mm", lines_2_7_under_spiral_min=0.08, lines_2_7_under_spiral_max=1.12),
    *numbers("Table 4 at P_m = 0.7", "mm", "mean distance after the line calibration", lines_objective=0.5112),
)
# printed a second time with another value or only as a bound; not part of the twin's search
REPEATED = (
    Number("lines_2_7_under_spiral_max", "abstract; the body says otherwise, see the audit", "mm", 1.18),
    Number("tolerance_mm", "section 3.1", "mm", 2.0, "allowed error of the task"),
)
SWEEPS = tuple(
    Number(f"{symbol}={setting}", source, "mm", value, "a single run")
    for symbol, source, values in (("P_c", "Table 3, Fig. 6", CROSSOVER), ("P_m", "Table 4, Fig. 7", MIGRATION))
    for setting, value in zip(SETTINGS, values, strict=True)
)


def _fitted(label, source, values, angle_note=""):
    """The 14 printed deviations of Table 5 or 6, and dr - dR."""
    result = []
    for name, value in values.items():
        unit, note = ("rad", angle_note) if name in ANGLES else ("mm", "")
        if name in ("dR", "dr"):
            note = _ONLY_DIFFERENCE
        printed_names = TIED_TO_PRINTED.get(name, (name,))
        result += [Number(f"{label}_{printed}", source, unit, value, note) for printed in printed_names]
    note, da = "the part of both that can be identified", round(values["dr"] - values["dR"], 4)
    return (*result, Number(f"{label}_da", f"{source}, dr - dR", "mm", da, note))


FITTED = (
    *_fitted("lines", "Table 5", TABLE_5),
    *_fitted("spiral", "Table 6", TABLE_6, "printed as rad, very likely degrees; see the audit"),
)
_HOLDS = "1 where it holds"
_CALIBRATED = {"before": "before calibration", "after": "after the line calibration"}


def _order(item, source, text):
    """A printed order: 1 where it holds."""
    return Number(f"order_{item}", source, "1", 1.0, f"{text}: {_HOLDS}")


ORDERS = (
    *(
        _order(f"{name}_{when}", "section 3.2, Fig. 10", f"{text}, {label}")
        for when, label in _CALIBRATED.items()
        for name, text in (
            ("centre", "mean error of each of groups 1-3 below each of groups 4-7"),
            ("group6", "largest error in group 6"),
            ("outer", "mean errors of groups 6 and 7 above each of the other five"),
        )
    ),
    _order("centre_spiral", "section 3.3, Fig. 12", "groups 1-3 better, under the spiral calibration"),
    _order("links", "section 3.3, Tables 5 and 6", "link errors nearly the same in both calibrations"),
    _order("spikes_before", "section 3.2, Fig. 9", "several sharp spikes on group 1 before calibration"),
    _order("spikes_after", "section 3.2, Fig. 9", "no such spike on group 1 after the line calibration"),
)
NUMBERS = DESIGN + SWEEPS + FITTED + ERRORS + REPEATED + ORDERS
# largest relative deviation of a number here from the printed one that it matches
TOLERANCE = 0.15
ERRORS_MM = {number.item: number.value for number in ERRORS}
# printed with a last zero
_DECIMALS = {"group1_after_max": 3}


def printed_half_mm(item):
    """Half a unit of the last digit to which an error is printed."""
    text = f"{ERRORS_MM[item]:.10g}"
    return 0.5 * 10.0 ** -_DECIMALS.get(item, len(text.partition(".")[2]))
