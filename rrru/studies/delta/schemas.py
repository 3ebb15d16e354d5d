"""Tables of the Delta's zero calibration by vision."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
pose                   int    number of the image, in the order driven
plane                  str    first: the paper's plane; second: the height that the variants on two planes add {first,
    second}
command_{xyz}_mm       float  commanded position, calibration frame
dots                   int    dots found
found                  float  as calibrated
variant                str    how the zero errors were found; none: before

## delta_truth | delta/truth.parquet | pose
True optical centres of the virtual robot in the target's frame.
--
pose plane command_{xyz}_mm
true_{xyz}_mm          float  true optical centre, target frame

## delta_centres | tables/delta_centres.parquet | pose
Optical centres as found in the images; dots are numbered from one of the first image, so that the origin is an
arbitrary dot of the target.
--
pose plane command_{xyz}_mm
centre_{xyz}_mm        float  optical centre -R_j' T_j, target frame
one_rotation_{xyz}_mm  float  the same with one rotation for all images
dots
reprojection_rms_px    float  distance between dots found and dots of the fitted pose, RMS

## delta_dots | tables/delta_dots.parquet | pose column row
Every dot found in every pose's image.
--
pose                   int    as in delta_centres
column                 int    number along the target's x, from a dot near the middle of the first image
row                    int    number along the target's y
x_px                   float  centre, from the middle of the first pixel to the right
y_px                   float  centre, downwards

## delta_picture | tables/delta_picture.parquet | y_px x_px
The image of the first pose.
--
y_px                   int    pixel, downwards from 0
x_px                   int    pixel, to the right from 0
grey                   int    0 to 255

## delta_lens | delta/lens.parquet | parameter
The camera as calibrated from tilted views.
--
parameter              str    entry of the camera matrix (px), distortion, or RMS of the reprojection (px)
found

## delta_camera | tables/delta_camera.parquet | parameter
The camera as calibrated from tilted views, compared with the true one.
--
parameter              str    as in delta_lens
found
true                   float? of the virtual camera; null where there is none

## delta_poses | tables/delta_poses.parquet | pose
Optical centres found in the images against the true ones; without the common shift of all poses, since the origin is an
arbitrary dot.
--
pose plane command_{xyz}_mm
error_{xyz}_mm         float  found minus true centre, minus the mean over the poses
one_rotation_error_{xyz}_mm float  the same with one rotation for all images
dots
reprojection_rms_px    float  as in delta_centres

## delta_calibrations | tables/delta_calibrations.parquet | variant
Every variant to estimate the zero errors, and the errors on the plane with the robot driven again after correction.
The variant paper is the paper's single linear step with equal weights of the distances. The others have converged and
account for the first pose's noise in every distance.
--
variant
source                 str    images: R_j and T_j of every image; one_rotation: the same images, one rotation for all;
    true_centres: for comparison; tracker {none, images, one_rotation, true_centres, tracker}
measure                str    distances from the first pose (paper C); shape: all displacements, the frame's motion
    free; heights or positions in the base frame {none, distances, shape, heights, positions}
planes                 str    one: z = 100; two: half of it and a second height {none, one, two}
poses                  int    poses used
equations              float? number of residuals
rank                   float? number of identifiable combinations of the three zero errors
condition              float? largest over smallest singular value of the Jacobian by the zero errors, rows brought to
    independent noise of one axis each (for the paper's step too, which itself counts all distances alike)
residual_rms_mm        float? RMS residual of the fit
noise_mm               float? noise of one axis estimated from it, assumed equal along all axes (optical centres' is
    larger along the target than across); length errors count as noise here
dtheta{123}_true_rad       float? true zero error of drive {123}
dtheta{123}_found_rad      float? zero error found of drive {123}
dtheta{123}_error_rad      float? found minus true zero error of drive {123}
dtheta{123}_standard_error_rad float? standard error from noise_mm as if the lengths were exact, the first pose's noise
    in all distances counted: zero error of drive {123}
dtheta{123}_length_error_rad float? 1 sigma of the bias from unknown length errors of all legs
    (`delta.length_error_mm`), in addition to the standard error: zero error of drive {123}
plane_mean_mm          float  mean error on the plane, in the calibration frame, as published
plane_max_mm           float  largest error on the plane, in the calibration frame, as published
base_mean_mm           float  mean error on the plane, in the frame of the robot's base
base_max_mm            float  largest error on the plane, in the frame of the robot's base

## delta_observability | tables/delta_observability.parquet | variant direction
Observable combinations of the three zero errors by variant, best first, and their bias from other errors.
--
variant
direction              int    1: best observable
weight_dtheta{123}         float  share of dtheta{123} in the unit direction
common_share           float  squared component of the direction with equal errors of all drives
kind                   str    common: that part is more than half {common, differential}
singular_value         float  change of the data, in mm of one axis's noise, per mm of arc at the end of the drive
    arm, see condition
standard_error_rad     float  of the combination, as in delta_calibrations
per_length_rad_mm      float  RMS error of the combination per mm (1 sigma) of unknown, independent length errors of
    all legs
per_scale_rad          float? error of the combination when the target is 0.1 mm per m too large; null without a
    target

## delta_robots | tables/delta_robots.parquet | variant length_error_mm
The same calibrations on other robots, whose zero and length errors are drawn, with plates and noise as in
delta_draws: mean error on the plane, over the robots.
--
variant
length_error_mm        float  1 sigma of every leg's lengths
robots                 int    robots drawn
plane_median_mm        float  median over the robots, in the calibration frame
plane_high_mm          float  90th percentile over the robots, in the calibration frame
base_median_mm         float  median over the robots, in the frame of the robot's base
base_high_mm           float  90th percentile over the robots, in the frame of the robot's base

## delta_draws | tables/delta_draws.parquet | variant
The same calibrations of the same robot with new random draws: dots of the plate, tilted views, noise of
the dots' centres and of the tracker; dots are projected, not rendered. Percentiles over the draws.
--
variant
draws                  int    draws
plane_mean_low_mm      float  5 % of the mean error on the plane, in the calibration frame
plane_mean_median_mm   float  median of the mean error on the plane, in the calibration frame
plane_mean_high_mm     float  95 % of the mean error on the plane, in the calibration frame
plane_max_low_mm       float  5 % of the largest error on the plane, in the calibration frame
plane_max_median_mm    float  median of the largest error on the plane, in the calibration frame
plane_max_high_mm      float  95 % of the largest error on the plane, in the calibration frame
base_mean_low_mm       float  5 % of the mean error on the plane, in the frame of the robot's base
base_mean_median_mm    float  median of the mean error on the plane, in the frame of the robot's base
base_mean_high_mm      float  95 % of the mean error on the plane, in the frame of the robot's base
base_max_low_mm        float  5 % of the largest error on the plane, in the frame of the robot's base
base_max_median_mm     float  median of the largest error on the plane, in the frame of the robot's base
base_max_high_mm       float  95 % of the largest error on the plane, in the frame of the robot's base

## delta_points | tables/delta_points.parquet | variant point
Errors on the plane z = 0 as the tracker measures them, before (none) and after correction by every variant.
--
variant
point                  int    number of the point
command_{xyz}_mm
error_{xyz}_mm         float  error in the calibration frame, defined by driving the robot along x and y
base_error_{xyz}_mm    float  error in the frame of the robot's base
error_mm               float  size in the calibration frame
base_error_mm          float  size in the base frame

## delta_timings | timings/delta/steps.parquet | step
Wall time of one calibration from images on this machine.
--
step                   str    camera: from tilted views, once per camera; centres: from the poses' images;
    zero_errors: the paper's step
images                 int    images read
seconds                float  wall time
""")
