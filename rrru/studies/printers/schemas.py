"""Tables of the linear-delta printers: calibrated here from their owners' readings, beside the answer that their
firmware saved.
"""

from rrru.store.schema import NUMBER, Column, Table

_PRINTER = Column("printer", "str", "its id in the file")
_UNIT = ("mm", "deg")
_DIAGNOSED = ("found", "not found", "not decidable", "not decidable (rests on one reading)")

TABLES = (
    Table(
        "printers",
        "tables/printers.parquet",
        "One row per printer: answer here, answer there (what its firmware saved), residuals, and whether readings and saved answer belong "
        "together. Rms values are over readings.",
        (
            _PRINTER,
            Column("source", "str", "where its readings are from; empty where the file does not say"),
            Column(
                "evidence",
                "str",
                "first printer that it shares readings with, itself where there is none before: one piece of evidence",
            ),
            Column("heights", "int64", "probed heights"),
            Column("distances", "int64", "distances by calipers"),
            Column(
                "numbers", "int64", "calibrated numbers: 6 from heights, 9 with distances; 0 where it cannot be fitted"
            ),
            Column("freedom", "int64", "readings less numbers"),
            Column("rank", "int64", "combinations of numbers that the readings see"),
            Column("condition", NUMBER, "of the scaled Jacobian", True),
            Column(
                "radius_fitted_mm",
                NUMBER,
                "radius as calibrated here; the other numbers are in printer_parameters",
                True,
            ),
            Column("radius_saved_mm", NUMBER, "radius as saved", True),
            Column(
                "largest_difference",
                NUMBER,
                "largest difference between the saved and our numbers, in mm or degrees",
                True,
            ),
            Column("largest_difference_in", "str", "the number that it is in"),
            Column(
                "largest_over_stop",
                NUMBER,
                "largest difference over how far the other program can stop from the best number",
                True,
            ),
            Column("height_rms_fitted_mm", NUMBER, "residual of the heights under our answer", True),
            Column("height_rms_saved_mm", NUMBER, "residual of the heights under the saved answer", True),
            Column(
                "distance_rms_fitted_mm",
                NUMBER,
                "residual of the distances under our answer; null without distances",
                True,
            ),
            Column(
                "distance_rms_saved_mm",
                NUMBER,
                "residual of the distances under the saved answer; null without distances",
                True,
            ),
            Column(
                "noise_mm",
                NUMBER,
                "1 sigma, from the residuals: of a distance, of a height where there are no distances",
                True,
            ),
            Column(
                "arm_standard_error_mm",
                NUMBER,
                "largest standard error of an arm's length; null where arms are not calibrated",
                True,
            ),
            Column(
                "common_arm_standard_error_mm",
                NUMBER,
                "standard error of the arms' common length if heights alone had to give it: they hardly see the scale",
                True,
            ),
            Column(
                "dense_common_arm_standard_error_mm",
                NUMBER,
                "the same for 100 heights of the same noise, spread over the same disc",
                True,
            ),
            Column(
                "verdict",
                "str",
                "whether the saved answer is that of these readings; not fitted: the readings give no answer",
                allowed=("reproduced", "does not belong", "not fitted"),
            ),
            Column("reason", "str", "why it does not belong, as far as the readings tell; empty where it does"),
            Column("suspect", "str", "reading that fits worst; empty where nothing tells"),
            Column(
                "suspect_p",
                NUMBER,
                "probability of so bad a reading among all of them by noise alone, the largest over the noises' ratios",
                True,
            ),
            Column(
                "cause",
                "str",
                "cause of what the calibration leaves; none found; or not decidable, with those that it could be",
            ),
            Column("notes", "str", "what to know about this row"),
        ),
        ("printer",),
    ),
    Table(
        "printer_parameters",
        "tables/printer_parameters.parquet",
        "Every number of every printer: as calibrated here, as saved, and how well the readings see it.",
        (
            _PRINTER,
            Column("parameter", "str", "radius, angle and endstop of a tower, or arm; the angle of tower c is fixed"),
            Column("unit", "str", "of the numbers of this row", allowed=_UNIT),
            Column("fitted", NUMBER, "as calibrated here; null where the readings do not calibrate it", True),
            Column("saved", NUMBER, "as saved"),
            Column("difference", NUMBER, "saved less ours", True),
            Column("stop", NUMBER, "how far from the best number the other program can stop", True),
            Column("standard_error", NUMBER, "with the noise from the residuals", True),
            Column("half_width_95", NUMBER, "half the 95 % interval, Student's t with the printer's freedom", True),
            Column("calibrated", "bool", "false for the arms where only heights were measured"),
            Column(
                "agrees", "bool", "whether the saved number is that of the readings; true for what is not calibrated"
            ),
        ),
        ("printer", "parameter"),
    ),
    Table(
        "printer_readings",
        "tables/printer_readings.parquet",
        "Every reading of every printer, under both answers and against the fit of all others.",
        (
            _PRINTER,
            Column("kind", "str", "what was measured", allowed=("height", "distance")),
            Column("number", "int64", "number of the reading among its kind, from 1"),
            Column("value_mm", NUMBER, "the reading"),
            Column("residual_fitted_mm", NUMBER, "reading less our model's"),
            Column("residual_saved_mm", NUMBER, "reading less the saved model's"),
            Column("left_out_mm", NUMBER, "reading less what the fit of all others foretells"),
            Column(
                "studentised",
                NUMBER,
                "that over its standard error, under the firmware's ratio of noises; null where the others leave no freedom",
                True,
            ),
            Column(
                "p",
                NUMBER,
                "probability of so large a value anywhere among the readings by noise alone (Bonferroni), the largest over ratios of the "
                "noises of a height and a distance from 0.25 to 1",
                True,
            ),
            Column("flagged", "bool", "true for a bad reading"),
        ),
        ("printer", "kind", "number"),
    ),
    Table(
        "printer_causes",
        "tables/printer_causes.parquet",
        "Possible causes of what the calibration of a printer leaves, if its noise is normal and a height's 0.25 to 1 times a distance's. A bad "
        "reading that is found is left out before the others are tested.",
        (
            _PRINTER,
            Column(
                "cause",
                "str",
                "one bad reading; an error of the calipers; a measured object of another shape in x and y; arms of unknown length; steps of "
                "another length per tower; towers that lean, each by two angles",
            ),
            Column("freedom_used", "int64", "numbers that it adds, as far as the calibration does not absorb them"),
            Column(
                "explained_share",
                NUMBER,
                "share of the sum of squares left that it explains, under the firmware's ratio of noises; null where nothing tells",
                True,
            ),
            Column(
                "p",
                NUMBER,
                "probability that noise explains as much, the largest over the noises' ratios; null without freedom",
                True,
            ),
            Column("limit", NUMBER, "p has to be below it: the level over the causes and over the pieces of evidence"),
            Column("estimate", NUMBER, "its number; null for causes with several", True),
            Column("standard_error", NUMBER, "of the number", True),
            Column("unit", "str", "of the number; empty for causes with several"),
            Column(
                "detectable_mm",
                NUMBER,
                "rms over the readings, of what the calibration does not absorb of it, that has p below the limit 9 times of 10 (noise in the "
                "firmware's ratio); of a bad reading its own error. Passing is not yet found: see verdict. Null where another cause always "
                "imitates it, and where nothing is decidable",
                True,
            ),
            Column(
                "imitated_by", "str", "other causes that hold what it explains, joined by a comma; empty where none"
            ),
            Column(
                "verdict",
                "str",
                "whether it is at work: found where p is below the limit, also without any single reading, and nothing imitates it",
                allowed=_DIAGNOSED,
            ),
        ),
        ("printer", "cause"),
    ),
)
