"""Tables of paper B's study: the 3-PTT, its backlash, and its compensation through the Jacobian and a network."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
factored_determinant   float? - height_factor kappa / (D1 D2 D3); null out of reach or with inclined rails
height_factor_mm       float? Z: zero with the platform in the plane of the rails
kappa_mm2              float? zero where the three links' horizontal parts meet in a point or are parallel
least_d_mm             float? least D_i: zero with a link perpendicular to its rail, where J is unbounded
payload_kg             float  payload on the platform
leg                    int    1 to 3
experiment             str    name of the experiment in the configuration
point                  int    number of the point along the curve, from 1
set                    str    train: learned from; test: the others {train, test}
method                 str    rbf_inverse, rbf_jacobian: cross-validated network through eq. (11) or eq. (12);
    rbf_absolute: with the common height error; rbf_paper, rbf_paper_mm: the paper's spread of scaled inputs or in mm,
    all neurons; interpolator: biharmonic spline; parameters: calibrated model; rbf_after_parameters: network on the
    residuals of the calibration
axis                   str    z: heights relative to the first point's error, as in the paper; z_mean: to the mean
    error of all points; z_absolute: unchanged {x, y, z, z_mean, z_absolute}
before_mm              float  A_b
after_mm               float  A_a
benefit_percent        float  P_g
spread_from            str    candidate: of the configuration; paper_scaled, paper_mm: the paper's, interpreted for
    inputs scaled to -1 .. 1 or as mm {candidate, paper_scaled, paper_mm}
learns                 str    correction: the network's output is dp; position: p - dp, as in the paper
    {correction, position}
spread_mm              float  distance at which a neuron's output is one half

## ptt_kinematics | tables/ptt_kinematics.parquet | position
Inverse and forward kinematics of given positions (paper B, Table 2), and det J there, directly and by its factors
(eq. 5).
--
position               int    number of the position
given_{xyz}_mm         float  given position
slider{123}_mm         float  position of slider {123} by eq. (2)
forward_{xyz}_mm       float  position that these give by the forward kinematics
difference_mm          float  distance between the two
determinant            float  det J of eq. (10), numerically
factored_determinant height_factor_mm kappa_mm2 least_d_mm

## ptt_singularity | tables/ptt_singularity.parquet | slice x_mm y_mm z_mm
Regular grid over two slices of the 3-PTT's workspace: xz at y = 0, and xy at half the curve's height.
--
slice                  str    plane {xz, xy}
{xyz}_mm               float  grid point
reachable              bool   true where all three links reach
translational_measure  float? 0 where the platform can move with locked drives; null out of reach
constraint_measure     float? 0 where the platform can turn with locked drives; null out of reach
determinant            float? det J, numerically; null out of reach
factored_determinant height_factor_mm kappa_mm2 least_d_mm

## ptt_encoder | tables/ptt_encoder.parquet | payload_kg leg sample
Readings of the linear encoder on the bench (paper B, Fig. 7 and Table 4): every screw turned forwards, back and
forwards again.
--
payload_kg leg
sample                 int    number of the reading, from 1
pass                   str    direction of the screw {forward_1, reverse, forward_2}
commanded_mm           float  slider position that the screw was turned to
encoder_mm             float  slider position that the encoder read

## ptt_backlash | tables/ptt_backlash.parquet | payload_kg leg
Backlash of every screw under every load by eq. (19) (paper B, Table 5).
--
payload_kg leg
backlash_mm            float  e_j: mean of the next two
first_mm               float  e_j1: reverse pass minus the first forward one, mean over the same places
second_mm              float  e_j2: reverse pass minus the second forward one
standard_error_mm      float  of backlash_mm, from the scatter over the places
true_mm                float  the virtual screw's

## ptt_repeatability | tables/ptt_repeatability.parquet | leg compensated
Repeatability of the sliders per unit travel, the curve passed forwards and backwards in turn (paper B, eq. 20 and
Table 6).
--
leg
compensated            bool   whether the command jumped by the measured backlash at a reversal
travel_mm              float  K: between the slider's outermost places
scatter_mm             float  standard deviation over the repeats, pooled over the places
per_travel_um_per_mm   float  sigma_1 or sigma_2: scatter over travel
noise_um_per_mm        float  the value from the tracker's noise alone

## ptt_points | tables/ptt_points.parquet | experiment point
Every point of every experiment: measured, corrected, and driven again with the chosen network (paper B, Tables 7 and
8, Figs. 10, 12, 14, 16 and 18). Positions are means over the repeats.
--
experiment point set
command_{xyz}_mm       float  commanded position
measured_{xyz}_mm      float  measured position before compensation
corrected_{xyz}_mm     float  p - dp: command minus error
network_{xyz}_mm       float  the network's corrected position minus that one
before_{xyz}_mm        float  error before compensation, z from the first point's
after_{xyz}_mm         float  error when driven again with the network's correction, z from the first point's
before_z_absolute_mm   float  height error before compensation
after_z_absolute_mm    float  height error when driven again

## ptt_benefit | tables/ptt_benefit.parquet | experiment method set axis
Mean absolute errors before and after every kind of compensation, driven again, and the benefit P_g (paper B, eq. 21
and Fig. 17).
--
experiment method set axis before_mm after_mm benefit_percent
benefit_low_percent    float? 5 % quantile over redraws: new noise in the measurements and when driven again, new
    split into training and test points; null for methods that are not redrawn
benefit_high_percent   float? 95 % quantile

## ptt_start | tables/ptt_start.parquet | experiment start_deg axis
ptt_benefit of rbf_jacobian on the test points, for other start azimuths of the curve, one draw each. The paper's z
depends on the first point. At the configured start no slider reverses; other starts are worse in the paper's measure
and hardly worse in z_mean.
--
experiment
start_deg              float  azimuth of the first point
axis before_mm after_mm benefit_percent

## ptt_training | tables/ptt_training.parquet | experiment spread_from learns spread_mm neurons
Mean squared error of the network as neurons are added (paper B, Fig. 13).
--
experiment spread_from learns spread_mm
neurons                int    hidden neurons
train_mse_mm2          float  on the training points, mean over the axes
validation_mse_mm2     float  by cross-validation on the training points
test_mse_mm2           float  on the test points

## ptt_spread | tables/ptt_spread.parquet | experiment spread_from learns spread_mm
Every spread with its best number of neurons by cross-validation (paper B, 3.3, prints 3.4 to 3.8
without a unit).
--
experiment spread_from learns spread_mm
chosen                 bool   true for the candidate that is used
neurons                int    with the least cross-validated error
train_rms_mm           float  error per axis on the training points
validation_rms_mm      float  error per axis by cross-validation on the training points
test_rms_mm            float  error per axis on the test points

## ptt_corrections | tables/ptt_corrections.parquet | experiment point leg
Corrections of every slider by the chosen network, through the exact inverse kinematics and through the Jacobian (paper
B, Fig. 15).
--
experiment point leg
nominal_mm             float  slider position without correction
inverse_mm             float  correction by eq. (11)
jacobian_mm            float  correction by eq. (12)
difference_um          float  the former minus the latter

## ptt_extrapolation | tables/ptt_extrapolation.parquet | experiment family size method axis
Extrapolation of a correction: errors on a changed curve without and with it, all points.
--
experiment
family                 str    the changed quantity; reverse: the same curve backwards {none, radius_mm, height_mm,
    reverse, payload_kg}
size                   float  by how much, in the unit that the family names
method axis
before_mm              float  mean absolute error of the changed curve without correction
after_mm               float  with correction
benefit_percent        float  as in ptt_benefit; negative where the correction increases the errors
""")
