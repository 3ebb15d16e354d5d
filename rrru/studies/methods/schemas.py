"""Tables of the comparison of methods across the robots."""

from rrru.store.schema import Column, Table, numbers

_POINTS = "points measured to learn from; of jacobian_step the targets themselves, of images the poses"
_ROBOT = Column("robot", "str", "mechanism: rrru3, ptt3 or delta")
_METHOD = Column("method", "str", "what is learned; see `needs` in methods")
_TEST_TEXT = "targets inside the region that was learned on, or outside of it"
_RESULT = (
    _ROBOT,
    _METHOD,
    Column("test", "str", _TEST_TEXT, allowed=("inside", "outside")),
    Column("points", "int64", _POINTS),
    *numbers(
        before_mean_mm="mean true distance from the target with the nominal controller",
        before_max_mm="largest one",
        after_mean_mm="mean true distance from the target, the robot driven again with the corrected commands",
        after_max_mm="largest one",
    ),
    Column("numbers", "int64", "numbers learned: parameters, or weights and thresholds"),
    *numbers(measuring_time_s="time of the robot's campaign, moves and rests"),
    Column("evaluations", "int64", "model positions solved; 0 where a method needs no model to learn"),
)
_NEEDED = (
    "fewest points tried from which on the mean error inside stays within a tenth, or the tracker's noise, of that "
    "with all points"
)
TABLES = (
    Table(
        "methods",
        "tables/methods.parquet",
        "Every method on every robot where it makes sense: what it removes, what it takes, what it needs to measure.",
        (
            *_RESULT,
            *numbers(removed_share="1 - after_mean_mm / before_mean_mm"),
            Column("points_needed", "int64", _NEEDED),
            *numbers(needed_time_s="measuring time of these"),
            Column("needs", "str", "what has to be measured"),
        ),
        ("robot", "method", "test"),
    ),
    Table(
        "method_points",
        "tables/method_points.parquet",
        "The same with fewer points to learn from.",
        _RESULT,
        ("robot", "method", "test", "points"),
    ),
    Table(
        "method_timings",
        "timings/methods_{robot}.parquet",
        "Computing time of every method on this machine; differs from run to run, as all of timings/ does.",
        (
            *(_ROBOT, _METHOD, Column("points", "int64", "points to learn from")),
            *numbers(seconds="wall time of learning"),
        ),
        ("robot", "method", "points"),
    ),
)
