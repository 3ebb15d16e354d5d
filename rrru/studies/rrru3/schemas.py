"""Tables of paper A's study, in addition to those of every campaign."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
operators              str    interpretation of the paper, see `sweep_runs` {matlab_gaussian, matlab_adaptive, pygad}
stop                   str    where runs end, see `sweep_runs` {stall, end}
parameter              str    swept setting {crossover_fraction, migration_fraction}
population             str    one population, or islands {one, islands}
item                   str    what the number or order is, as in `published`
kind                   str    printed number or printed order {number, order}
restart                int    number of the restart, from 0 on
evaluations            int    candidates that were simulated
objective_nat          float  least objective so far: minus the log probability of what the paper prints

## sweep_match | tables/sweep_match.parquet | table operators stop population
Every interpretation of the genetic algorithm compared with Tables 3 and 4, whose curves are single runs.
--
table                  str    of the paper {Table 3, Table 4}
operators stop parameter population
settings               int    values that are compared
runs                   int    feasible runs of them
level_mm               float  mean of the medians here minus that of the printed curve; depends on the robot
distance_mm            float  RMS distance of medians and printed curve, each minus its mean
chance_low_mm          float  lower end of the middle 95 % of that distance for curves of single runs drawn here
chance_high_mm         float  upper end
nearest_seed           int    seed whose single curve is nearest to the printed one
nearest_seed_mm        float  RMS distance of that curve, each minus its mean
distance_shared_mm     float  the distance over the values that all interpretations have
nearest                bool   that distance is the least of this table of the paper
scatter_mm             float  range of the seeds at one value, median over the values
range_mm               float  range of the medians
chance_range_low_mm    float  lower end of the middle 95 % of the range of curves of single runs drawn here
chance_range_high_mm   float  upper end
printed_range_mm       float  range of the printed curve
verdict                str    reproduced where distance and range are within those of random curves {reproduced,
    not reproduced}

## twin_numbers | tables/twin_numbers.parquet | name
Every number of the twin that was searched, and the bounds of the search.
--
name                   str    name of the number
value                  float  value in the configuration
low                    float  lower bound of the search
high                   float  upper bound
at_bound               bool   within a hundredth of the bounds' width of one of them

## twin_restarts | tables/twin_restarts.parquet | restart
Restarts of the search for the twin, `snakemake --cores 2 twin`.
--
restart evaluations objective_nat
stopped                str    why it ended: no more progress, its evaluations were used up, or the search ended before
    {stalled, evaluations, search}
ended                  str    why the search ended: three restarts agree within 1 %, all restarts have ended, or its
    time was over {agreed, restarts, time}

## twin_progress | tables/twin_progress.parquet | restart evaluations
Progress of these restarts: the descents in which the best one improved, and the last.
--
restart evaluations objective_nat

## twin_hypotheses | tables/twin_hypotheses.parquet | hypothesis
Hypotheses about the paper's campaign and its robot, each searched with the same number of evaluations, to the end of a
descent; `snakemake --cores 2 twin_hypotheses`.
--
hypothesis             str    its name
statement              str    what it says
searched               int    searched numbers
evaluations
objective_nat          float? least objective of its search; null where no candidate can be driven
fresh_nat              float? objective of that candidate on draws that no search has used, all orders included; null
    where it cannot be driven
gain_nat               float? how much less that is than for the first hypothesis: log of a probability ratio
medians_met            int    of 17 medians over these draws: within 15 % of the printed number
inside                 int    of 17 printed numbers: within the middle 90 % of these draws, a limit not below them
orders_met             int    of 10 orders: hold in more than half of these draws

## twin_tradeoff | tables/twin_tradeoff.parquet | item weight other
The search again, with one missed printed number weighing more: what it costs the others; `snakemake --cores 2
twin_tradeoff`.
--
item                   str    printed number that the twin misses
weight                 float  factor of its contribution to the objective of this search
other                  str    any printed number or order
ratio                  float  its median over draws that no search has used, as a share of the printed number; of an
    order its margin
contribution_nat       float  its contribution to the objective on these draws, without the factor
partner                bool   the other printed number that suffers most from the greatest weight

## redraws | tables/redraws.parquet | draw item
The paper's numbers and orders on the same robot for other draws of non-repeatability and noise than in the twin's
search.
--
draw                   int    number of the draw
item kind
value                  float  number in mm, or margin of the order, positive where it holds
met                    bool   number within 15 % of the printed one (an upper limit: at most 15 % above), order holds

## redraw_errors | tables/redraw_errors.parquet | run point calibration
Middle 90 % of the errors at every point over the draws of `redraws`: the bands of figures 9 to 12.
--
run                    int    number of the run, from 1 on
trajectory             str    name of the trajectory
point                  int    number of the point in the run, from 1 on
calibration            str    before calibration, after the line calibration or after the spiral's {none, line, spiral}
error_{xyz}_mm_low     float? lower end of the error along an axis
error_mm_low           float? lower end of its size
error_{xyz}_mm_high    float? upper end of the error along an axis
error_mm_high          float? upper end of its size

## draw_ranks | tables/draw_ranks.parquet | draw
Draws of the reproduced robot by how near they are to the printed numbers and orders; `snakemake --cores 1 draw_ranks`.
--
draw                   int    number of the draw, as in `redraws`
misfit                 float  sum of log(1 + (deviation / 15 %)^2) over the numbers, and log 2 for every order that does
    not hold
rank                   int    1 for the nearest
numbers_met            int    printed numbers within 15 %
orders_met             int    printed orders that hold

## redraw_counts | tables/redraw_counts.parquet | item
How often each item of `redraws` is met over the draws, and how many are met in one draw.
--
item                   str    as in `redraws`; numbers, orders, all: how many of them are met in one draw
kind                   str    printed number, printed order, or a count over one draw {number, order, count}
targets                int    1; of a count: how many there are
draws                  int    draws
met                    int    draws in which it is met; of a count: in which all are
median                 float  median over the draws; for an order its margin, for a count the targets met
low                    float  lower end of the middle 90 %
high                   float  upper end
""")
