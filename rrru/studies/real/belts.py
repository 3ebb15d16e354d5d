"""Belt machines without measured sled positions: frame, missing lengths and scales from belt lengths alone.

A set of `real: sets:`

    maslow:
      kind: belts
      files: "maslow/run_*.csv"    # one calibration per file
      lengths: {bl: bl_mm, br: br_mm, tr: tr_mm, tl: tl_mm}    # belt: column
      heights_mm: {bl: 34, br: 78, tr: 56, tl: 100}    # of a belt above the plane of the anchors; absent: 0
      unit: mm    # of the lengths: mm (default), m, inch
      row: row    # column that numbers the rows; absent: row, or from 1
      dimensions: 2    # of the sled's places: 2 (default), or 3 without heights

There are at least `dimensions + 1` belts. Lengths alone do not determine the placement of the frame; the order of the
belts fixes it: the anchor of the first is the origin, the second is on the x axis, the third above it. The mirror image
of the frame and a common factor of all belts are not identifiable either; the factor is fixed at 1.
"""

import numpy as np
from scipy import linalg

from rrru.estimation.observations.length_starts import propose_anchors
from rrru.estimation.observations.lengths import Lengths
from rrru.studies.real import length_tables
from rrru.studies.real.length_models import UNEXPLAINED, LengthCase, frame_columns, variants_of
from rrru.studies.real.lengths_section import MM, Section, numbers

MISSING, SCALE = "missing_length", "length_scale"
_NEEDED, _OPTIONAL = ("kind", "files", "lengths"), ("heights_mm", "unit", "row", "dimensions")
# ASSUME missing lengths of 8 % of the mean length, 1 sigma, mostly equal for all belts since these are built alike;
# ASSUME scales of the belts of a machine differ by 4 mm per m, 1 sigma, as those of stretched toothed belts do
_MISSING_SHARE, _ALIKE, _SINGLE, _EACH = 0.08, 0.35, 0.1, 0.05
_SCALE_RANGE, _SCALED = 0.004, 0.5


def study(frame, section, name):
    """Tables of one calibration: real_verdicts, real_steps, real_parameters, real_points.

    frame: one row per place of the sled; section: as above; name: of the set, for messages and `dataset`. Raises
    ConfigError and IngestError for an invalid set, FitError where the lengths do not determine the machine.
    """
    read = Section(section, name, _NEEDED, _OPTIONAL)
    case, belts = length_case(frame, read)
    verdict = case.verdict()
    chosen = verdict[2]
    parameters = _parameters(case, chosen, belts)
    return length_tables.tables(
        frame, read, case, verdict, belts, _chain(case, chosen), parameters, _words(case, verdict, belts)
    )


def length_case(frame, read):
    """The LengthCase of a set and the names of its belts; read: its Section."""
    columns = read.mapping("lengths")
    belts, dimensions = tuple(columns), read.choice("dimensions", 2, (2, 3))
    if len(set(columns.values())) < len(belts):
        read.refuse("lengths", list(columns.values()), "another column for each belt")
    if len(belts) <= dimensions:
        read.refuse("lengths", belts, f"at least {dimensions + 1} belts: fewer give no redundancy")
    if dimensions == 3 and read.given("heights_mm"):
        read.refuse("heights_mm", read.given("heights_mm"), "nothing where dimensions is 3")
    heights = read.heights("heights_mm", belts)
    free = len(belts) * dimensions - dimensions * (dimensions + 1) // 2
    least = -(-(free + 1) // (len(belts) - dimensions))
    factor = MM[read.choice("unit", "mm", tuple(MM))]
    counted = factor * numbers(frame, list(columns.values()), read.given("files"), least, above=0.0)
    count, short = len(belts), counted.mean(axis=0) <= heights
    if short.any():
        shortest = f"{belts[short.argmax()]} {counted.mean(axis=0)[short.argmax()]:.3g} mm long on average"
        read.refuse("unit", shortest, "belts longer than their heights_mm")
    basis, _ = frame_columns(count, dimensions, count)
    origin = np.append(np.zeros(count * dimensions + count), np.ones(count))
    bare = Lengths(counted, np.eye(count), heights, origin, basis)
    return LengthCase(bare, {MISSING: _missing(bare, belts), SCALE: _scale(bare)}, _starts), belts


def _missing(bare, belts):
    """Variants of a missing length: common to all belts, of one belt, one per belt."""
    count = len(belts)
    starts = np.eye(len(bare.origin))[:, -2 * count : -count]
    span = _MISSING_SHARE * float(bare.counted.mean())
    variants = [("all belts alike", "a common missing length", starts.sum(axis=1, keepdims=True), _ALIKE)]
    variants += [(belt, f"a missing length of {belt}", starts[:, [k]], _SINGLE / count) for k, belt in enumerate(belts)]
    variants += [(", ".join(belts), "a missing length per belt", starts, _EACH)]
    return variants_of(MISSING, variants, span)


def _scale(bare):
    """The belts' scales relative to their mean, which lengths do not determine."""
    count = bare.counted.shape[1]
    factors = np.eye(len(bare.origin))[:, -count:] @ linalg.null_space(np.ones((1, count)))
    variants = [("each belt its own", "a scale per belt", factors, _SCALED)]
    return variants_of(SCALE, variants, _SCALE_RANGE)


def _starts(lengths):
    """Start values (p,) from the lengths themselves."""
    inverse = np.linalg.pinv(lengths.basis)
    for anchors, missing in propose_anchors(lengths.counted, lengths.heights_mm, lengths.dimensions):
        full = np.concatenate([anchors.ravel(), np.full(len(anchors), missing), np.ones(len(anchors))])
        yield inverse @ (full - lengths.origin)


def _chain(case, chosen):
    """Combinations of effect models in the order of the steps, the verdict's last."""
    common, each = case.effect_models[MISSING][0], case.effect_models[MISSING][-1]
    missing = [effect_model for effect_model in chosen.effect_models if effect_model.effect == MISSING] or [common]
    chain = [
        (),
        (common,),
        (each,),
        (*missing, *case.effect_models[SCALE]),
        case.effect_models[SCALE],
        chosen.effect_models,
    ]
    return list(dict.fromkeys(chain))


def _first_missing(hypothesis):
    """Missing length of the first belt in mm and its standard error."""
    fit = hypothesis.fit
    return fit.lengths.machine(fit.values)[1][0], fit.lengths.split(hypothesis.standard_errors)[1][0]


def _common(case, chosen):
    """The Hypothesis of one common missing length together with the other effect models of the chosen one."""
    others = [effect_model for effect_model in chosen.effect_models if effect_model.effect != MISSING]
    return case.hypothesis([case.effect_models[MISSING][0], *others])


def _parameters(case, chosen, belts):
    """Rows of real_parameters: anchors, missing lengths and scales of the chosen Hypothesis."""
    fit = chosen.fit
    _, missing, scale = fit.lengths.machine(fit.values)
    _, missing_errors, scale_errors = fit.lengths.split(chosen.standard_errors)
    rows = length_tables.anchors(case, chosen, belts, "in the frame of the first two anchors")
    common = _common(case, chosen)
    if common is not None:
        note = "" if common is chosen else "if one were common to all belts; not part of the verdict. "
        note += _independent_error(common)
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


def _independent_error(hypothesis):
    """The standard error of a missing length for independent errors, in words, where the errors are correlated."""
    if not hypothesis.correlated:
        return ""
    error = hypothesis.fit.lengths.split(hypothesis.fit.standard_errors)[1][0]
    return f"+- {error:.1f} mm for independent rows, but errors of neighbouring rows are correlated"


def _words(case, verdict, belts):
    """Notes (sentences) of a verdict, and its columns where, confounded_with and next_runs."""
    effects, _, chosen = verdict
    notes, where, rivals = [], [], []
    if MISSING in effects:
        effect_model = next(effect_model for effect_model in chosen.effect_models if effect_model.effect == MISSING)
        where.append(effect_model.where)
        notes.append(_missing_words(case, chosen, effect_model, belts))
        one = case.probability_of(lambda models: effect_model in models)
        any_of_them = case.probability_of(lambda models: MISSING in [model.effect for model in models])
        if one < 0.9 * any_of_them:
            notes.append("These rows do not determine whether all belts miss the same length.")
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
    elif case.probability_of(lambda models: SCALE in [model.effect for model in models]) > 0.1:
        notes.append("A separate scale per belt is possible; these rows do not determine it.")
        rivals.append(SCALE)
    if UNEXPLAINED in effects:
        notes.append(
            f"No effect model explains a smooth residual of {chosen.smooth_mm:.1f} mm that depends on the place"
            " (tension, swinging arms and heights are not measured)."
        )
    next_runs = "one tape measurement between two anchors: lengths alone do not determine a common scale of all belts"
    if {SCALE, UNEXPLAINED} & set(effects):
        next_runs += "; the same places again with more belt tension: stretch changes, scales do not"
    rivals = ", ".join(dict.fromkeys(rivals))
    return notes, {"where": ", ".join(where), "confounded_with": rivals, "next_runs": next_runs}


def _missing_words(case, chosen, effect_model, belts):
    """The missing lengths in words, and the error of the frame without them."""
    _, missing, _ = chosen.fit.lengths.machine(chosen.fit.values)
    error = chosen.fit.lengths.split(chosen.standard_errors)[1]
    acting = np.flatnonzero(error > 0.0)
    if effect_model is case.effect_models[MISSING][0]:
        side = "longer" if missing[0] > 0.0 else "shorter"
        said = f"Every belt is {abs(missing[0]):.1f} +- {error[0]:.1f} mm {side} than counted"
        independent = _independent_error(chosen)
        said += f" ({independent})" if independent else ""
    else:
        said = "; ".join(
            f"Belt {belts[k]} is {abs(missing[k]):.1f} +- {error[k]:.1f} mm"
            f" {'longer' if missing[k] > 0.0 else 'shorter'} than counted"
            for k in acting
        )
    without = case.hypothesis([other for other in chosen.effect_models if other.effect != MISSING])
    if without is None:
        return f"{said}."
    sizes = [_size_mm(one.fit) for one in (without, chosen)]
    wrong, side = ("small" if sizes[0] < sizes[1] else "large"), f"from {belts[0]} to {belts[1]}"
    return f"{said}: without it the frame is {abs(sizes[1] - sizes[0]) / 1000.0:.2f} m too {wrong} {side}."


def _none_missing_words(case, chosen):
    """The missing length with its standard error, in words, where the verdict has none."""
    common = _common(case, chosen)
    if common is None:
        return "These rows are too few to determine a missing length."
    value, error = _first_missing(common)
    if not np.isfinite(error):
        return "These rows do not determine a missing length."
    return f"No missing length: the estimate of a common one is {value:.1f} +- {error:.1f} mm."


def _size_mm(fit):
    """Distance between the first two anchors in mm."""
    first, second, *_ = fit.lengths.machine(fit.values)[0]
    return float(np.linalg.norm(second - first))
