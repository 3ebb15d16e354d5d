"""Tables of the comparison of methods across the robots."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
robot                  str    mechanism: rrru3, ptt3 or delta
method                 str    what is learned; see `needs` in methods
test                   str    targets inside the region that was learned on, or outside of it {inside, outside}
points                 int    points measured to learn from; of jacobian_step the targets themselves, of images the
    poses
before_mean_mm         float  mean true distance from the target with the nominal controller
before_max_mm          float  largest one
after_mean_mm          float  mean true distance from the target, the robot driven again with the corrected commands
after_max_mm           float  largest one
numbers                int    numbers learned: parameters, or weights and thresholds
measuring_time_s       float  time of the robot's campaign, moves and rests
evaluations            int    model positions solved; 0 where a method needs no model to learn

## methods | tables/methods.parquet | robot method test
Every method on every robot where it makes sense: what it removes, what it takes, what it needs to measure.
--
robot method test points before_mean_mm before_max_mm after_mean_mm after_max_mm numbers measuring_time_s evaluations
removed_share          float  1 - after_mean_mm / before_mean_mm
points_needed          int    fewest points tried from which on the mean error inside stays within a tenth, or the
    tracker's noise, of that with all points
needed_time_s          float  measuring time of these
needs                  str    what has to be measured

## method_points | tables/method_points.parquet | robot method test points
The same with fewer points to learn from.
--
robot method test points before_mean_mm before_max_mm after_mean_mm after_max_mm numbers measuring_time_s evaluations

## method_timings | timings/methods_{robot}.parquet | robot method points
Computing time of every method on this machine; differs from run to run, as all of timings/ does.
--
robot method
points                 int    points to learn from
seconds                float  wall time of learning
""")
