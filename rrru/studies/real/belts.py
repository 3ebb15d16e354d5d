"""Belt machines whose sled is nowhere measured: only the lengths of the belts are, and what their count leaves out.

A set of `real: sets:`

    maslow:
      kind: belts
      files: "maslow/run_*.csv"    # one calibration per file
      lengths: {bl: bl_mm, br: br_mm, tr: tr_mm, tl: tl_mm}    # belt: column
      heights_mm: {bl: 34, br: 78, tr: 56, tl: 100}    # of a belt above the plane of the anchors; absent: 0
      unit: mm    # of the lengths: mm (default), m, inch
      row: row    # column that numbers the rows; absent: row, or from 1
      dimensions: 2    # of the sled's places: 2 (default), or 3 without heights

There are at least `dimensions + 1` belts. Their order fixes the frame, of which lengths alone know no place: the anchor
of the first is the origin, the second lies on the x axis, the third above it. Lengths do not tell a frame from its
mirror image either, nor one with all belts longer by a common factor: this is held at 1.
"""

import numpy as np
import pandas as pd
from scipy import linalg

from rrru.estimation.observations.length_starts import propose_anchors
from rrru.estimation.observations.lengths import Lengths
from rrru.studies.real import length_tables
from rrru.studies.real.length_laws import UNEXPLAINED, LengthCase, frame_columns, ways_of
from rrru.studies.real.lengths_section import MM, Section, held_out, numbers, row_numbers

MISSING, SCALE = "missing_length", "length_scale"
_NEEDED, _OPTIONAL = ("kind", "files", "lengths"), ("heights_mm", "unit", "row", "dimensions")
# ASSUME a count leaves out up to 8 % of the mean length either way, 1 sigma: all belts alike in most machines, since
# they are built alike; belts of a machine differ in scale by 4 mm per m, 1 sigma, as stretched toothed belts do
_MISSING_SHARE, _ALIKE, _SINGLE, _EACH = 0.08, 0.35, 0.1, 0.05
_SCALE_RANGE, _SCALED = 0.004, 0.5


def study(frame, section, name):
    """Tables of one calibration: real_verdicts, real_steps, real_parameters, real_points.

    frame: one row per place of the sled; section: as above; name: of the set, for messages and `dataset`. Raises
    ConfigError and IngestError for what is no such set, FitError where the lengths tell no machine.
    """
    read = Section(section, name, _NEEDED, _OPTIONAL)
    case, belts = length_case(frame, read)
    verdict = case.verdict()
    chosen = verdict[2]
    steps, step_errors = length_tables.steps(case, _chain(case, chosen), held_out(frame, read))
    notes, where, next_runs, rivals = _words(case, verdict, belts)
    row = length_tables.verdict_row(
        case, verdict, step_errors, where=where, confusable_with=rivals, next_runs=next_runs
    )
    row |= {"notes": " ".join([*notes, *length_tables.bad_words(case, belts, row_numbers(frame, read))])}
    return {
        "real_verdicts": pd.DataFrame([row]),
        "real_steps": steps,
        "real_parameters": pd.DataFrame(_parameters(case, chosen, belts)),
        "real_points": length_tables.points(case, chosen, belts, row_numbers(frame, read)),
    }


def length_case(frame, read):
    """The LengthCase of a set and the names of its belts; read: its Section."""
    columns = read.mapping("lengths")
    belts, dimensions = tuple(columns), read.choice("dimensions", 2, (2, 3))
    if len(set(columns.values())) < len(belts):
        read.refuse("lengths", list(columns.values()), "another column for each belt")
    if len(belts) <= dimensions:
        read.refuse("lengths", belts, f"at least {dimensions + 1} belts: fewer leave every place unchecked")
    if dimensions == 3 and read.given("heights_mm"):
        read.refuse("heights_mm", read.given("heights_mm"), "nothing where dimensions is 3")
    heights = read.heights("heights_mm", belts)
    free = len(belts) * dimensions - dimensions * (dimensions + 1) // 2
    least = -(-(free + 1) // (len(belts) - dimensions))
    factor = MM[read.choice("unit", "mm", tuple(MM))]
    counted = factor * numbers(frame, list(columns.values()), read.given("files"), least, above=0.0)
    count, short = len(belts), counted.mean(axis=0) <= heights
    if short.any():
        told = f"{belts[short.argmax()]} {counted.mean(axis=0)[short.argmax()]:.3g} mm long on average"
        read.refuse("unit", told, "belts longer than their heights_mm")
    basis, _ = frame_columns(count, dimensions, count)
    origin = np.append(np.zeros(count * dimensions + count), np.ones(count))
    bare = Lengths(counted, np.eye(count), heights, origin, basis)
    return LengthCase(bare, {MISSING: _missing(bare, belts), SCALE: _scale(bare)}, _starts), belts


def _missing(bare, belts):
    """Ways of a length to miss: of all belts alike, of one, of each its own."""
    count = len(belts)
    starts = np.eye(len(bare.origin))[:, -2 * count : -count]
    span = _MISSING_SHARE * float(bare.counted.mean())
    told = [("all belts alike", "a common missing length", starts.sum(axis=1, keepdims=True), _ALIKE)]
    told += [(belt, f"a missing length of {belt}", starts[:, [k]], _SINGLE / count) for k, belt in enumerate(belts)]
    told += [(", ".join(belts), "a missing length per belt", starts, _EACH)]
    return ways_of(MISSING, told, lambda columns: np.full(columns.shape[1], span))


def _scale(bare):
    """The belts' scales: their mean is the frame's, which lengths do not tell."""
    count = bare.counted.shape[1]
    factors = np.eye(len(bare.origin))[:, -count:] @ linalg.null_space(np.ones((1, count)))
    told = [("each belt its own", "a scale per belt", factors, _SCALED)]
    return ways_of(SCALE, told, lambda columns: np.full(columns.shape[1], _SCALE_RANGE))


def _starts(lengths):
    """Values (p,) to start from, out of the lengths themselves."""
    inverse = np.linalg.pinv(lengths.basis)
    for anchors, missing in propose_anchors(lengths.counted, lengths.heights_mm, lengths.dimensions):
        full = np.concatenate([anchors.ravel(), np.full(len(anchors), missing), np.ones(len(anchors))])
        yield inverse @ (full - lengths.origin)


def _chain(case, chosen):
    """Models in the order in which their laws are added, the verdict's last."""
    common, each = case.laws[MISSING][0], case.laws[MISSING][-1]
    missing = [law for law in chosen.laws if law.effect == MISSING] or [common]
    chain = [(), (common,), (each,), (*missing, *case.laws[SCALE]), case.laws[SCALE], chosen.laws]
    return list(dict.fromkeys(chain))


def _first_missing(hypothesis):
    """Missing length of the first belt in mm and its standard error."""
    fit = hypothesis.fit
    return fit.lengths.machine(fit.values)[1][0], fit.lengths.split(hypothesis.standard_errors)[1][0]


def _common(case, chosen):
    """The Hypothesis of one common missing length beside the other laws of the chosen one."""
    others = [law for law in chosen.laws if law.effect != MISSING]
    return case.hypothesis([case.laws[MISSING][0], *others])


def _parameters(case, chosen, belts):
    """Rows of real_parameters: anchors, missing lengths and scales under the chosen laws."""
    fit = chosen.fit
    _, missing, scale = fit.lengths.machine(fit.values)
    _, missing_errors, scale_errors = fit.lengths.split(chosen.standard_errors)
    rows = length_tables.anchors(case, chosen, belts, "in the frame of the first two anchors")
    common = _common(case, chosen)
    if common is not None:
        note = "" if common is chosen else "if one were common to all belts; not part of the verdict. "
        note += _alike_words(common)
        rows.append(length_tables.parameter("missing_length", "mm", *_first_missing(common), 0.0, note))
    if MISSING in chosen.effects and common is not chosen:
        rows += [
            length_tables.parameter(f"{belt}_missing_length", "mm", missing[k], missing_errors[k], 0.0, "")
            for k, belt in enumerate(belts)
            if missing_errors[k] > 0.0
        ]
    if SCALE in chosen.effects:
        note = "true over counted length; the mean is held at 1"
        rows += [
            length_tables.parameter(f"{belt}_scale", "1", scale[k], scale_errors[k], 1.0, note)
            for k, belt in enumerate(belts)
        ]
    return rows


def _alike_words(hypothesis):
    """What the standard error of a missing length would be, were it not that neighbouring rows err alike."""
    if not hypothesis.alike:
        return ""
    error = hypothesis.fit.lengths.split(hypothesis.fit.standard_errors)[1][0]
    return f"+- {error:.1f} mm if neighbouring rows did not err alike, which they do"


def _words(case, verdict, belts):
    """Notes (sentences), where, next_runs and what is confusable, of a verdict."""
    effects, _, chosen = verdict
    notes, where, rivals = [], [], []
    if MISSING in effects:
        law = next(law for law in chosen.laws if law.effect == MISSING)
        where.append(law.where)
        notes.append(_missing_words(case, chosen, law, belts))
        if case.probability_of(lambda laws: law in laws) < 0.9 * case.probability_of(_misses):
            notes.append("Whether all belts miss the same length these rows do not settle.")
            rivals.append("missing_length of other belts")
    else:
        notes.append(_none_missing_words(case, chosen))
    if SCALE in effects:
        where.append("scale of each belt")
        rivals += ["belt_stretch", "drum_radius"]
        scale = chosen.fit.lengths.machine(chosen.fit.values)[2] - 1.0
        low, high = int(scale.argmin()), int(scale.argmax())
        notes.append(
            f"Belt {belts[high]} is longer than counted by {1e3 * scale[high]:.2f} mm per m and {belts[low]} by"
            f" {1e3 * scale[low]:.2f}, against the mean of all belts."
        )
    elif case.probability_of(lambda laws: SCALE in [law.effect for law in laws]) > 0.1:
        notes.append("A scale of its own for each belt is possible, these rows do not settle it.")
        rivals.append(SCALE)
    if UNEXPLAINED in effects:
        notes.append(
            f"{chosen.smooth_mm:.1f} mm are left that follow the place smoothly and that no law here explains"
            " (tension, arms that swing and heights are not measured)."
        )
    next_runs = "one tape measurement between two anchors: lengths alone do not tell a scale that all belts share"
    if {SCALE, UNEXPLAINED} & set(effects):
        next_runs += "; the same places once more with the belts pulled harder: stretch changes, scales do not"
    return notes, ", ".join(where), next_runs, ", ".join(dict.fromkeys(rivals))


def _misses(laws):
    """Whether any missing length is among laws."""
    return MISSING in [law.effect for law in laws]


def _missing_words(case, chosen, law, belts):
    """What misses, and how wrong the frame is without it."""
    _, missing, _ = chosen.fit.lengths.machine(chosen.fit.values)
    error = chosen.fit.lengths.split(chosen.standard_errors)[1]
    acting = np.flatnonzero(error > 0.0)
    if law is case.laws[MISSING][0]:
        side = "longer" if missing[0] > 0.0 else "shorter"
        said = f"Every belt is {abs(missing[0]):.1f} +- {error[0]:.1f} mm {side} than counted"
        independent = _alike_words(chosen)
        said += f" ({independent})" if independent else ""
    else:
        said = "; ".join(
            f"Belt {belts[k]} is {abs(missing[k]):.1f} +- {error[k]:.1f} mm"
            f" {'longer' if missing[k] > 0.0 else 'shorter'} than counted"
            for k in acting
        )
    without = case.hypothesis([other for other in chosen.laws if other.effect != MISSING])
    if without is None:
        return f"{said}."
    sizes = [_size_mm(one.fit) for one in (without, chosen)]
    wrong, side = ("small" if sizes[0] < sizes[1] else "large"), f"from {belts[0]} to {belts[1]}"
    return f"{said}: without it the frame comes out {abs(sizes[1] - sizes[0]) / 1000.0:.2f} m too {wrong} {side}."


def _none_missing_words(case, chosen):
    """That nothing misses, and how well that is known."""
    common = _common(case, chosen)
    if common is None:
        return "These rows are too few to tell whether a length misses."
    value, error = _first_missing(common)
    if not np.isfinite(error):
        return "These rows do not tell whether a length misses."
    return f"No length misses: a common one would be {value:.1f} +- {error:.1f} mm."


def _size_mm(fit):
    """Distance between the first two anchors in mm."""
    first, second, *_ = fit.lengths.machine(fit.values)[0]
    return float(np.linalg.norm(second - first))
