"""The tables behind a verdict."""

from collections.abc import Collection, Iterator, Sequence
from itertools import zip_longest

import numpy as np
import pandas as pd
from scipy.special import ndtri, stdtrit

from rrru.arrays import BoolArray, FloatArray
from rrru.campaign import measurements as rows
from rrru.diagnosis.aliases import Facts, ObjectArray, Row
from rrru.diagnosis.detectability import detectability
from rrru.diagnosis.discrepancy_basis import Library
from rrru.diagnosis.inference import InferenceResult
from rrru.diagnosis.model_fit import ModelFit
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.payload_nuisance import WEIGHT
from rrru.diagnosis.problem import GEOMETRY, DiagnosisProblem
from rrru.diagnosis.shrink import ShrinkStep, shrink_table
from rrru.diagnosis.terms import EACH, EffectTerm, legs_text, per_leg, sites, spread
from rrru.diagnosis.variance_by_factor import drive_errors, variance_by_factor
from rrru.diagnosis.verdict import NOT_TESTED, Verdict, label
from rrru.effects.harmonic import is_phase
from rrru.effects.protocol import Effect
from rrru.estimation.intervals import QUANTILE_95
from rrru.robots.drive_words import LENGTH, DriveWords, drive_words

# of a difference of two numbers, as a share of these
_ROUNDING = 1e-12
# the table has columns for so many drives of either unit, whatever the robot
_LEAST_DRIVES = 3
_EMPTY = {"legs": "", "log_evidence": np.nan}
_EMPTY |= dict.fromkeys(("heldout_gain", "heldout_gain_low", "heldout_gain_high"), np.nan) | {"note": ""}

# reasons in the order in which they count: a point has the first that fits
REASONS = (
    "not measured",
    "stale reading",
    "outlier in the file",
    "held out for a test",
    "not solved",
    "out of reach",
    "near a singularity",
    "outlier to the diagnosis",
)
# runs whose outliers are named in a sentence
_MAX_NAMED = 8
_STATUS = {
    "stale": "stale reading",
    "outlier": "outlier in the file",
    rows.HELD_OUT: "held out for a test",
    "unsolved": "not solved",
}


def details_of(
    inference: InferenceResult,
    verdict: Verdict,
    steps: Sequence[ShrinkStep],
    residual_mm: FloatArray,
    generator: np.random.Generator,
    draws: int,
) -> dict[str, pd.DataFrame]:
    """Frames by table name, without the campaign; residual_mm (n, 3): measured minus calibrated model."""
    problem, linear = inference.problem, inference.problem.linearise(inference.calibrated)
    exact = problem.residual(inference.state) if inference.state.effects else None
    drive = drive_errors(problem.by_point(residual_mm), problem.by_point(linear.drive))
    return {
        "gap_locate": variance_by_factor(problem, residual_mm, linear.drive, generator, draws),
        "gap_identifiability": detectability(problem, linear),
        "gap_attribute": _attribute_rows(inference, verdict),
        "gap_sets": _set_rows(inference),
        "gap_shrink": shrink_table(problem, steps, exact),
        "gap_points": _point_rows(inference, steps[-1].residual_mm[problem.positions], drive),
    }


def _attribute_rows(inference: InferenceResult, verdict: Verdict) -> pd.DataFrame:
    """Rows of `gap_attribute`: every effect of the library, none and unexplained, with the Verdict's decision on it."""
    posterior, problem = inference.posterior, inference.problem
    result = [_effect_row(inference, name) for name in problem.effects]
    result += [
        {"effect": name, "probability": np.nan, **_EMPTY, "note": f"not tested: {note}"}
        for name, note in problem.untestable.items()
    ]
    none, unknown = posterior.sets.get((frozenset(), False), 0.0), posterior.probability_unexplained
    result.append({"effect": "none", "probability": none, **_EMPTY})
    result.append({"effect": "unexplained", "probability": unknown, **_EMPTY})
    rows = pd.DataFrame(result)
    decisions = [NOT_TESTED if name in problem.untestable else verdict.decision(name) for name in rows["effect"]]
    rows.insert(2, "decision", decisions)
    groups = map(verdict.group_of, rows["effect"])
    rows.insert(3, "group_probability", [group.probability if group else np.nan for group in groups])
    return rows


def where(inference: InferenceResult, effects: Collection[str], numbers: pd.DataFrame) -> str:
    """Where the effects of a verdict act: of each its sites in words, several in a row by the first and the last.

    Of an effect of several legs the sites of those at which it is not zero, see `acting_places`. Sites of an effect
    before are not listed again. Where bars are driven, drives have their names of `drive_words`. numbers: rows of
    `gap_parameters`.
    """
    problem, words = inference.problem, drive_words(inference.problem.mechanism)
    drives = dict(zip(words.names, words.all_names, strict=True)) if LENGTH in words.kinds else {}
    found: list[str] = []
    listed: set[str] = set()
    for term in inference.hypothesis.terms:
        if term.effect not in effects:
            continue
        own = acting = sites(problem.library, problem.motion, term)
        if per_leg(problem.library[term.effect]):
            places = acting_places(numbers[numbers["effect"] == term.effect].to_dict("records"))
            legs = np.unique(problem.library[term.effect].coordinates.legs).tolist()
            acting = sites(problem.library, problem.motion, term, [leg for leg in legs if words.place(leg) in places])
        every = sites(problem.library, problem.motion, term._replace(legs=EACH))
        chosen = [site for site in acting or own if site not in listed]
        listed |= {*chosen}
        found += _ranges([drives.get(site, site) for site in every], [drives.get(site, site) for site in chosen])
    return ", ".join(found)


def _ranges(names: Sequence[str], chosen: Collection[str]) -> list[str]:
    """Chosen ones of some names in their order, those in a row as "first to last"."""
    result: list[list[str]] = []
    for last, name in zip(("", *names), names, strict=False):
        if name in chosen:
            if last in chosen:
                result[-1].append(name)
            else:
                result.append([name])
    return [run[0] if len(run) == 1 else f"{run[0]} to {run[-1]}" for run in result]


def acting_places(numbers: Sequence[Facts]) -> list[str]:
    """Places of an effect at which one of its numbers is not zero by its 95 % interval; where there is none, those at
    which one was fitted, else all.

    numbers: its rows of `gap_parameters`. Of n numbers of one place each has an interval of 1 - 0.05 / n (Bonferroni),
    so that chance alone names one place in twenty. The phase of a wave says nothing: no amplitude has the phase zero.
    """
    by_place: dict[str, list[Facts]] = {}
    for number in numbers:
        if number["place"] and not is_phase(number["parameter"]):
            by_place.setdefault(number["place"], []).append(number)
    acting = [place for place, its in by_place.items() if any(_is_not_zero(one, len(its)) for one in its)]
    fitted = [place for place, its in by_place.items() if not all(np.isnan(one["low_95"]) for one in its)]
    return acting or fitted or [*by_place]


def is_off_zero(number: Facts) -> bool:
    """Whether the 95 % interval of a number, a row of `gap_parameters`, is on one side of zero, not next to it."""
    least = OPTIONS.min_end_ratio * abs(number["value"])
    return bool(number["low_95"] > least or number["high_95"] < -least)


def _is_not_zero(number: Facts, count: int) -> bool:
    """Whether the interval of one of so many numbers, a row of `gap_parameters`, does not hold zero."""
    value, low, high = (number[key] for key in ("value", "low_95", "high_95"))
    wider = float(ndtri(1.0 - 0.025 / count)) / QUANTILE_95
    above, below = value - wider * (value - low) > 0.0, value + wider * (high - value) < 0.0
    # an interval that begins at zero, the bound of a size, stays there
    return is_off_zero(number) and bool(above or below)


def _effect_row(inference: InferenceResult, name: str) -> Row:
    """The row of one testable effect."""
    posterior = inference.posterior
    row: Row = {"effect": name, "probability": posterior.marginal(name), **_EMPTY}
    holding = [h for h in posterior.hypotheses if name in h.effects]
    if not holding:
        return row | {"note": "far less probable than others"}
    best = max(holding, key=lambda h: h.evidence.max())
    row["log_evidence"] = float(best.evidence.max() - inference.evidence.on_library().none.max())
    if per_leg(inference.problem.library[name]) and (legs := posterior.legs(name)):
        row["legs"] = legs_text(max(legs.items(), key=lambda item: item[1])[0])
    single = max((h for h in holding if len(h.terms) == 1), key=lambda h: h.evidence.max(), default=None)
    if single:
        level, held_out = int(single.evidence.argmax()), inference.held_out.on_complete(single.terms)
        gained = held_out.predict(single.terms, single.prior_scales[level], level).log_score
        gained = gained - held_out.log_score_alone(level)
        by_fold = np.array([gained[held_out.fold == k].sum() for k in np.unique(held_out.fold)])
        row["heldout_gain"] = float(by_fold.sum())
        if len(by_fold) > 1:
            half = float(stdtrit(len(by_fold) - 1, 0.975) * np.sqrt(len(by_fold)) * by_fold.std(ddof=1))
            row |= {"heldout_gain_low": row["heldout_gain"] - half, "heldout_gain_high": row["heldout_gain"] + half}
    return row


def _set_rows(inference: InferenceResult) -> pd.DataFrame:
    """Rows of `gap_sets`: the most probable sets."""
    result, none = [], inference.evidence.on_library().none.max()
    sets = list(inference.posterior.sets.items())[: OPTIONS.max_listed_sets]
    for rank, ((effects, unexplained), probability) in enumerate(sets, start=1):
        best = inference.posterior.best_of(effects, unexplained)
        # a set of the posterior has a hypothesis
        assert best is not None
        hypothesis = best[0]
        row = {
            "rank": rank,
            "effects": label(tuple(sorted(effects)), unexplained),
            "legs": ", ".join(f"{term.effect}: {legs_text(term.legs)}" for term in hypothesis.terms),
            "unexplained": unexplained,
            "probability": probability,
            "log_evidence": float(hypothesis.evidence.max() - none),
        }
        result.append(row)
    return pd.DataFrame(result)


def parameter_rows(inference: InferenceResult) -> pd.DataFrame:
    """Rows of `gap_parameters`: all parameters of the corrected model with standard errors."""
    fit, library = inference.fit, inference.problem.effects
    parameters, errors = inference.problem.mechanism.parameters, fit.stated.block_errors(GEOMETRY)
    intervals, places = fit.stated.intervals, fit.estimate.parameters.slices
    result = [
        ("calibration", parameter.name, "", parameter.unit, value, error, *interval, held)
        for parameter, value, error, interval, held in zip(
            parameters,
            fit.state.deviations,
            errors,
            intervals[places[GEOMETRY]],
            fit.estimate.at_bound[places[GEOMETRY]].tolist(),
            strict=True,
        )
    ]
    words = drive_words(inference.problem.mechanism)
    for term in fit.terms:
        effect, (values, errors, ends) = library[term.effect], _effect_values(fit, library, term)
        bound = effect.parameters.at_bound(values) & (errors > 0.0)
        errors = np.where(errors > 0.0, errors, np.nan)
        result += [
            (term.effect, parameter.name, place, parameter.unit, value, error, *interval, held)
            for parameter, place, value, error, interval, held in zip(
                effect.parameters, places_of(effect, words), values, errors, ends, bound.tolist(), strict=True
            )
        ]
    bounds, nuisance = inference.problem.bounds, intervals[places[WEIGHT]] if WEIGHT in places else ()
    result += [
        (WEIGHT, name, "", unit, value, error, *interval, value in bounds[name])
        for (name, unit, value, error), interval in zip(fit.weight, nuisance, strict=True)
    ]
    numbers = ("value", "standard_error", "low_95", "high_95", "at_bound")
    return pd.DataFrame(result, columns=("effect", "parameter", "place", "unit", *numbers))


def places_of(effect: Effect, words: DriveWords) -> list[str]:
    """Where each parameter of an effect acts, in words, "" for one that belongs to no single leg.

    words: the robot's DriveWords.
    """
    coordinates = effect.coordinates
    shape = coordinates.shapes[0]
    rest = coordinates.to_values(np.zeros(len(coordinates)), shape)
    moved = {
        leg: coordinates.to_values(np.where(coordinates.legs == leg, coordinates.typical, 0.0), shape) != rest
        for leg in np.unique(coordinates.legs).tolist()
        if leg > 0
    }
    owners = [[leg for leg, changed in moved.items() if changed[k]] for k in range(len(rest))]
    return [words.place(legs[0]) if len(legs) == 1 else "" for legs in owners]


def value_steps(fit: ModelFit, library: Library, term: EffectTerm) -> Iterator[tuple[FloatArray, FloatArray, float]]:
    """Parameter values (p,) of a term's effect a step above and below what was fitted, and the size between both.

    One such step for each number of `ModelFit.effect_covariance`, for derivatives by these.
    """
    state, key, coordinates = fit.state, (term.effect, term.shape), library[term.effect].coordinates
    shape, present, matrix = state.shape(library, key), state.effects[key], spread(coordinates, term.legs)
    names, _ = fit.effect_covariance(term)
    shifts: list[tuple[FloatArray | float, dict[str, float]]] = [
        (1e-4 * column * coordinates.typical.max(), {}) for column in matrix.T
    ]
    shifts += [(0.0, {name: 1e-4 * max(abs(shape[name]), 1e-6)}) for name in names]
    for shift, moved in shifts:
        up, down = (
            coordinates.to_values(
                present + sign * shift, dict(shape) | {name: shape[name] + sign * step for name, step in moved.items()}
            )
            for sign in (1.0, -1.0)
        )
        yield up, down, 2.0 * (sum(moved.values()) if moved else np.max(shift))


def _effect_values(fit: ModelFit, library: Library, term: EffectTerm) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Parameter values (p,) of a term's effect, standard errors (p,), 0 for what was not fitted, intervals (p, 2).

    The interval of a parameter that follows one fitted number is that number's, of others it is two standard errors to
    both sides; NaN for what was not fitted.
    """
    state, key, coordinates = fit.state, (term.effect, term.shape), library[term.effect].coordinates
    covariance, values = (
        fit.effect_covariance(term)[1],
        coordinates.to_values(state.effects[key], state.shape(library, key)),
    )
    # a phase may have passed a full turn
    differences = [(up - down, size) for up, down, size in value_steps(fit, library, term)]
    slope = np.stack([np.where(np.abs(step) > np.pi, 0.0, step) / size for step, size in differences], axis=-1)
    errors = np.sqrt(np.maximum(np.diag(slope @ covariance @ slope.T), 0.0))
    ends = values[:, None] + QUANTILE_95 * np.outer(errors, [-1.0, 1.0])
    numbers, intervals = fit.effect_numbers(term)
    for row, slopes in enumerate(slope):
        (followed,) = np.nonzero(slopes)
        if len(followed) == 1:
            number = followed[0]
            ends[row] = followed_interval(values[row], slopes[number], numbers[number], intervals[number])
    ends[~slope.any(axis=1)] = np.nan
    return values, errors, ends


def followed_interval(value: float, slope: float, number: float, interval: FloatArray) -> FloatArray:
    """Interval (2,) of a value that follows a number with an interval (2,) at a slope.

    An end at zero, such as a bound, is zero and not its rounding.
    """
    ends = np.sort(value + slope * (interval - number))
    return np.where(np.abs(ends) < _ROUNDING * abs(value), 0.0, ends)


def _point_rows(inference: InferenceResult, after: FloatArray, drive: FloatArray) -> pd.DataFrame:
    """Rows of `gap_points`; after (n, 3), drive (n, K): residuals of the corrected model and errors of the drives."""
    problem = inference.problem
    frame = problem.measurements[["run", "trajectory", "point"]].reset_index(drop=True)
    before = problem.left(inference.calibrated)[: len(frame)]
    units = problem.mechanism.parts.units
    after, drive = (_at(problem.used, values) for values in (after, drive))
    unknown = np.full(len(before), np.nan)
    return frame.assign(
        **rows.vector_columns("command", rows.command(problem.measurements)),
        **rows.vector_columns("before", before),
        **rows.vector_columns("after", after),
        **{
            f"drive_error{k}_{unit}": drive[:, k - 1] if own == unit else unknown
            for unit in ("rad", "mm")
            for k, own in zip_longest(range(1, max(len(units), _LEAST_DRIVES) + 1), units)
        },
        used=problem.used,
    )


def _at(used: BoolArray, values: FloatArray) -> FloatArray:
    """Values (m, 3) at all points from those (n, 3) of the used ones, NaN at the others."""
    result = np.full((len(used), values.shape[1]), np.nan)
    result[used] = values
    return result


def left_out(problem: DiagnosisProblem, use_near_singularity: bool) -> pd.DataFrame:
    """Rows of `gap_left_out` without the campaign: the points that a problem does not use, counted by reason."""
    reasons = _reasons(problem, use_near_singularity)
    counts = pd.Series(reasons[~problem.used], dtype=object).value_counts()
    found = [reason for reason in REASONS if reason in counts]
    return pd.DataFrame({"reason": found, "points": [int(counts[reason]) for reason in found]})


def left_out_note(table: pd.DataFrame, used: int, whole: int) -> str:
    """A sentence on a table of `left_out`."""
    counts = ", ".join(f"{points} {reason}" for reason, points in table.itertuples(index=False))
    return f"{used} of {whole} points used; left out: {counts}"


def outlier_note(problem: DiagnosisProblem, use_near_singularity: bool) -> str:
    """A sentence that names the points which the diagnosis left out as outliers; empty where there are none."""
    dropped = ~problem.used & (_reasons(problem, use_near_singularity) == REASONS[-1])
    places = problem.measurements.loc[dropped, ["trajectory", "run", "point"]]
    if places.empty:
        return ""
    named = [
        f"{trajectory} (run {run}): point {', '.join(map(str, its))}"
        for (trajectory, run), its in places.groupby(["trajectory", "run"], sort=False)["point"]
    ]
    more = f", and more in {len(named) - _MAX_NAMED} runs" if len(named) > _MAX_NAMED else ""
    check = "see these rows, and whether a stop before them is not in the file"
    return f"outliers to the diagnosis: {', '.join(named[:_MAX_NAMED])}{more}, {check}"


def _reasons(problem: DiagnosisProblem, use_near_singularity: bool) -> ObjectArray:
    """Why each point (N,) of a problem may be left out."""
    frame, (actuators, command) = problem.measurements, problem.driven
    status = frame["status"].to_numpy(dtype=object)
    reached = np.isfinite(problem.motion.position_mm).all(axis=1)
    reached &= np.isfinite(problem.mechanism.forward(actuators, guess_mm=command)).all(axis=1)
    near = (status == "near_singularity") & (not use_near_singularity)
    cases = [
        ("not measured", ~np.isfinite(rows.measured(frame)).all(axis=1)),
        *((reason, status == name) for name, reason in _STATUS.items()),
        ("out of reach", ~reached),
        ("near a singularity", near),
    ]
    conditions = [rows_of for _, rows_of in cases]
    return np.select(conditions, [reason for reason, _ in cases], default=REASONS[-1]).astype(object)
