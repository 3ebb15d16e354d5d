"""Tables of the gap diagnosis: where what the calibrated sim gets wrong lies, which effect causes it, how far it
shrinks.
"""

from rrru.store.schema import CAMPAIGN, NUMBER, Column, Table, xyz

_EFFECTS = Column(
    "effects",
    "str",
    "names joined by + in the order of their share; none; unexplained where the library does not hold it",
)
_POINTS = Column("points", "int64", "points counted")
_CLOSED = tuple(
    (f"share_closed{end}", f"{text}, 0 to 1; below 0 where the correction makes it worse")
    for end, text in (
        ("", "share of the gap that the effects close"),
        ("_low", "lower end, 95 %"),
        ("_high", "upper end, 95 %"),
    )
)

TABLES = (
    Table(
        "gap_verdicts",
        "tables/gap_verdicts.parquet",
        "One row per campaign: which effects cause its gap, where it is worst, how far it shrinks and what to run next. "
        "Rms values are of 3-D distances.",
        (
            CAMPAIGN,
            _EFFECTS,
            Column("probability", NUMBER, "of this whole verdict, 0 to 1"),
            Column("leg", "int64", "the one leg at fault, 1 to 3; 0 for all or none"),
            Column(
                "confusable_with",
                "str",
                "effects that this campaign cannot tell from the verdict, joined by a comma; empty where none",
            ),
            Column("noise_rms_mm", NUMBER, "measuring noise, 3-D"),
            Column("gap_rms_mm", NUMBER, "what the calibrated sim gets wrong, noise taken out"),
            Column(
                "gap_after_rms_mm",
                NUMBER,
                "the same, expected of the corrected sim on held-out runs",
            ),
            *(Column(name, NUMBER, f"{text}, on held-out runs") for name, text in _CLOSED),
            *(Column(f"worst_{axis}_mm", NUMBER, f"where the gap is largest, {axis}, robot frame") for axis in "xyz"),
            Column(
                "next_runs",
                "str",
                "runs that would tell the causes apart best; empty where none is needed, helps or can be computed",
            ),
            Column(
                "noise_from",
                "str",
                "given: by the configuration; repeats: pooled over repeated points; high_frequency: from the residuals along the path",
                allowed=("given", "repeats", "high_frequency"),
            ),
            Column("points", "int64", "points diagnosed"),
            Column("dropped_points", "int64", "outliers that the diagnosis left out"),
            Column("notes", "str", "what the data lack for a better answer; empty where nothing"),
        ),
        ("campaign",),
    ),
    Table(
        "gap_locate",
        "tables/gap_locate.parquet",
        "Where the gap lies: its variance split over the levels of each factor.",
        (
            CAMPAIGN,
            Column(
                "factor",
                "str",
                "what the points are split by",
                allowed=("trajectory", "region", "direction", "leg", "motion_direction", "speed", "payload", "time"),
            ),
            Column("level", "str", "value of the factor"),
            _POINTS,
            Column("rms_mm", NUMBER, "residual at this level"),
            Column("share", NUMBER, "share of the gap's variance, 0 to 1"),
            Column("share_low", NUMBER, "lower end, 95 %"),
            Column("share_high", NUMBER, "upper end, 95 %"),
            Column("share_of_noise", NUMBER, "share that noise alone would give this level"),
            Column("noise_could", "bool", "true where noise alone could give this share"),
            Column(
                "drive_rms_rad",
                NUMBER,
                "the residual as equivalent error of the drive angle; null for every factor but leg",
                True,
            ),
            Column("drive_rms_mm", NUMBER, "the same of a slider's position, for robots with sliders", True),
            *(
                Column(f"{axis}_mm", NUMBER, f"centre of the region, {axis}, robot frame; null for other factors", True)
                for axis in "xyz"
            ),
        ),
        ("campaign", "factor", "level"),
    ),
    Table(
        "gap_identifiability",
        "tables/gap_identifiability.parquet",
        "What this campaign could tell about each effect, whatever was measured.",
        (
            CAMPAIGN,
            Column("effect", "str", "name"),
            Column("testable", "bool", "false where the campaign lacks what the effect needs"),
            Column(
                "visible_share", NUMBER, "share of the effect's displacement that the calibration cannot absorb", True
            ),
            Column(
                "detectable_mm",
                NUMBER,
                "gap rms, 3-D, above which this effect alone is found 9 times of 10 at 1 % false alarms",
                True,
            ),
            Column("imitated_by", "str", "the other effect that imitates it best; empty where none"),
            Column(
                "imitated_share", NUMBER, "largest share of its visible gap that one other effect can imitate", True
            ),
            Column("note", "str", "why it cannot be tested or told apart; empty where it can"),
        ),
        ("campaign", "effect"),
    ),
    Table(
        "gap_attribute",
        "tables/gap_attribute.parquet",
        "Probability of each effect as a cause of the gap, none and unexplained included.",
        (
            CAMPAIGN,
            Column("effect", "str", "name in the library or of the user's, none or unexplained"),
            Column("probability", NUMBER, "that it is at work, 0 to 1; several may be at once"),
            Column(
                "legs",
                "str",
                "on each leg its own value, one value on all (same), or the one leg; empty where legs make no difference",
            ),
            Column(
                "log_evidence", NUMBER, "of the best hypothesis with this effect over none, natural logarithm", True
            ),
            Column(
                "heldout_gain",
                NUMBER,
                "log predictive score gained on left-out runs by adding it to the calibration",
                True,
            ),
            Column("heldout_gain_se", NUMBER, "its standard error", True),
            Column("note", "str", "empty where there is nothing to say"),
        ),
        ("campaign", "effect"),
    ),
    Table(
        "gap_sets",
        "tables/gap_sets.parquet",
        "The sets of effects that carry the probability, best first.",
        (
            CAMPAIGN,
            Column("rank", "int64", "1: most probable"),
            Column("effects", "str", "names joined by +, or none"),
            Column("legs", "str", "legs of each effect in the same order, joined by +"),
            Column("unexplained", "bool", "true where something outside the library acts besides"),
            Column("probability", NUMBER, "0 to 1"),
            Column("log_evidence", NUMBER, "over none, natural logarithm"),
        ),
        ("campaign", "rank"),
    ),
    Table(
        "gap_shrink",
        "tables/gap_shrink.parquet",
        "How far the gap shrinks as the effects are added one after another.",
        (
            CAMPAIGN,
            Column("step", "int64", "0: calibration alone"),
            Column("added", "str", "effect added at this step; empty at 0"),
            Column("effects", "str", "all effects so far, joined by +, or none"),
            Column("trajectory", "str", "trajectory, * for all"),
            Column(
                "kind",
                "str",
                "held_out: on runs that were not fitted on; resimulated: fitted on all runs, through the full spatial closure",
                allowed=("held_out", "resimulated"),
            ),
            _POINTS,
            Column("rms_mm", NUMBER, "measured minus sim"),
            Column("max_mm", NUMBER, "largest distance"),
            Column("noise_rms_mm", NUMBER, "measuring noise, 3-D"),
            Column(
                "gap_rms_mm",
                NUMBER,
                "rms with the noise taken out, 0 at least; at the last held-out step the error to expect from the fitted numbers' uncertainty, "
                "mixed with that by the probability that something is unexplained",
            ),
            *(
                Column(name, NUMBER, f"{text}; null at step 0 and where there is no gap", True)
                for name, text in _CLOSED
            ),
        ),
        ("campaign", "step", "trajectory", "kind"),
    ),
    Table(
        "gap_parameters",
        "tables/gap_parameters.parquet",
        "The corrected simulator: parameters of the effects in the verdict, and the errors (effect: calibration) fitted with them.",
        (
            CAMPAIGN,
            Column("effect", "str", "name"),
            Column("parameter", "str", "name of the parameter"),
            Column("unit", "str", "unit of the value"),
            Column("value", NUMBER, "fitted value"),
            Column(
                "standard_error",
                NUMBER,
                "1 sigma, correlated among them; null for shapes, calibration and what was not fitted",
                True,
            ),
            Column("at_bound", "bool", "true where the fit ended at a bound"),
        ),
        ("campaign", "effect", "parameter"),
    ),
    Table(
        "gap_next_runs",
        "tables/gap_next_runs.parquet",
        "Runs that would separate effects which this campaign cannot tell apart, best first.",
        (
            CAMPAIGN,
            Column("rank", "int64", "1: tells most"),
            Column("run", "str", "the run in words"),
            Column("trajectory", "str", "trajectory to drive"),
            Column("reverse", "bool", "true where it is driven backwards"),
            Column("speed_mm_s", NUMBER, "speed; null where any will do", True),
            Column("payload_kg", NUMBER, "payload; null where any will do", True),
            Column("points", "int64", "points of the run"),
            Column("separates", "str", "the effects, joined by ' / '"),
            Column("now_nats", NUMBER, "expected log evidence between them in the present campaign"),
            Column("gain_nats", NUMBER, "expected log evidence that the run adds"),
        ),
        ("campaign", "rank"),
    ),
    Table(
        "gap_points",
        "campaigns/{campaign}/gap_points.parquet",
        "The gap at every commanded point, before and after the effects are added to the sim.",
        (
            Column("run", "int64", "as in measurements"),
            Column("trajectory", "str", "as in measurements"),
            Column("point", "int64", "as in measurements"),
            *xyz("command", "mm", "commanded position, robot frame"),
            *xyz("before", "mm", "measured minus calibrated sim; null where nothing was measured", True),
            *xyz(
                "after", "mm", "measured minus corrected sim, on held-out runs; null where it was not predicted", True
            ),
            *(
                Column(
                    f"drive_error{k}_rad",
                    NUMBER,
                    f"before, as equivalent error of drive angle {k}; null near singularities",
                    True,
                )
                for k in (1, 2, 3)
            ),
            *(
                Column(f"drive_error{k}_mm", NUMBER, f"the same of slider {k}, for robots with sliders", True)
                for k in (1, 2, 3)
            ),
            Column("used", "bool", "false where the diagnosis left the point out"),
        ),
        ("run", "point"),
    ),
)
