"""Tables of the errors before and under every calibration."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
campaign               str    name of the campaign in the configuration
calibration            str    set of trajectories that was calibrated on; none before any calibration
method                 str    how: least_squares, least_mean_distance (the optimum of the paper's objective), genetic;
    none before
mode                   str    before: measured minus commanded; model: measured minus calibrated model; closed_loop:
    driven again with corrected commands {before, model, closed_loop}

## errors | tables/errors.parquet | campaign calibration method mode run point
Error of every point before calibration and under every calibration.
--
campaign calibration method mode
run                    int    as in measurements
trajectory             str    as in measurements
point                  int    as in measurements
error_{xyz}_mm         float? error; null where the point was not used
error_mm               float? size of the error

## error_summary | tables/error_summary.parquet | campaign calibration method mode trajectory
The errors per trajectory (and all_lines, all), with accuracies after ISO 9283.
--
campaign calibration method mode
trajectory             str    trajectory, all_lines or all
points                 int    points with an error
min_mm                 float? minimum of the error's size
mean_mm                float? mean of the error's size
rms_mm                 float? root mean square of the error's size
max_mm                 float? maximum of the error's size
repeats                int    smallest number of passes under the same conditions
pose_accuracy_mm       float? ISO 9283 AP: largest distance of a barycentre from its command (mode model: from the
    model's position)
path_accuracy_mm       float? ISO 9283 AT: the same, across the path only
repeatability_mm       float? ISO 9283 RP: largest l + 3 S_l; null with fewer than 3 repeats
""")
