"""Tables of the calibrations."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
campaign               str    name of the campaign in the configuration
calibration            str    set of trajectories that was calibrated on; none before any calibration
method                 str    how: least_squares, least_mean_distance (the optimum of the paper's objective), genetic;
    none before

## calibrations | tables/calibrations.parquet | campaign calibration method
One row per calibration: how well it fits and how well the points determine it.
--
campaign calibration method
points                 int    points fitted
mean_mm                float  mean distance: the paper's objective
rms_mm                 float  root mean square distance
max_mm                 float  largest distance
turn_rms_rad           float? root mean square angle between measured and model orientations; null where none was
    measured
noise_mm               float  noise per axis that the standard errors assume
noise_from             str    campaign: that of the whole campaign, whose source is in campaigns; residuals: of this
    fit, where these are larger {campaign, residuals}
rank                   int    parameter combinations that the points determine, of 7
condition              float  condition number of the scaled Jacobian (angles as arcs at the robot's own length)
O1_observability       float  geometric mean of the singular values over sqrt(points)
O2_observability       float  inverse condition
O3_observability       float  smallest singular value
O4_observability       float  smallest squared over largest
O5_observability       float  inverse sum of inverse singular values
evaluations            int    evaluations of the residuals
parameters_at_bound    int    parameters that ended at a bound

## parameters | tables/parameters.parquet | campaign calibration method parameter
Fitted deviations of the mechanism; da = dr - dR, since R and r enter only as r - R.
--
campaign calibration method
parameter              str    name of the parameter
unit                   str    unit of the value {rad, mm}
value                  float  fitted deviation from the nominal value
standard_error         float? 1 sigma; null for methods without one and for undetermined parameters
seen                   bool   false where the points do not determine it; its value is then nominal in part
at_bound               bool   true where the fit ended at a bound
true_value             float? the virtual robot's; null where it is unknown

## gauge | tables/gauge.parquet | campaign number
Geometric parameters of a user's robot that are not identifiable at the campaign's poses, and the combination of
estimated parameters that replaces each; none for built-in robots.
--
campaign
number                 str    name of a geometric parameter that is not identifiable
stands_for             str    combination of parameters that replaces one unit of it; nothing: it has no effect

## correlations | tables/correlations.parquet | campaign calibration parameter_a parameter_b
Correlation of the least-squares estimates.
--
campaign calibration
parameter_a            str    name
parameter_b            str    name
correlation            float? -1 to 1; null where a parameter is not determined

## observability | tables/observability.parquet | campaign calibration direction parameter
Directions of parameter space from the best determined to the worst, with their entries.
--
campaign calibration
direction              int    1: best determined
singular_value         float  mm of the stacked positions per mm along the direction
standard_error_mm      float? 1 sigma along the direction; null where it is not determined
parameter              str    name
weight                 float  entry of the unit direction, angles as arcs at the robot's own length
""")
