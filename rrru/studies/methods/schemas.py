"""Tables of the comparison of methods across the robots."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
robot                  str    mechanism: rrru3, ptt3 or delta
method                 str    name; see `needs` in methods
test                   str    targets inside the region of the training points, or outside of it {inside, outside}
points                 int    training points; for jacobian_step the targets themselves, for images the poses
before_mean_mm         float  mean true distance from the target with the nominal controller
before_max_mm          float  largest one
after_mean_mm          float  mean true distance from the target, the robot driven again with the corrected commands
after_max_mm           float  largest one
numbers                int    numbers learned: parameters, or weights and thresholds
measuring_time_s       float  time of the robot's campaign, moves and rests
evaluations            int    model positions solved; 0 where a method needs no model to learn

## methods | tables/methods.parquet | robot method test
Every applicable method on every robot: explained fraction, effort, and required measurements.
--
robot method test points before_mean_mm before_max_mm after_mean_mm after_max_mm numbers measuring_time_s evaluations
removed_share          float  1 - after_mean_mm / before_mean_mm
points_needed          int    fewest points from which on the mean error inside is within a tenth, or the tracker's
    noise, of that with all points
needed_time_s          float  measuring time of these
needs                  str    what has to be measured

## method_points | tables/method_points.parquet | robot method test points
The same with fewer training points.
--
robot method test points before_mean_mm before_max_mm after_mean_mm after_max_mm numbers measuring_time_s evaluations

## method_timings | timings/methods_{robot}.parquet | robot method points
Computing time of every method on this machine; differs from run to run, as all of timings/ does.
--
robot method
points                 int    training points
seconds                float  wall time of learning
""")
