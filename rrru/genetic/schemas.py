"""Tables of the genetic algorithm and its sweeps."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
campaign               str    name of the campaign in the configuration
calibration            str    set of trajectories that was calibrated on; none before any calibration
seed                   int    number of the run
objective_mm           float  mean distance that the run reached
generations            int    generations done
evaluations            int    evaluations of the objective
stopped                str    why it stopped {generations, stalled}
generation             int    0: initial population
best_mm                float  lowest mean distance so far
mean_mm                float  mean over the population; infinite where a member is out of reach
method                 str    how: least_squares, least_mean_distance (the optimum of the paper's objective), genetic;
    none before
operators              str    reading of the paper: MATLAB's step with Gaussian or adaptive feasible mutation, PyGAD's
    own operators {matlab_gaussian, matlab_adaptive, pygad}
stop                   str    where the run ends: after 50 generations without progress (or as configured), or at its
    last generation {stall, end}
parameter              str    swept setting {crossover_fraction, migration_fraction}
population             str    one population, or islands {one, islands}
value                  float  value of the setting

## genetic | tables/genetic.parquet | campaign calibration seed
One row per run of the genetic algorithm with the chosen settings, with the least mean distance that it should find.
--
campaign calibration seed objective_mm generations evaluations stopped
polished_mm            float  mean distance after a local polish from where the run ended
optimum_mm             float  least mean distance within the bounds, found from the least-squares fit
polish_evaluations     int    evaluations of the local polish
excess                 float? objective_mm / optimum_mm - 1; null where the optimum is zero
polished_excess        float? polished_mm / optimum_mm - 1; null where the optimum is zero

## genetic_parameters | tables/genetic_parameters.parquet | campaign calibration seed parameter
Deviations that the runs in `genetic` found: those searched, and da = dr - dR, the part of both that can be identified.
--
campaign calibration seed
parameter              str    name of the parameter
unit                   str    unit of the value {rad, mm}
value                  float  deviation from the nominal value

## genetic_history | tables/genetic_history.parquet | campaign calibration seed generation
Convergence of the runs in `genetic`: every generation up to 100, every 10th after it, and the last.
--
campaign calibration seed generation best_mm mean_mm

## genetic_against_least_squares | tables/genetic_against_least_squares.parquet | campaign calibration method
Methods side by side on every calibration; the genetic algorithm's entries are medians over its seeds.
--
campaign calibration method
runs                   int    seeds; 1 for a method without seeds
mean_mm                float  mean distance reached (median over the seeds)
worst_mean_mm          float  mean distance of the worst seed
excess                 float? mean_mm over the least mean distance - 1; null where that is zero
evaluations            float  evaluations of all residuals (median over the seeds)
angle_error_rad        float? RMS deviation of the drive-angle errors from the truth; null where it is unknown
length_error_mm        float? RMS deviation of dL1, dL2, dL3 and da from the truth

## timings | timings/{campaign}.parquet | campaign calibration method
Time of one calibration by each method on this machine; the only table whose bytes differ from run to run.
--
campaign calibration method
seconds                float  wall time of one calibration (median over the seeds)

## sweep_runs | tables/sweep_runs.parquet | operators stop parameter population value seed
Runs of the sweeps of the crossover and migration fraction: each to the end, and stopped where it stalled first.
--
operators stop parameter population value seed objective_mm generations evaluations stopped

## sweep_parameters | tables/sweep_parameters.parquet | operators stop parameter population value seed name
Deviations that the runs in `sweep_runs` found.
--
operators stop parameter population value seed
name                   str    name of the robot's parameter
unit                   str    unit of the deviation {rad, mm}
deviation              float  deviation from the nominal value

## sweep_history | tables/sweep_history.parquet | operators parameter population value seed generation
Convergence of the runs in `sweep_runs`: every generation up to 100, every 10th after it, and the last.
--
operators parameter population value seed generation best_mm mean_mm

## sweep_effect | tables/sweep_effect.parquet | operators stop parameter population
Whether a setting's effect is significant against the variation between seeds: Kruskal-Wallis test over all values.
--
operators stop parameter population
settings               int    values compared
runs                   int    runs compared
statistic              float  H
p_value                float  probability of such differences if the setting had no effect
epsilon_squared        float  share of the rank variance that the setting explains
statistic_mutating     float  H without the crossover fraction 1.0, where nothing mutates
p_value_mutating       float  the same
epsilon_squared_mutating float  the same
distinguishable_mutating bool   p_value_mutating below 5 %

## sweep_pairs | tables/sweep_pairs.parquet | operators stop parameter population value
Every value against the one with the lowest median: Mann-Whitney test, corrected after Holm.
--
operators stop parameter population value
best_value             float  value with the lowest median
median_mm              float  median mean distance
difference_mm          float  median minus that of the best value
difference_low_mm      float? lower end of the 95 % bootstrap interval
difference_high_mm     float? upper end
p_value                float  Mann-Whitney, two-sided
p_holm                 float  corrected for the number of values
distinguishable        bool   p_holm below 5 %
""")
