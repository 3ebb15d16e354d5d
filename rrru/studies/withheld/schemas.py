"""Tables of the check on data whose effect is withheld: verdicts first, the truth joined by the scoring alone."""

from rrru.store.schema import NUMBER, Column, Table
from rrru.studies.withheld.schemas_parts import PARTS

_CHECK = Column(
    "check",
    "str",
    "label: the robots' effects are hidden; effect: the robot's effect is taken out of the library; field: recorded by another simulator",
    allowed=("label", "effect", "field"),
)
_ROBOT = Column("robot", "str", "name of the robot or field campaign")
_KIND = Column(
    "kind", "str", "how it was measured: paper (each trajectory once), full (reverse runs, speeds, payloads) or file"
)

TABLES = (
    *PARTS,
    Table(
        "withheld_verdicts",
        "tables/withheld_verdicts.parquet",
        "What the diagnosis says about each withheld robot; made without knowing any answer.",
        (
            _CHECK,
            _ROBOT,
            _KIND,
            Column("effects", "str", "as in gap_verdicts"),
            Column("probability", NUMBER, "of the whole verdict, 0 to 1"),
            Column("leg", "int64", "the one leg at fault, 1 to 3; 0 for all or none"),
            Column("gap_rms_mm", NUMBER, "gap under the calibrated sim, 3-D"),
            Column("noise_rms_mm", NUMBER, "measuring noise, 3-D"),
            Column("share_closed", NUMBER, "share of the gap that the verdict's effects close on held-out runs"),
        ),
        ("check", "robot"),
    ),
    Table(
        "withheld_scores",
        "tables/withheld_scores.parquet",
        "Each verdict beside the truth.",
        (
            _CHECK,
            _ROBOT,
            _KIND,
            Column(
                "truth", "str", "true effects joined by +; none; or outside:<name> for what the library does not hold"
            ),
            Column("truth_leg", "int64", "the one leg at fault, 1 to 3; 0 for all or none"),
            Column("strength", NUMBER, "true gap rms over noise rms"),
            Column("verdict", "str", "the diagnosis's effects"),
            Column(
                "right",
                "bool",
                "true where the verdict names exactly the true effects or, where the library lacks them, says unexplained",
            ),
            Column(
                "leg_right",
                NUMBER,
                "1 where the leg is right, 0 where not; null where the question does not arise",
                True,
            ),
            Column("probability", NUMBER, "that the diagnosis gave its verdict, 0 to 1"),
            Column(
                "oracle_detects",
                "bool",
                "a likelihood-ratio test that knows the true law detects it at 1 % false alarms",
            ),
            Column(
                "share_closed_true",
                NUMBER,
                "share of the true gap that the corrected sim closes; null where there is no gap",
                True,
            ),
            Column("share_closed", NUMBER, "the same as the diagnosis predicts it; null where it predicts none", True),
        ),
        ("check", "robot"),
    ),
    Table(
        "withheld_summary",
        "tables/withheld_summary.parquet",
        "The scores in figures, against what the tool is meant to reach.",
        (
            _CHECK,
            Column("group", "str", "which robots are counted"),
            Column("figure", "str", "what is counted"),
            Column("robots", "int64", "robots in the group"),
            Column("value", NUMBER, "the figure; null where the group is empty", True),
            Column("low", NUMBER, "lower end of the 95 % Wilson interval; null where the figure is no share", True),
            Column("high", NUMBER, "upper end", True),
            Column("asked", NUMBER, "what the tool is meant to reach; null where nothing is asked", True),
        ),
        ("check", "group", "figure"),
    ),
    Table(
        "withheld_confusion",
        "tables/withheld_confusion.parquet",
        "How many robots of each truth got each verdict.",
        (
            _CHECK,
            Column("truth", "str", "as in withheld_scores"),
            Column("verdict", "str", "as in withheld_scores"),
            Column("robots", "int64", "how many"),
        ),
        ("check", "truth", "verdict"),
    ),
)
