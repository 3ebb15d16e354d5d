"""Contents of the page, section by section: figures and tables by name. Results that do not exist are left out."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Shown:
    """A table: its name, its title, the columns shown, as far as they are there (all where empty),
    and the rows (a query; all where empty).
    """

    name: str
    title: str
    columns: str = ""
    rows: str = ""


@dataclass(frozen=True)
class Section:
    """A section: its key, title and introduction, names of figures with their titles, and tables.

    own: figures of every campaign, in a folder of its name, with their titles, and the table that has to have rows of
    the campaign, empty where none has to; those of the reproduced one are next to the study's.
    """

    key: str
    title: str
    about: str
    figures: tuple[tuple[str, str], ...] = ()
    own: tuple[tuple[str, str, str], ...] = ()
    tables: tuple[Shown, ...] = ()


_LEAST_SQUARES = "method in ('least_squares', 'none')"

SECTIONS = (
    Section(
        "diagnosis",
        "Behind the answers",
        "How each answer was found. The gap is the residual error of the calibrated simulator, with the measuring "
        "noise subtracted. Posterior probabilities are calibrated: of answers with 0.9, nine in ten should be right.",
        own=(
            ("gap", "The whole diagnosis", ""),
            ("drive_functions", "Errors of the drives over their values", "gap_drive_functions"),
        ),
        tables=(
            Shown("gap_left_out", "Points that were left out, by reason"),
            Shown("gap_budget", "What the gap is made of"),
            Shown("gap_attribute", "How probable each cause is"),
            Shown("gap_shrink", "How far the gap shrinks", rows="trajectory == '*'"),
            Shown(
                "gap_parameters",
                "Parameters for the simulator, calibration and effects fitted together",
                "campaign effect parameter unit value low_95 high_95 at_bound",
            ),
            Shown(
                "gap_drive_functions",
                "Where each drive error is largest",
                "campaign effect name unit drive_value error low_95 high_95",
                "worst",
            ),
            Shown("gap_locate", "Variance of the gap by factor"),
            Shown("gap_identifiability", "Detectable effects in these data"),
            Shown("gap_next_runs", "Most informative next runs"),
            Shown("gap_next_poses", "Most informative next poses"),
        ),
    ),
    Section(
        "calibration",
        "Calibration: which parameters may be trusted",
        "Each parameter with its 95 % interval: it holds the truth in 95 of 100 cases, if the model is complete. "
        "Where the diagnosis has found effects, parameters that they change by more than their error are biased.",
        own=(
            ("observability", "What the measured points see", ""),
            ("workspace", "Where the points lie", ""),
            ("convergence", "How the genetic algorithm converges", "genetic"),
        ),
        tables=(
            Shown(
                "calibrations",
                "Every calibration",
                "campaign calibration method points mean_mm rms_mm max_mm noise_mm noise_from rank condition "
                "parameters_at_bound",
            ),
            Shown("genetic_against_least_squares", "The genetic algorithm compared with least squares"),
            Shown("gauge", "Parameters that are not separately identifiable at these poses"),
            Shown("registration", "The instrument's frame in the robot's, as registered"),
            Shown("campaigns", "Campaigns: where they came from, and what was noted"),
        ),
    ),
    Section(
        "cross",
        "Every calibration on every trajectory",
        "A calibration that helps only where it learned is of little use: rows say where it learned, columns where it "
        "was applied.",
        own=(("cross", "Calibrated here, applied there", ""),),
        tables=(
            Shown(
                "error_summary",
                "Errors before and after",
                "campaign calibration mode trajectory points mean_mm rms_mm max_mm path_accuracy_mm repeatability_mm",
                _LEAST_SQUARES,
            ),
        ),
    ),
    Section(
        "reproduction",
        "What the reproduction shows",
        "The published study of the 3-RRRU robot compared with this one, on a virtual robot.",
        figures=(
            ("fig09", "Group 1 before and after (Fig. 9)"),
            ("fig10", "Lines after calibration (Fig. 10)"),
            ("fig11", "Spiral (Fig. 11)"),
            ("fig12", "Lines under the spiral's calibration (Fig. 12)"),
            ("fig06", "Crossover fraction (Fig. 6)"),
            ("fig07", "Migration fraction (Fig. 7)"),
        ),
        tables=(
            Shown("published", "Published numbers compared with these"),
            Shown("redraw_counts", "How often they are met over other draws of chance"),
            Shown("twin_numbers", "Numbers that were searched for the virtual robot"),
            Shown("sweep_effect", "Do the algorithm's settings matter?"),
            Shown("sweep_match", "Which reading of the algorithm comes nearest?"),
        ),
    ),
    Section(
        "audit",
        "Audit of the papers",
        "What the papers print that contradicts itself or the mechanism, each shown by a computation.",
        tables=(Shown("audit", "Misprints, contradictions and claims"),),
    ),
    Section(
        "ptt",
        "Sister study: 3-PTT, Jacobian and RBF network",
        "Five experiments with backlash and load; the benefit counts on points that the network has not seen.",
        figures=(
            ("ptt_benefit", "Benefit per axis and experiment"),
            ("ptt_extrapolation", "Benefit off the curve"),
            ("ptt_errors", "Errors along the curve"),
            ("ptt_path", "The curve"),
            ("ptt_network", "What the network learns"),
            ("ptt_training", "Training"),
            ("ptt_corrections", "Corrections of the sliders"),
            ("ptt_backlash", "Backlash of the screws"),
            ("ptt_singularity", "Singularities"),
        ),
        tables=(
            Shown("ptt_benefit", "Benefit", rows="set == 'test'"),
            Shown("ptt_backlash", "Backlash"),
            Shown("ptt_repeatability", "Non-repeatability of the sliders"),
        ),
    ),
    Section(
        "delta",
        "Sister study: Delta, zero offsets from images",
        "Three zero offsets found by a camera on the platform that sees dots on a plane.",
        figures=(
            ("delta_errors", "Errors on the plane before and after"),
            ("delta_observability", "Observability from images"),
            ("delta_images", "What the camera sees"),
        ),
        tables=(
            Shown(
                "delta_calibrations",
                "Calibrations",
                "variant source measure planes poses equations rank condition residual_rms_mm plane_mean_mm "
                "plane_max_mm base_mean_mm base_max_mm",
            ),
            Shown("delta_draws", "Over other draws of chance"),
            Shown("delta_robots", "Over other robots"),
            Shown("delta_camera", "The camera"),
        ),
    ),
    Section(
        "printers",
        "Real printers",
        "Linear deltas from measurements of their owners, compared with the answer saved with them.",
        figures=(("printers", "Every printer"),),
        tables=(
            Shown(
                "printers",
                "Printers",
                "printer source verdict reason cause suspect heights distances height_rms_fitted_mm "
                "distance_rms_fitted_mm arm_standard_error_mm notes",
            ),
            Shown("printer_causes", "Causes tried"),
            Shown("printer_readings", "Readings"),
        ),
    ),
    Section(
        "methods",
        "Which method for which robot",
        "Every method learned from the same points; errors count on other points, inside and outside.",
        figures=(("methods", "Every method on every robot"),),
        tables=(Shown("methods", "Methods"),),
    ),
    Section(
        "withheld",
        "How far the diagnosis may be trusted",
        "Virtual robots whose causes were withheld from the diagnosis and counted afterwards.",
        figures=(
            ("withheld", "Answers and the truth"),
            ("withheld_causes", "How often stated probabilities hold"),
            ("withheld_plants", "MuJoCo's robots and our own"),
        ),
        tables=(
            Shown("withheld_summary", "Counts"),
            Shown("withheld_advice_summary", "Does the advised run settle it?"),
        ),
    ),
    Section(
        "real",
        "Measured series of real robots",
        "Robots that others measured; rows that were left out show how well the model predicts.",
        own=(("steps", "Step by step", ""), ("spectrum", "Waves of every joint", ""), ("lengths", "Lengths", "")),
        tables=(
            Shown("real_verdicts", "Answers"),
            Shown("real_budget", "What the gap is made of"),
            Shown("real_steps", "Step by step"),
        ),
    ),
)
# figures of a campaign that its own page shows, and sections that it has
OF_A_CAMPAIGN = ("diagnosis", "calibration", "cross")
