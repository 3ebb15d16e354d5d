"""The calibration of printers as frames: one row per printer, number, reading and possible cause."""

from dataclasses import asdict

import numpy as np
import pandas as pd
from scipy.sparse import csgraph

from rrru.errors import FitError
from rrru.studies.printers.cause_tests import CauseTests
from rrru.studies.printers.firmware import NAMES, UNITS
from rrru.studies.printers.judge import FAILED, judge
from rrru.studies.printers.printer import Refused
from rrru.studies.printers.printer_causes import Level
from rrru.studies.printers.printer_fit import common_arm_error, dense_arm_error

# below these degrees of freedom the standard errors are themselves uncertain
_LITTLE_FREEDOM = 3
_NOT_FITTED = {"numbers": 0, "freedom": 0, "rank": 0, "largest_difference_in": "", "verdict": FAILED}
_NOT_FITTED |= {"suspect": "", "cause": "not decidable", "effector_tilt": "", "notes": ""}


def tables(printers, settings):
    """Frames by table name: printers, printer_parameters, printer_readings, printer_causes.

    settings: `stopping_step`, `level` and `confounded_from` of the configuration's `printers` section. A printer that
    cannot be read or fitted has only a row in `printers`, with the reason. Printers that share readings are one piece
    of evidence. For causes of the machines the level is divided by the number of pieces that can show any cause.
    """
    rows = {name: [] for name in ("printers", "printer_parameters", "printer_readings", "printer_causes")}
    sound = [printer for printer in printers if not isinstance(printer, Refused)]
    twins, groups = _shared_readings(sound), _groups(sound)
    level = level_of(sound, settings, groups)
    for printer in printers:
        labels = {"printer": printer.name, "source": printer.source, "evidence": groups.get(printer.name, printer.name)}
        if isinstance(printer, Refused):
            failed = {"heights": 0, "distances": 0, "reason": printer.reason}
            rows["printers"].append(labels | _NOT_FITTED | failed)
            continue
        labels |= {"heights": len(printer.height_mm), "distances": len(printer.distance_mm)}
        try:
            judged = judge(printer, settings["stopping_step"], level)
        except FitError as error:
            rows["printers"].append(labels | _NOT_FITTED | {"reason": str(error)})
            continue
        rows["printers"].append(labels | _printer_row(judged, twins[printer.name]))
        rows["printer_parameters"].append(_parameter_rows(judged))
        rows["printer_readings"].append(_reading_rows(judged))
        rows["printer_causes"].append(_cause_rows(judged))
    frames = {name: pd.concat(parts, ignore_index=True) for name, parts in rows.items() if name != "printers" and parts}
    return {name: pd.DataFrame() for name in rows} | frames | {"printers": pd.DataFrame(rows["printers"])}


def level_of(printers, settings, groups=None):
    """The Level for printers that are tested together."""
    groups = _groups(printers) if groups is None else groups
    pieces = max(len({groups[printer.name] for printer in printers if _decides(printer)}), 1)
    return Level(settings["level"], settings["confounded_from"], pieces)


def _printer_row(judged, twins):
    """Row of `printers` without its labels."""
    result, suspect, tilt = judged.result, judged.suspect, judged.tilt
    difference = np.abs(result.saved - result.fitted)
    worst, common, dense = int(difference.argmax()), common_arm_error(result), dense_arm_error(result)
    return {
        "numbers": len(result.names),
        "freedom": result.freedom,
        "rank": result.fit.identifiability.rank,
        "condition": result.fit.identifiability.condition,
        "radius_fitted_mm": result.fitted[0],
        "radius_saved_mm": result.saved[0],
        "largest_difference": difference[worst],
        "largest_difference_in": result.names[worst],
        "largest_over_stop": (difference / result.tolerance).max(),
        **_rms(result),
        "noise_mm": result.fit.noise_mm,
        "arm_standard_error_mm": max(result.standard_errors[6:], default=np.nan),
        "common_arm_standard_error_mm": common,
        "dense_common_arm_standard_error_mm": dense,
        "verdict": judged.verdict,
        "reason": judged.reason,
        "suspect": "" if suspect is None else result.reading_name(suspect),
        "suspect_p": np.nan if judged.left.suspect is None else judged.left.p[judged.left.suspect],
        "cause": judged.cause,
        "effector_tilt": "" if tilt is None else tilt.text,
        "effector_tilt_p": np.nan if tilt is None else tilt.p,
        "effector_tilt_power": np.nan if tilt is None else tilt.power,
        "notes": "; ".join([*_notes(result, judged.causes, common, dense), *twins]),
    }


def _residuals(result):
    """Residuals (n,) in mm of the fitted and of the saved printer, by name."""
    residuals = result.residuals
    answers = {"fitted": result.fit.deviations, "saved": residuals.mechanism.parameters.nominal}
    return {name: residuals.measured_mm - residuals.predicted_mm(answer) for name, answer in answers.items()}


def _rms(result):
    """Rms residuals in mm of heights and distances for the fitted and the saved numbers; absent ones are left out."""
    values = {}
    for answer, residual in _residuals(result).items():
        for kind, part in zip(("height", "distance"), np.split(residual, [len(result.printer.height_mm)]), strict=True):
            values |= {f"{kind}_rms_{answer}_mm": np.sqrt((part**2).mean())} if part.size else {}
    return values


def _notes(result, answers, common, dense):
    """Notes on the row."""
    if result.freedom < _LITTLE_FREEDOM:
        widths = (result.half_widths / result.standard_errors)[0]
        wide = f"95 % intervals are +- {widths:.1f} standard errors"
        yield f"only {result.freedom} degrees of freedom: {wide}"
    if result.printer.parameter_set == "heights":
        alone = f"a standard error of {common:.1f} mm, 100 of them {dense:.2f} mm"
        yield f"arms as saved, not fitted: heights alone would give their common length with {alone}"
    else:
        yield f"arms known to {result.half_widths[6:].max():.1f} mm (95 %)"
    if any(one.cause == "caliper_scale" and "caliper_offset" in one.confounded_with for one in answers):
        low, high = result.printer.distance_mm.min(), result.printer.distance_mm.max()
        span = f"all distances are {low:.1f} to {high:.1f} mm"
        yield f"a scale error of the calipers is confounded with an offset: {span}"


def _shared_readings(printers):
    """Notes by printer on readings shared with an earlier printer of the file."""
    seen, notes = {}, {}
    for printer in printers:
        sizes = {"heights": printer.height_drop_mm, "distances": printer.distance_drop_mm}
        first = {kind: seen.setdefault((kind, size.tobytes()), printer.name) for kind, size in sizes.items()}
        notes[printer.name] = [
            f"the same {kind} as {first[kind]}" for kind in sizes if sizes[kind].size and first[kind] != printer.name
        ]
    return notes


def _groups(printers):
    """Name by printer of the first one in its group of shared readings, directly or through others."""
    readings = ("height_drop_mm", "distance_drop_mm", "distance_mm")
    sizes = [
        {getattr(printer, name).tobytes() for name in readings if getattr(printer, name).size} for printer in printers
    ]
    shared = np.array([[not first.isdisjoint(second) for second in sizes] for first in sizes])
    _, piece = csgraph.connected_components(shared, directed=False)
    _, first = np.unique(piece, return_index=True)
    return {printer.name: printers[first[group]].name for printer, group in zip(printers, piece, strict=True)}


def _decides(printer):
    """Whether a printer's readings have enough degrees of freedom for a test."""
    return len(printer.height_mm) + len(printer.distance_mm) - len(printer.mechanism().parameters) > 1


def _parameter_rows(judged):
    """Rows of `printer_parameters`, all nine parameters; those not calibrated are NaN except their saved values."""
    result, others = judged.result, judged.without_suspect
    saved = np.concatenate([result.saved, result.printer.arm_mm])[: len(NAMES)]
    calibrated = {
        "fitted": result.fitted,
        "difference": result.saved - result.fitted,
        "stop": result.tolerance,
        "standard_error": result.standard_errors,
        "half_width_95": result.half_widths,
        "agrees": result.agrees,
        "without_suspect": np.nan if others is None else others.fitted,
    }
    rows = pd.DataFrame({"parameter": NAMES, "unit": UNITS, "saved": saved}).join(pd.DataFrame(calibrated))
    agrees = rows["agrees"].ne(False)
    return rows.assign(printer=result.printer.name, calibrated=rows["fitted"].notna(), agrees=agrees)


def _reading_rows(judged):
    """Rows of `printer_readings`."""
    result, left = judged.result, judged.left
    residuals, count = _residuals(result), len(result.residuals)
    names = [result.reading_name(reading).split() for reading in range(count)]
    return pd.DataFrame(
        {
            "printer": result.printer.name,
            "kind": [kind for kind, _ in names],
            "number": [int(number) for _, number in names],
            "value_mm": result.residuals.measured_mm,
            "residual_fitted_mm": residuals["fitted"],
            "residual_saved_mm": residuals["saved"],
            "left_out_mm": left.difference_mm,
            "studentised": left.ratio,
            "p": left.p,
            "flagged": judged.flagged & (np.arange(count) == left.suspect),
        }
    )


def _cause_rows(judged):
    """Rows of `printer_causes`."""
    result, confounded_from = judged.result, judged.level.confounded_from
    tests, rows = CauseTests(result), []
    for one in judged.causes:
        undetectable = not _decides(result.printer) or tests.always_confounded(one.cause, confounded_from)
        detectable = np.nan if undetectable else tests.detectable_mm(one.cause, one.limit)
        rows.append(asdict(one) | {"detectable_mm": detectable, "confounded_with": ", ".join(one.confounded_with)})
    return pd.DataFrame(rows).assign(printer=result.printer.name)
