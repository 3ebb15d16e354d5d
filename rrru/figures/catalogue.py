"""Every figure of the study: one function each, tables in, a figure out.

FIGURES maps a figure's name to its function, the names of the tables that it reads and its caption. A function takes
the tables by name and the options, a mapping:

campaign, calibration_lines, calibration_spiral: whose errors are drawn, and under which two calibrations. method, mode:
rows of the tables errors and error_summary; where a campaign was never driven again, mode "model" stands in.
sweep_campaign, sweep_calibration: whose optimum the sweeps are compared with.

The tables `paths` (its measurements), `workspace` and `gap_points` are the campaign's own parts.
A function raises ConfigError naming what is not there.
"""

from rrru.figures import convergence, cross, gap, observability, workspace
from rrru.studies.delta import figures as delta
from rrru.studies.methods import figures as methods
from rrru.studies.printers import figures as printers
from rrru.studies.ptt3.figures import ptt
from rrru.studies.rrru3.figures import lines, spiral, sweep
from rrru.studies.withheld import figures as withheld

_SWEEP_TABLES = ("sweep_runs", "sweep_effect", "sweep_pairs", "calibrations", "published")
_SWEEP_CAPTION = (
    "(a) The published curve with half a unit of its last printed digit. (b), (c) The same algorithm run with many seeds: what every run "
    "reached above the least mean distance, its median and quartiles, and the published curve above its own lowest value, on one axis "
    "that is linear below one printed digit. Open medians are worse than the best setting (Mann-Whitney, Holm, 5 %)."
)

_PASSES = "Where a trajectory was passed more than once, curves are means over the passes, bands their range."
_NEAR = "Grey: points near a constraint singularity."

FIGURES = {
    "fig06": (
        sweep.fig06,
        _SWEEP_TABLES,
        f"Objective against the crossover fraction (paper A, Fig. 6). {_SWEEP_CAPTION}",
    ),
    "fig07": (
        sweep.fig07,
        _SWEEP_TABLES,
        f"Objective against the migration fraction (paper A, Fig. 7). {_SWEEP_CAPTION}",
    ),
    "fig09": (
        lines.fig09,
        ("paths", "errors"),
        "Group 1 before and after the line calibration (paper A, Fig. 9). (a) Commanded and attained points in the vertical plane, "
        "deviations magnified as stated. (b) Size of the error at every point. "
        f"{_NEAR} {_PASSES}",
    ),
    "fig10": (
        lines.fig10,
        ("paths", "errors"),
        "Every line before and after the line calibration (paper A, Fig. 10). (a) The lines in the middle, (b) the outer ones. "
        f"The numbers are the smallest and largest error. {_NEAR} {_PASSES}",
    ),
    "fig11": (
        spiral.fig11,
        ("paths", "errors"),
        "The spiral under both calibrations (paper A, Fig. 11). (a) Commanded and attained path, deviations magnified as stated. "
        f"(b) to (d) Errors along the axes, with the tolerance of the task. {_NEAR} {_PASSES}",
    ),
    "fig12": (
        lines.fig12,
        ("paths", "errors"),
        "The lines but the first under the line and the spiral calibration (paper A, Fig. 12). "
        f"The numbers are the smallest and largest error. {_NEAR} {_PASSES}",
    ),
    "workspace": (
        workspace.workspace,
        ("workspace", "singularity", "paths"),
        "Distance from both kinds of singularity over the reachable workspace, and the commanded paths projected on it. "
        "Hatched is out of reach; on the line the constraint determinant changes its sign.",
    ),
    "observability": (
        observability.observability,
        ("observability",),
        "What every set of trajectories can see: directions of parameter space from the best seen to the worst, what each is made of "
        "(weights below 0.15 are not written), the standard error along it and its singular value.",
    ),
    "convergence": (
        convergence.convergence,
        ("genetic_history", "genetic"),
        "Convergence of the genetic algorithm: excess of the best mean distance so far over the least one, for every seed, "
        "their median and quartiles; a run that has stopped keeps what it reached.",
    ),
    "cross": (
        cross.cross,
        ("error_summary",),
        "Every calibration applied to every trajectory: (a) mean and (b) largest position error. The first row is before any calibration.",
    ),
    "gap": (
        gap.gap,
        ("gap_verdicts", "gap_attribute", "gap_shrink", "gap_points"),
        "The gap between the calibrated sim and the measurement. (a) Where: measured minus calibrated sim at the points from above and from "
        "the side, magnified as stated. (b) Why: probability of every effect, those of the verdict in colour. (c) How far it shrinks: gap on "
        "runs that were not fitted on, under the calibrated and the corrected sim, with the share closed. (d) Residual of every point.",
    ),
    "withheld": (
        withheld.withheld,
        ("withheld_scores", "withheld_confusion"),
        "The diagnosis where the answer was withheld. Confusion tables: counts, shaded by their share of the row, right answers framed; of the "
        "effect check, the row is the effect that was taken out of the library. Unexplained counts alone or beside a name. Then the share of "
        "right verdicts against the stated probability and against the gap over the noise, beside a test that knows the true law (1 % "
        "false alarms), with 95 % intervals, and the share of the gap closed as predicted and in truth.",
    ),
    "methods": (
        methods.methods,
        ("methods", "method_points"),
        "Every method on every robot where it makes sense, judged on true errors of the driven robot. (a) to (c) Mean error after it, with a "
        "bar to the largest, at targets inside the region that it learned on and around it. (d) to (f) What fewer points cost.",
    ),
    "printers": (
        printers.printers,
        ("printers",),
        "Linear-delta printers calibrated from what their owners measured. (a) Largest difference between the numbers that their firmware saved "
        "and ours; diamonds: readings and saved answer do not belong together. (b) Rms residuals of probed heights and caliper distances "
        "under our answer and the saved one. (c) Standard error of an arm's length with distances, and of the arms' common length if heights "
        "alone had to give it.",
    ),
    "delta_images": (
        delta.delta_images,
        ("delta_picture", "delta_dots", "delta_poses", "delta_centres"),
        "What the Delta's camera sees (paper C, Figs. 3 and 6). (a) The image of the first pose with the centres of the dots found. (b) Dots "
        "that any image shows whole, those of (a) in colour, and the optical centres with their errors, magnified as stated.",
    ),
    "delta_errors": (
        delta.delta_errors,
        ("delta_points", "delta_calibrations", "delta_draws"),
        "Errors on the plane before and after the paper's calibration (paper C, Figs. 7 and 8): colour is the size of the error in the "
        "calibration frame, arrows its part in the plane, magnified as stated. Below, mean and largest error under every variant, and the "
        "range of the mean when plate, views and noise are drawn anew, (c) in the calibration frame, (d) in the frame of the robot's base.",
    ),
    "delta_observability": (
        delta.delta_observability,
        ("delta_observability",),
        "What every variant sees of the three zero errors: all drives alike (common) and against each other (differential). (a) Singular value. "
        "(b) Standard error. (c) Error per unknown length error of 1 mm.",
    ),
    **ptt.FIGURES,
}
