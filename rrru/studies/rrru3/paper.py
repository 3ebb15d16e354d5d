"""Every number that paper A prints: Zhao, Yan, Luan, Zhao, Li, Trans. Chinese Society for Agricultural Machinery
52 (11), 2021. They are in `numbers.csv`.

Its parts: design; sweeps, Tables 3 and 4; fitted, Tables 5 and 6 with dr - dR; errors; repeated, which are printed a
second time with another value or only as a bound and are not part of the twin's search; orders, 1 where one holds.
"""

from pathlib import Path

from rrru.studies.paper import read_numbers

_PARTS = read_numbers(Path(__file__).with_name("numbers.csv"))
DESIGN, ERRORS, REPEATED, ORDERS = (_PARTS[part] for part in ("design", "errors", "repeated", "orders"))
NUMBERS = sum(_PARTS.values(), ())

SETTINGS = tuple(f"{k / 10:.1f}" for k in range(1, 11))
_VALUES = {number.item: number.value for number in (*_PARTS["sweeps"], *_PARTS["fitted"])}
CROSSOVER, MIGRATION = (tuple(_VALUES[f"{symbol}={setting}"] for setting in SETTINGS) for symbol in ("P_c", "P_m"))
ANGLES = ("dtheta1", "dtheta2", "dtheta3")
TIED = (*ANGLES, "dL1", "dL2", "dL3", "dR", "dr")
TIED_TO_PRINTED = {f"dL{link}": tuple(f"dL{leg}{link}" for leg in (1, 2, 3)) for link in (1, 2, 3)}
# the drive angles of Table 6 are printed in "rad"; see the audit
TABLE_5, TABLE_6 = (
    {name: _VALUES[f"{label}_{TIED_TO_PRINTED.get(name, (name,))[0]}"] for name in TIED}
    for label in ("lines", "spiral")
)
# largest relative deviation of a number here from the printed one that it matches
TOLERANCE = 0.15
ERRORS_MM = {number.item: number.value for number in ERRORS}
# printed with a last zero
_DECIMALS = {"group1_after_max": 3}


def printed_half_mm(item):
    """Half a unit of the last digit to which an error is printed."""
    text = f"{ERRORS_MM[item]:.10g}"
    return 0.5 * 10.0 ** -_DECIMALS.get(item, len(text.partition(".")[2]))
