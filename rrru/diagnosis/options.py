"""Thresholds and settings of the diagnosis in one place, each with the reason for its value."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class DiagnosisOptions:
    """What limits a diagnosis, one field a threshold; the comment above a field says why it has its value.

    The unit is the end of a name; a ratio, share or probability has none. nats: differences of log evidence or of log
    predictive density, natural logarithm; 3 nats are odds of 20 to 1. "Assumed" marks a value that no source gives and
    no derivation supports.
    """

    # --- which readings are used ---
    # numbers read beyond the calibration's parameters: 20 degrees of freedom give the noise within 16 %, 1 sigma
    min_spare_numbers: int = 20
    # sets of effects compare on the readings at which all of them have what they need: with fewer of these an effect
    # would cost the others more than half of their readings
    min_complete_share: float = 0.5
    # with fewer numbers for each parameter large effects alone are found, and `few_readings` says so; assumed
    few_numbers_per_parameter: float = 9.0
    # share of a campaign's points that is usually diagnosed; a note says so where fewer are; assumed
    min_used_share: float = 0.8
    # bounds of geometric parameters: wider than a calibration's, at which a strong effect would end; assumed
    parameter_bound_rad: float = 0.3
    parameter_bound_mm: float = 100.0
    # priors of the errors of links and joints, 1 sigma: machining and assembly leave a tenth of these; readings that
    # determine a parameter outweigh it, and parameters that none determines stay near the nominal robot. Frames,
    # targets and zeros of drives may be anywhere within the bounds; assumed
    body_error_sd_rad: float = 0.03
    body_error_sd_mm: float = 10.0

    # --- sense of arrival of the drives ---
    # steps of a drive below these are rounding of its values
    drive_rounding_rad: float = 1e-8
    drive_rounding_mm: float = 1e-6
    # orders of the differences of drive values that jitter is found from; assumed
    min_difference_order: int = 2
    max_difference_order: int = 10
    # fewer differences have no median; assumed
    min_differences: int = 8
    # a larger share of the widest swing of a drive is no jitter but a motion of which hardly a point is read; assumed
    max_jitter_per_swing: float = 1e-3
    # two readings of a drive at rest differ by more than so many deviations of the jitter once in 50,000 pairs
    rest_width_per_jitter_sd: float = 6.0
    # degree of the splines of a finer interpolation: its distance from the coarser one bounds the coarser one's error
    finer_spline_degree: int = 7
    # two interpolations that are this far apart may both be as far off, to opposite sides
    interpolation_error_factor: float = 2.0
    # a sense of arrival that changes the residual by less than this share of the noise is not estimated; assumed
    min_approach_response_per_noise: float = 0.1
    # drives of one stop whose senses are estimated together, in all combinations; bounds the time
    max_jointly_estimated_drives: int = 10

    # --- noise and linearisation ---
    # share of the numbers read that the fitted columns leave, so that each reading still shows its noise; assumed
    min_free_share: float = 0.1
    # probability that noise alone adds an order, or a jump, of a search to the columns that it is estimated after;
    # assumed
    max_searched_p: float = 0.01
    # probability of smaller residuals by chance below which the noise is found again after a fit; assumed
    max_noise_again_p: float = 0.01
    # a reading that an effect of many coefficients explains is one of its own where the other stops predict it with the
    # effect, of the mean square without it, with this share or more; assumed
    max_unsupported_share: float = 0.5
    # rounds of leaving out outliers; assumed
    max_outlier_rounds: int = 3
    # rounds of search and fit until the best hypothesis stays; assumed
    max_search_rounds: int = 6
    # a gap below so many times the noise is small: it is tested whether the model is linear over it; assumed
    max_small_gap_per_noise: float = 10.0
    # nonlinearity, rms, below this share of the noise is negligible; assumed
    max_nonlinearity_per_noise: float = 0.1
    # the discrepancy's spectrum loses half its density at this half-wave number along a run; assumed
    discrepancy_half_density_wave_number: float = 3.0
    # share of the discrepancy's spectrum that is white; assumed
    discrepancy_white_share: float = 0.01

    # --- search over sets of effects and their evidence ---
    # probability of offsets between the runs from which on they are an alternative to functions that can follow them
    min_offset_probability: float = 0.5
    # prior probability that an effect which may act on each leg by itself acts on several and not on all; assumed
    prior_some_legs: float = 0.1
    # sets this far below the best are not worth an evaluation: e^-6 is 0.0025
    window_nats: float = 6.0
    # a set this far below the best at one discrepancy level is tried at no other level: e^-15 is 3e-7
    hopeless_nats: float = 15.0
    # another noise model whose log likelihood after a short search is this far below what it needs gets no full search:
    # that has added 0.3 nats on one robot; assumed
    max_climb_below_nats: float = 3.0
    # a set of a smaller share of the probability has no neighbours that matter; assumed
    min_expanded_probability: float = 0.01
    # a note says so where probabilities by searches from different starts differ by more; assumed
    max_searches_apart: float = 0.05
    # sets whose neighbours are evaluated in one search; bounds the time
    max_expanded_sets: int = 80
    # neighbours that are evaluated whatever they seem worth, for each term taken out, and at most of a set; assumed
    min_neighbours: int = 2
    max_neighbours: int = 40
    # sets of up to so many effects are averaged over all combinations of prior scales: 8^2 of them
    max_jointly_averaged_effects: int = 2
    # effects of a set at most; assumed, bounds the time
    max_effects: int = 12
    # sweeps in which each of many prior scales is found given the others; assumed
    prior_scale_sweeps: int = 2
    # results of each kind in the cache of the evidence; bounds the memory
    max_cached_results: int = 256
    # the calibration explains a term up to this share of its mean square: the rest is rounding
    min_visible_share: float = 1e-9

    # --- payload and tilt of the base as nuisance parameters ---
    # prior probability that a mass, or a tilt, is as stated; assumed
    stated_nuisance_probability: float = 0.5
    # standard deviation where it is as stated, over that where it is not; assumed
    stated_nuisance_sd_ratio: float = 0.1
    # standard deviation of the payload over the stated mass; where none is stated, over the robot's masses; assumed
    payload_sd_per_stated_mass: float = 0.3
    payload_sd_per_robot_mass: float = 0.1
    # standard deviation of the tilt of the base about each level axis: 1 degree; assumed
    tilt_sd_rad: float = float(np.radians(1.0))
    # share of the stated mass that may be missing: a mass is positive
    max_missing_mass_share: float = 0.9
    # bounds of a nuisance parameter in standard deviations; assumed
    nuisance_bound_sd: float = 10.0
    # a standard deviation of this share fixes a nuisance parameter
    fixed_nuisance_sd_ratio: float = 1e-4
    # neighbours of the grid of prior scales are about three apart: one next to a size may be this share of it
    min_prior_scale_per_size: float = 0.5

    # --- posterior and verdict ---
    # hypotheses so far below the best have no probability that matters: e^-25 is 1e-11
    negligible_nats: float = 25.0
    # an effect that predicts left-out points worse by more than this is ruled out; with something unexplained it has to
    # predict them better by as much
    max_heldout_loss_nats: float = 3.0
    # an answer is rejected where its predictions at left-out stops are further off than those of the calibration alone,
    # in mean square and at more stops than chance explains, by so many standard deviations; the usual 5 %
    max_further_off: float = 2.0
    # no cause is named while "none" is more probable: a false alarm costs more than a small gap that is not found
    max_none_probability: float = 0.2
    # rivals less probable than this share of the verdict's probability are not named; the usual 5 %
    min_rival_probability_ratio: float = 0.05
    # a cause, or a group, is named from this probability on: a false name costs as much as 2.3 missed ones; assumed
    min_named_probability: float = 0.7
    # with something unexplained an effect that makes less of the gap, or without which what remains is larger by less,
    # may be a part of that; the usual 5 %
    min_share_with_unexplained: float = 0.05
    # an effect that follows the variable of the remainder has to be so many times as large: a smaller one may be a part
    # of the remainder that has its form by chance; assumed
    min_size_per_remainder: float = 2.0
    # causes of less probability are excluded; the usual 5 %
    min_possible_probability: float = 0.05
    # causes of a group act together less often than this share of what independent ones do; assumed
    max_joint_probability_ratio: float = 0.5
    # a longer list of rivals says nothing; assumed
    max_group_size: int = 3
    # something unexplained is more probable than not
    min_unexplained_probability: float = 0.5
    # the best answer leaves a residual of so many times the noise: the robot is not the one that was measured. An arm
    # without an effect for its worst cause leaves ten or twenty times, exchanged drives or a wrong tool thousands of
    # times; assumed
    max_left_per_noise: float = 100.0
    # residuals of stops in no order that are so many times the noise of repeated poses have a part that is unexplained
    # and larger than that noise: the root of two
    min_left_per_repeats: float = 1.414
    # a verdict of this probability needs no further run; one of less has rivals even where none is named; assumed
    min_sure_probability: float = 0.9

    # --- fit of the exact model ---
    # step of a difference quotient over a coefficient's size; assumed
    difference_step_ratio: float = 1e-4
    # a coefficient below this share of its typical size is next to zero: the step is the typical size; assumed
    min_coefficient_per_typical: float = 1e-3
    # an effect's coefficients are rarely more than so many times their typical size; assumed
    prior_sd_per_typical: float = 20.0
    # a hundredth of a standard error is below what any verdict depends on
    step_tolerance_per_standard_error: float = 1e-2
    # a fit of more parameters has one start: nearly all are coefficients of functions, in which the model is linear
    max_parameters_of_several_starts: int = 200
    # more of them end within a fiftieth of a nat, since their steps are slow
    step_tolerance_of_many: float = 0.3
    max_iterations_of_many: int = 25
    # fits whose log posterior densities differ by less are equally good; assumed
    equal_fits_nats: float = 1.0

    # --- held-out points and detectability ---
    # where a trajectory was driven once only, its runs are cut into stretches of about so many points; assumed
    points_per_stretch: int = 5
    # number of folds of stretches: the usual five
    stretch_folds: int = 5
    # more runs than this share folds; bounds the time
    max_run_folds: int = 20
    # fewer runs than this are resampled by stretches: too few for a bootstrap of runs; assumed
    min_resampled_runs: int = 10
    # the calibration explains an effect up to this share, rms: the rest is rounding
    min_visible_rms_share: float = 1e-6
    # a detectable effect is found 9 times of 10 at 1 % false alarms; usual values
    detection_power: float = 0.9
    false_alarm_probability: float = 0.01

    # --- budget and places of the gap ---
    # effects of less probability, and products of two effects of a smaller share, are not listed; assumed
    min_budget_probability: float = 0.02
    min_covariance_share: float = 0.005
    # quantiles of a 95 % interval
    interval_quantiles: tuple[float, float] = (0.025, 0.975)
    # the worst spot is the middle of so many neighbours with the largest mean square; assumed
    worst_spot_neighbours: int = 9
    # a speed or payload with more distinct values than this is not a factor; assumed
    max_factor_levels: int = 12
    # noise explains a part that is smaller than what noise exceeds with this probability; the usual 5 %
    min_noise_p_value: float = 0.05
    # drives slower than this, in their unit a second, are at rest; assumed
    min_drive_rate: float = 1e-6

    # --- what the unexplained part looks like ---
    # scales of a smooth function over the range of its variable: from ten waves to one; assumed
    remainder_scales: tuple[float, ...] = (0.05, 0.1, 0.2, 0.4, 0.8)
    # inducing points of such a function; bounds the time
    remainder_points: int = 40
    # length scales of the functions that may bias the parameters, over the range of their variable: from five waves to
    # less than one; their sizes over that of the residuals; their inducing points are as near as a length scale and a
    # half asks for, where the function between them is known to 2 %
    bias_scales: tuple[float, ...] = (0.1, 0.2, 0.4, 0.8, 1.6)
    bias_amplitudes: tuple[float, ...] = (0.3, 1.0, 3.0, 10.0)
    bias_spacing: float = 0.5
    # it follows a variable where that predicts this share of it at left-out points: more than all others together
    min_followed_share: float = 0.5

    # --- notes and text of the answer ---
    # standard errors from which on a note says that payload or tilt differ from the stated ones; the usual 3 sigma
    min_nuisance_z: float = 3.0
    # the same of a drive's zero; assumed, a false note makes somebody reset the zeros of a robot without need
    min_zero_z: float = 4.0
    # a parameter most of whose variance comes from the priors is not determined by the readings
    max_prior_variance_share: float = 0.5
    # how far the instrument's frame, a tool or a target may be off its stated place; assumed
    outside_error_mm: float = 10.0
    outside_error_rad: float = 0.03
    # rows of the table of sets; assumed
    max_listed_sets: int = 20
    # a text that lists more fitted numbers says how many there are; the table has them; assumed
    max_listed_numbers: int = 3
    # a size whose interval has an end below this share of its value may be zero: the interval of a size that cannot be
    # negative ends next to zero and not on it; assumed
    min_end_ratio: float = 1e-3
    # a share of the gap that is worth a sentence; assumed
    min_mentioned_share: float = 0.05
    # a share whose 95 % interval covers this part of 0 to 1 is not determined: the sentence gives no number; assumed
    max_share_interval: float = 0.9
    # a cause of a smaller share of the gap, or of a smaller size over the noise, is in the table only; assumed
    min_cause_share: float = 0.01
    min_cause_per_noise: float = 0.3
    # random error gets a sentence where it is more probable than not
    min_scatter_probability: float = 0.5
    # it is no random error where more than half of it continues from stop to stop: a part that does not continue lowers
    # the correlation of successive residuals by its share. A correlation of white noise has no more standard deviations
    # than these: assumed, as of zeros
    min_serial_correlation: float = 0.5
    min_serial_z: float = 4.0
    # a larger share is not printed: confounded effects add up to a little more than the whole; assumed
    max_mentioned_share: float = 1.5

    # --- experiment design: the next runs and poses ---
    # speed of a fast pass where no `limits` state it, and mass that a loaded pass adds where neither `limits` nor the
    # efforts of the robot's file determine it; assumed
    default_fast_pass_mm_s: float = 300.0
    default_added_payload_kg: float = 5.0
    # a payload that is not stated is at most this share of what the robot itself moves, and at least so much; assumed
    max_payload_per_moved_mass: float = 0.5
    min_added_payload_kg: float = 0.1
    # share of a drive's effort that a payload may bring it to: the rest is for acceleration and friction; assumed
    max_effort_share: float = 0.8
    # pause between runs; assumed
    pause_between_runs_s: float = 60.0
    # runs that are advised; assumed
    max_advised_runs: int = 3
    # poses at another speed or payload are worth it where they gain this many times as much; assumed
    min_gain_ratio_of_harder_poses: float = 1.1
    # trajectories that runs are designed for, answers that they should tell apart, and poses of a run; assumed, bound
    # the time
    max_advised_trajectories: int = 4
    max_rival_answers: int = 5
    max_advised_poses: int = 40
    # answers of less probability are no rivals that a run is designed for; assumed
    min_rival_answer_probability: float = 0.02
    # axes of the covariance of an effect's coefficients along which data are made; assumed, bounds the time
    max_spread_axes: int = 6
    # poses are advised where no run resolves this share of the doubt; assumed
    decisive_share: float = 0.9
    # after the first few poses others are chosen until this share of the doubt is resolved, each only if it resolves at
    # least the given share of the rest; assumed
    enough_share: float = 0.95
    few_poses: int = 10
    min_share_of_rest: float = 0.05
    # less expected log Bayes factor than this is not worth a run: it is "not worth more than a bare mention" (Kass and
    # Raftery, Bayes factors, Journal of the American Statistical Association 90, 1995)
    min_run_gain_nats: float = 1.0
    # this gain makes a rival 20 times less probable, which rules it out
    decisive_gain_nats: float = 3.0
    # points that are read on a short pass, and its length; assumed
    points_per_pass: int = 5
    pass_length_mm: float = 100.0
    # a drive that turns further between two points of a pass goes round, or past a singularity; assumed
    max_pass_step_rad: float = 0.5
    # log2 of the number of passes that are tried: 128; assumed, bounds the time
    tried_passes_log2: int = 7
    # a pass has at least this share of the campaign's own distance from singularities; assumed
    min_singularity_distance_ratio: float = 0.8

    # --- harmonics of effects ---
    # orders of the periodogram per resolved one; assumed, finer than the width of a peak
    orders_per_resolution: int = 6
    # lowest order of the periodogram over the resolution: half a wave over the range of a drive, below which it is
    # nearly a parabola; assumed
    lowest_order_ratio: float = 0.5
    # peaks of a periodogram that become shapes, and shapes of an effect at most; assumed, bound the time
    max_periodogram_peaks: int = 2
    max_effect_shapes: int = 8
    # peaks closer than this share of the resolution are the same order; assumed
    min_order_distance_ratio: float = 0.03
    # standard error of an order that was found, over the resolution; assumed
    order_sd_ratio: float = 0.1
    # the calibration explains a combination of waves of which a smaller share remains; assumed
    min_remaining_wave_share: float = 1e-6
    # prior probability that an effect of any order has the stated one; assumed
    stated_order_probability: float = 0.5

    # --- spectra of the drives ---
    # orders of the grid per resolved one; the order is refined between them
    spectrum_orders_per_resolution: int = 2
    # highest order a turn; assumed
    max_spectrum_order: float = 64.0
    # more waves are a rough function, not a few waves; assumed
    max_spectrum_waves: int = 30
    # numbers read for each wave at least; assumed
    min_numbers_per_spectrum_wave: int = 20
    # the calibration explains a wave of which it leaves less than this share of the longest one; assumed
    min_free_wave_length_ratio: float = 1e-3
    # share of a wave's squares that the calibration has to leave; assumed
    min_free_wave_share: float = 0.01
    # remaining length of a wave of unit length below which the waves found before explain it; rounding
    min_new_wave_length: float = 1e-6
    # a wave's order differs from that of the grid by at most so many steps: half a step, and a margin
    max_order_shift_steps: float = 0.75
    # functions of a drive whose power, summed over the readings, is below this share of the noise's variance are left
    # out: ten thousand of them are worth half a nat
    min_function_power_per_noise: float = 1e-4
    # logarithms of signal over noise that are tried: from, to, how many; signals of 0.02 to 1,000 times the noise
    min_log_signal_to_noise: float = -4.0
    max_log_signal_to_noise: float = 7.0
    tried_signal_to_noise: int = 23

    # --- corrected files ---
    # a corrected file that leaves more than so many times what the diagnosis leaves gets a note
    max_file_remainder_ratio: float = 1.1
    # poses at which a corrected file is compared with the diagnosis in addition to the measured ones: their rms is good
    # to 5 %
    fresh_poses: int = 200
    # lines of the grid along each axis; assumed
    drive_table_grid_lines: int = 7
    # a grid point has a measured point within so many steps of the grid: no extrapolation
    max_grid_distance_steps: float = 1.0
    # extents below this are none; rounding
    min_extent_mm: float = 1e-6
    # a drive's error changes with the drive so slowly that after two iterations it stays; one more is a margin
    correction_iterations: int = 3
    # drive values of both senses that are closer, in the drives' unit, are the same; rounding
    min_sense_difference: float = 1e-12
    # a simulation takes about a tenth of a second a point: no more points are driven, from the first on
    max_driven_points: int = 300


OPTIONS = DiagnosisOptions()
