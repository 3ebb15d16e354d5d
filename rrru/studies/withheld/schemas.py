"""Tables of the check on withheld effects: verdicts first, the truth joined by the scoring alone.

Those below withheld/ pass between the rules, chunk by chunk of the robots.
"""

from rrru.campaign.schemas import TABLES as CAMPAIGN_TABLES
from rrru.store.schema import NUMBER, Column, Table

# columns that a diagnosis's verdict gives
VERDICT = ["effects", "probability", "leg", "gap_rms_mm", "noise_rms_mm", "share_closed"]

_MEASUREMENTS = next(table for table in CAMPAIGN_TABLES if table.name == "measurements")
_CHECK = Column(
    "check",
    "str",
    "label: the robots' effects are hidden; effect: the robot's effect is taken out of the library; field: recorded by "
    "another simulator",
    allowed=("label", "effect", "field"),
)
_CHECKED = Column("check", "str", "as in withheld_scores")
_ROBOT = Column("robot", "str", "name of the robot or field campaign")
_KINDS = ("paper", "full", "file")
_KIND = Column(
    "kind", "str", "paper (each trajectory once), full (reverse runs, speeds, payloads) or file", False, _KINDS
)
_TRUTH = Column("truth", "str", "true effects joined by +; none; or outside:<name> for what the library does not hold")
_TRUTH_LEG = Column("truth_leg", "int64", "the one leg at fault, 1 to 3; 0 for all or none")
_STRENGTH = Column("strength", NUMBER, "true gap rms over noise rms, without noise")
_WEAKEST = Column("weakest", NUMBER, "the same of the weakest cause alone; 0 where nothing acts")
_DETECTS = Column(
    "oracle_detects", "bool", "a likelihood-ratio test that knows the true law detects it at 1 % false alarms"
)

TABLES = (
    Table(
        "withheld_answers",
        "withheld/answers/{chunk}.parquet",
        "What was drawn for each robot: read by the virtual robot and by the scoring, never by the diagnosis.",
        (
            _ROBOT,
            _KIND,
            _TRUTH,
            _TRUTH_LEG,
            _STRENGTH,
            _WEAKEST,
            Column("drawn", "str", "all of the robot, as JSON: trajectories, seven deviations (rad, mm), causes"),
        ),
        ("robot",),
    ),
    Table(
        "withheld_measurements",
        "withheld/measurements/{chunk}.parquet",
        "One row per commanded point of each robot: all that the diagnosis is given.",
        (_ROBOT, _KIND, *_MEASUREMENTS.columns),
        ("robot", "run", "point"),
    ),
    Table(
        "withheld_states",
        "withheld/states/{chunk}.parquet",
        "The sims of the diagnosis: calibrated without and corrected with effects.",
        (
            _ROBOT,
            Column(
                "calibrated", "str", "the mechanism's deviations (rad, mm) of the calibration alone, as a JSON list"
            ),
            Column("deviations", "str", "the mechanism's deviations of the corrected sim, as a JSON list"),
            Column("effects", "str", "effects of the corrected sim, as a JSON list of [name, shape, coordinates]"),
            Column("shapes", "str", "shapes' parameters that were fitted further, as JSON by effect and name"),
        ),
        ("robot",),
    ),
    Table(
        "withheld_limits",
        "tables/withheld_limits.parquet",
        "What the data of each robot could tell somebody who knows the true law.",
        (
            _CHECKED,
            _ROBOT,
            _WEAKEST,
            Column(
                "oracle_chi2", NUMBER, "chi-square that the true law, its sizes fitted, takes off the calibration's"
            ),
            Column("oracle_freedom", "int64", "numbers fitted for that"),
            _DETECTS,
            Column(
                "rival",
                "str",
                "the wrong explanation nearest to the truth: as many effects as act, up to three where the library "
                "does not hold the truth; empty where nothing acts",
            ),
            Column(
                "rival_chi2", NUMBER, "what it leaves of the noise-free gap; a few units cannot be told apart", True
            ),
            Column("imitated_share", NUMBER, "share of the noise-free gap rms that it imitates, 0 to 1", True),
        ),
        ("check", "robot"),
    ),
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
            _TRUTH,
            _TRUTH_LEG,
            _STRENGTH,
            Column("verdict", "str", "the diagnosis's effects"),
            Column("right", "bool", "it names exactly the truth or, where the library lacks that, says unexplained"),
            Column(
                "leg_right", NUMBER, "1 where the leg is right, 0 where not; null where there is none to name", True
            ),
            Column("probability", NUMBER, "that the diagnosis gave its verdict, 0 to 1"),
            _DETECTS,
            Column("share_closed_true", NUMBER, "share of the true gap that the corrected sim closes", True),
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
