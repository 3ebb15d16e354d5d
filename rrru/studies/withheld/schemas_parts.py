"""Tables that pass between the rules of the check on data whose effect is withheld, chunk by chunk of the robots."""

from rrru.campaign.schemas import TABLES as CAMPAIGN_TABLES
from rrru.store.schema import NUMBER, Column, Table

_MEASUREMENTS = next(table for table in CAMPAIGN_TABLES if table.name == "measurements")
_ROBOT = Column("robot", "str", "name of the robot")
_KIND = Column(
    "kind",
    "str",
    "campaign: paper (each trajectory once), full (reverse runs, speeds, payloads)",
    allowed=("paper", "full"),
)

PARTS = (
    Table(
        "withheld_answers",
        "withheld/answers/{chunk}.parquet",
        "What was drawn for each robot: read by the virtual robot and by the scoring, never by the diagnosis.",
        (
            _ROBOT,
            _KIND,
            Column("truth", "str", "as in withheld_scores"),
            Column("leg", "int64", "the one leg at fault, 1 to 3; 0 for all or none"),
            Column("strength", NUMBER, "true gap rms over noise rms, without noise"),
            Column("weakest", NUMBER, "the same of the weakest cause alone; 0 where nothing acts"),
            Column(
                "drawn",
                "str",
                "all of the robot, as JSON: trajectories, seven errors (rad, mm), causes with their coordinates",
            ),
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
            Column("calibrated", "str", "the mechanism's errors (rad, mm) of the calibration alone, as a JSON list"),
            Column("errors", "str", "the mechanism's errors of the corrected sim, as a JSON list"),
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
            Column("check", "str", "as in withheld_scores"),
            _ROBOT,
            Column("weakest", NUMBER, "as in withheld_answers"),
            Column(
                "oracle_chi2", NUMBER, "chi-square that the true law, its sizes fitted, takes off the calibration's"
            ),
            Column(
                "oracle_freedom",
                "int64",
                "numbers fitted for that; detected where the chi-square's probability by chance is below 1 %",
            ),
            Column("oracle_detects", "bool", "true where it is"),
            Column(
                "rival",
                "str",
                "the wrong explanation nearest to the truth: as many effects as act, up to three where the library does not hold the truth; "
                "empty where nothing acts",
            ),
            Column(
                "rival_chi2",
                NUMBER,
                "chi-square that it leaves of the noise-free gap; a few units cannot be told apart",
                True,
            ),
            Column("imitated_share", NUMBER, "share of the noise-free gap rms that it imitates, 0 to 1", True),
        ),
        ("check", "robot"),
    ),
)
