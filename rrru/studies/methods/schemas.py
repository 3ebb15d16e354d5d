"""Tables of the comparison of methods across the robots."""

from rrru.store.schema import NUMBER, Column, Table

_ROBOT = Column("robot", "str", "mechanism: rrru3, ptt3 or delta")
_METHOD = Column("method", "str", "what is learned; see `needs` in methods")
_RESULT = (
    _ROBOT,
    _METHOD,
    Column(
        "test", "str", "targets inside the region that was learned on, or outside of it", allowed=("inside", "outside")
    ),
    Column(
        "points", "int64", "points measured to learn from; of jacobian_step the targets themselves, of images the poses"
    ),
    Column("before_mean_mm", NUMBER, "mean true distance from the target with the nominal controller"),
    Column("before_max_mm", NUMBER, "largest one"),
    Column(
        "after_mean_mm",
        NUMBER,
        "mean true distance from the target, the robot driven again with the corrected commands",
    ),
    Column("after_max_mm", NUMBER, "largest one"),
    Column("numbers", "int64", "numbers learned: parameters, or weights and thresholds"),
    Column("measuring_time_s", NUMBER, "time of the robot's campaign, moves and rests"),
    Column("evaluations", "int64", "model positions solved; 0 where a method needs no model to learn"),
)
TABLES = (
    Table(
        "methods",
        "tables/methods.parquet",
        "Every method on every robot where it makes sense: what it removes, what it takes, what it needs to measure.",
        (
            *_RESULT,
            Column("removed_share", NUMBER, "1 - after_mean_mm / before_mean_mm"),
            Column(
                "points_needed",
                "int64",
                "fewest points tried from which on the mean error inside stays within a tenth, or the tracker's noise, of that with all points",
            ),
            Column("needed_time_s", NUMBER, "measuring time of these"),
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
            _ROBOT,
            _METHOD,
            Column("points", "int64", "points to learn from"),
            Column("seconds", NUMBER, "wall time of learning"),
        ),
        ("robot", "method", "points"),
    ),
)
