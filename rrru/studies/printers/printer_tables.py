"""The calibration of printers as frames: one row per printer, number, reading and possible cause."""

import numpy as np
import pandas as pd
from scipy.sparse import csgraph

from rrru.errors import FitError
from rrru.studies.printers.printer_causes import FOUND, causes, diagnosis, left_out, limit_of
from rrru.studies.printers.printer_evidence import Evidence
from rrru.studies.printers.printer_fit import NAMES, UNITS, common_arm_error, dense_arm_error, fit_printer, reason

REPRODUCED, FOREIGN, FAILED = "reproduced", "does not belong", "not fitted"
# below this freedom the standard errors are themselves hardly known
_LITTLE_FREEDOM = 3
_NUMBERS = (
    *("condition", "radius_here_mm", "radius_there_mm", "largest_difference", "largest_over_stop", "noise_mm"),
    *("height_rms_here_mm", "height_rms_there_mm", "distance_rms_here_mm", "distance_rms_there_mm"),
    *("arm_standard_error_mm", "common_arm_standard_error_mm", "dense_common_arm_standard_error_mm", "suspect_p"),
)


def tables(printers, settings):
    """Frames by table name: printers, printer_parameters, printer_readings, printer_causes.

    settings: `stopping_step`, `level` and `imitated_from` of the configuration's `printers` section. A printer that
    cannot be fitted has a row in `printers` that says why, and none elsewhere. Printers that share readings are one
    piece of evidence; for causes of the machines the level is divided by the pieces in which something can be found.
    """
    rows = {name: [] for name in ("printers", "printer_parameters", "printer_readings", "printer_causes")}
    twins, groups = _shared_readings(printers), _groups(printers)
    level, pieces = settings["level"], max(len({groups[printer.name] for printer in printers if _decides(printer)}), 1)
    for printer in printers:
        try:
            result = fit_printer(printer, settings["stopping_step"])
            left = left_out(result)
        except FitError as error:
            rows["printers"].append(_failed_row(printer, str(error)) | {"evidence": groups[printer.name]})
            continue
        answers = causes(result, left, level, settings["imitated_from"], pieces)
        rows["printers"].append(
            _printer_row(result, left, answers, twins[printer.name]) | {"evidence": groups[printer.name]}
        )
        rows["printer_parameters"] += _parameter_rows(result)
        rows["printer_readings"] += _reading_rows(result, left, answers[0].verdict == FOUND)
        rows["printer_causes"] += _cause_rows(result, answers, level, pieces, settings["imitated_from"])
    return {name: pd.DataFrame(entries) for name, entries in rows.items()}


def _labels(printer):
    """What identifies a printer and its readings."""
    return {
        "printer": printer.name,
        "source": printer.source,
        "heights": len(printer.height_mm),
        "distances": len(printer.distance_mm),
    }


def _failed_row(printer, message):
    """Row of `printers` for one that cannot be fitted."""
    texts = {
        "largest_difference_in": "",
        "verdict": FAILED,
        "reason": message,
        "suspect": "",
        "cause": "not decidable",
        "notes": "",
    }
    counts = {"numbers": 0, "freedom": 0, "rank": 0}
    return _labels(printer) | counts | dict.fromkeys(_NUMBERS, np.nan) | texts


def _printer_row(result, left, answers, twins):
    """Row of `printers`."""
    difference = np.abs(result.there - result.here)
    worst = int(difference.argmax())
    common, dense = common_arm_error(result), dense_arm_error(result)
    suspect = left.suspect
    why = reason(result)
    return _labels(result.printer) | {
        "numbers": len(result.names),
        "freedom": result.freedom,
        "rank": result.fit.identifiability.rank,
        "condition": result.fit.identifiability.condition,
        "radius_here_mm": result.here[0],
        "radius_there_mm": result.there[0],
        "largest_difference": difference[worst],
        "largest_difference_in": result.names[worst],
        "largest_over_stop": (difference / result.tolerance).max(),
        **_rms(result),
        "noise_mm": result.fit.noise_mm,
        "arm_standard_error_mm": result.standard_errors[6:].max(initial=-np.inf) if len(result.names) > 6 else np.nan,
        "common_arm_standard_error_mm": common,
        "dense_common_arm_standard_error_mm": dense,
        "verdict": FOREIGN if why else REPRODUCED,
        "reason": why,
        "suspect": "" if suspect is None else result.reading_name(suspect),
        "suspect_p": np.nan if suspect is None else left.p[suspect],
        "cause": diagnosis(answers),
        "notes": "; ".join(_notes(result, answers, common, dense, twins)),
    }


def _residuals(result):
    """Readings less the fitted and less the saved printer's, in mm, each (n,)."""
    residuals, start = result.residuals, result.residuals.mechanism.parameters.nominal
    return [residuals.measured_mm - residuals.predicted_mm(deviations) for deviations in (result.fit.deviations, start)]


def _rms(result):
    """Rms residuals of heights and distances here and there in mm; NaN where there are no distances."""
    heights, values = len(result.printer.height_mm), {}
    for place, residual in zip(("here", "there"), _residuals(result), strict=True):
        values[f"height_rms_{place}_mm"] = np.sqrt((residual[:heights] ** 2).mean())
        values[f"distance_rms_{place}_mm"] = (
            np.sqrt((residual[heights:] ** 2).mean()) if residual[heights:].size else np.nan
        )
    return values


def _notes(result, answers, common, dense, twins):
    """What a reader of the row should know."""
    if result.freedom < _LITTLE_FREEDOM:
        widths = (result.half_widths / result.standard_errors)[0]
        yield f"readings exceed numbers by {result.freedom} only: 95 % intervals are {widths:.1f} standard errors wide to each side"
    if result.printer.parameter_set == "heights":
        yield f"arms as saved: heights alone would give their common length with a standard error of {common:.1f} mm, 100 of them {dense:.2f} mm"
    else:
        yield f"arms known to {result.half_widths[6:].max():.1f} mm (95 %)"
    scale = next((one for one in answers if one.name == "caliper_scale"), None)
    if scale and "caliper_offset" in scale.imitated_by:
        low, high = result.printer.distance_mm.min(), result.printer.distance_mm.max()
        yield f"a scale error of the calipers cannot be told from an offset: all distances are {low:.1f} to {high:.1f} mm"
    yield from twins


def _shared_readings(printers):
    """Notes by printer on readings that an earlier printer of the file has too."""
    seen, notes = {}, {}
    for printer in printers:
        notes[printer.name] = []
        for kind, size in (("heights", printer.height_drop_mm), ("distances", printer.distance_drop_mm)):
            first = seen.setdefault((kind, size.tobytes()), printer.name)
            if size.size and first != printer.name:
                notes[printer.name].append(f"the same {kind} as {first}")
    return notes


def _groups(printers):
    """Name by printer of the first one that it shares readings with, also by way of others."""
    sizes = [
        {size.tobytes() for size in (p.height_drop_mm, p.distance_drop_mm, p.distance_mm) if size.size}
        for p in printers
    ]
    shared = np.array([[not one.isdisjoint(other) for other in sizes] for one in sizes])
    _, piece = csgraph.connected_components(shared, directed=False)
    return {
        printer.name: printers[int(np.argmax(piece == own))].name for printer, own in zip(printers, piece, strict=True)
    }


def _decides(printer):
    """Whether a printer's readings leave the freedom to tell anything."""
    return len(printer.height_mm) + len(printer.distance_mm) - len(printer.mechanism().parameters) > 1


def _parameter_rows(result):
    """Rows of `printer_parameters`, all nine numbers; what was not calibrated has no value here."""
    missing = np.full(len(NAMES) - len(result.names), np.nan)
    columns = {
        "here": result.here,
        "difference": result.there - result.here,
        "stop": result.tolerance,
        "standard_error": result.standard_errors,
        "half_width_95": result.half_widths,
    }
    there = np.concatenate([result.there, result.printer.arm_mm[: len(missing)]])
    columns = {name: np.concatenate([values, missing]) for name, values in columns.items()}
    return [
        {
            "printer": result.printer.name,
            "parameter": name,
            "unit": unit,
            "there": there[k],
            **{column: values[k] for column, values in columns.items()},
            "calibrated": k < len(result.names),
            "agrees": k >= len(result.names) or bool(result.agrees[k]),
        }
        for k, (name, unit) in enumerate(zip(NAMES, UNITS, strict=True))
    ]


def _reading_rows(result, left, bad):
    """Rows of `printer_readings`; bad: whether the suspect is a bad reading."""
    here, there = _residuals(result)
    rows = []
    for reading, value in enumerate(result.residuals.measured_mm):
        kind, number = result.reading_name(reading).split()
        rows.append(
            {
                "printer": result.printer.name,
                "kind": kind,
                "number": int(number),
                "value_mm": value,
                "residual_here_mm": here[reading],
                "residual_there_mm": there[reading],
                "left_out_mm": left.difference_mm[reading],
                "studentised": left.ratio[reading],
                "p": left.p[reading],
                "flagged": bad and reading == left.suspect,
            }
        )
    return rows


def _cause_rows(result, answers, level, pieces, imitated_from):
    """Rows of `printer_causes`."""
    evidence = Evidence(result)
    limits = {one.name: limit_of(result, level, pieces, one.name) for one in answers}

    def hopeless(name):
        return not _decides(result.printer) or evidence.always_imitated(name, imitated_from)

    return [
        {
            "printer": result.printer.name,
            "cause": one.name,
            "freedom_used": one.freedom,
            "explained_share": one.share,
            "p": one.p,
            "estimate": one.estimate,
            "standard_error": one.standard_error,
            "unit": one.unit,
            "limit": limits[one.name],
            "detectable_mm": np.nan if hopeless(one.name) else evidence.detectable_mm(one.name, limits[one.name]),
            "imitated_by": ", ".join(one.imitated_by),
            "verdict": one.verdict,
        }
        for one in answers
    ]
