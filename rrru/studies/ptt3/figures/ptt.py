"""The figures of paper B's study: functions, tables and captions, see `rrru.figures.catalogue`."""

from rrru.studies.ptt3.figures import learning as ptt_learning
from rrru.studies.ptt3.figures import paths as ptt_paths
from rrru.studies.ptt3.figures import robot as ptt_robot

FIGURES = {
    "ptt_singularity": (
        ptt_robot.ptt_singularity,
        ("ptt_singularity", "ptt_points"),
        "Distance of the 3-PTT from both kinds of singularity (paper B, 2.2), at y = 0 and at half the curve's height. On the line kappa, a "
        "factor of det J, vanishes. Hatched is out of reach.",
    ),
    "ptt_backlash": (
        ptt_robot.ptt_backlash,
        ("ptt_encoder", "ptt_backlash", "ptt_repeatability"),
        "Backlash of the screws (paper B, Figs. 7 and 8, Tables 4 to 6). (a) Encoder's reading less command while a screw is turned forwards, "
        "back and forwards again, least load. (b) Backlash by eq. (19) with two standard errors. (c) Scatter of the sliders per unit travel, "
        "the curve passed in both directions in turn, beside what the tracker's noise alone gives.",
    ),
    "ptt_path": (
        ptt_paths.ptt_path,
        ("ptt_points",),
        "The curve of every experiment from above, and its height: commanded, measured (paper B, Figs. 10 and 12) and driven again with the "
        "network's correction (Fig. 18). Deviations are magnified as stated; heights count from the first point's.",
    ),
    "ptt_errors": (
        ptt_paths.ptt_errors,
        ("ptt_points",),
        "Errors along the axes before compensation and when driven again (paper B, Fig. 16); heights count from the first point's.",
    ),
    "ptt_network": (
        ptt_paths.ptt_network,
        ("ptt_points",),
        "What the chosen network leaves of the corrected positions taught: its answer less theirs (paper B, Fig. 14). Circles: test points.",
    ),
    "ptt_training": (
        ptt_learning.ptt_training,
        ("ptt_training", "ptt_spread"),
        "Error of the network as neurons are added (paper B, Fig. 13, where 20 steps are enough: grey line). (a) The spread with the least "
        "cross-validated error, on training points and on points held back; the mark is the chosen number of neurons. (b) The paper's spread, "
        "read as of inputs scaled to -1 .. 1 or as mm, for a network that learns the correction and one that learns the corrected position.",
    ),
    "ptt_corrections": (
        ptt_learning.ptt_corrections,
        ("ptt_corrections",),
        "What every slider is moved by (paper B, Fig. 15), and by how much the exact inverse (eq. 11) differs from the Jacobian (eq. 12).",
    ),
    "ptt_benefit": (
        ptt_learning.ptt_benefit,
        ("ptt_benefit", "ptt_start"),
        "(a) to (c) Benefit of every compensation on the test points, the robot driven again (paper B, eq. 21 and Fig. 17), and the paper's "
        "bounds. Lines: 5 % to 95 % over redraws of noise and split, of the methods that are redrawn. (d), (e) Benefit of the network through "
        "the Jacobian with the curve begun at other azimuths, one draw each: the paper's height hangs on its first point.",
    ),
    "ptt_extrapolation": (
        ptt_learning.ptt_extrapolation,
        ("ptt_extrapolation",),
        "Benefit of a correction where it was not learned: every experiment (dotted: the first) with the curve's radius, its height or the "
        "payload changed, and every experiment with the curve driven backwards. Below zero the correction harms.",
    ),
}
